"""Opens the path that a user gives as SOURCE, recognises its format, and returns its Sequences.

SOURCE is a stored sequence or dataset, or a recording in a public format. New readers are added here.
"""

from __future__ import annotations

import os
import os.path
import warnings
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import FRAME_RATES, SCALES, is_number
from scenarios.reading import is_present, require_regular
from sim.pictures.background_sample import parse_choice
from sim.pictures.picture_folder import SUFFIXES as PICTURES
from sim.store import packs, sequence_folder
from sim.store.numeric_text import NAME_THEM
from sim.store.own_files import is_hidden
from sim.store.seal import is_sequence
from sim.types import Array, Camera, Sequence, Truth
from tracking.recordings import biwi, caviar, mot_folder, mot_text, people_texts, video
from tracking.recordings.calibration import read_calibration
from tracking.recordings.detector_boxes import with_boxes
from tracking.recordings.options import BoxOptions, RecordingOptions, parse_box_scale, parse_classes

KINDS = (
    "a generated sequence or dataset, a MOTChallenge folder or text, trajectories, a text of KITTI, a BIWI folder, "
    "a CAVIAR XML, a video"
)
VIDEOS = f"{KINDS} ({' '.join(video.SUFFIXES)})"
TEXTS = (".txt", ".csv", ".tsv")
DEPTH = 3
CHECKED = 1000  # frames whose boxes are compared with a given camera


def open_source(
    path: str | Path, *, fps: float | None = None, px_per_m: float | None = None,
    camera: Camera | str | Path | None = None, images: bool = True, background: str | None = None,
    person_class: int | str | None = None, box_scale: str | None = None, min_score: float | None = None,
    boxes: str | Path | None = None,
) -> list[Sequence]:  # fmt: skip
    """Opens a path that holds sequences or recordings, in any known format.

    Args:
        path: A generated sequence, shard or dataset, a MOTChallenge folder or text, a text of trajectories (TrajNet++,
            ETH and UCY, PedPy) or of KITTI's tracking, a BIWI folder, a CAVIAR XML, a video, or a folder with some of
            these (of texts only .ndjson) at most 3 levels down. Hidden names are skipped.
        fps: Frames per second, in place of those that the recording states.
        px_per_m: Image scale, px per m.
        camera: Calibration, or the path of its file.
        images: False leaves out the pictures of MOTChallenge folders.
        background: Frames for background models, "first:N" or "spread:N", or the path of a picture of the empty place,
            used together with spread:50; None: spread:50, or the stored empty frames.
        person_class: Classes of people in MOTChallenge texts that have classes, as 1, "1,2" or "person"; None: 1, or
            "person" and "pedestrian" if they are words, with a warning about others. Of KITTI's labels "pedestrian".
        box_scale: Factor of the boxes of MOTChallenge texts that are not in pixels of the pictures, "X" or "X,Y".
        min_score: Detections of MOTChallenge texts with a lower score, as it stands there, are left out.
        boxes: File with the detections of one sequence, which the three options above then belong to: MOTChallenge
            text, table with named columns, or COCO results.

    Returns:
        The Sequences: of a folder sorted by path, subfolders first. Truth and pictures are read later.

    Raises:
        InputError: There is nothing known at the path, a file is invalid, or an option is wrong or has no effect.
    """
    path = Path(path)
    for option, value, (low, high) in (("--fps", fps, FRAME_RATES), ("--px-per-m", px_per_m, SCALES)):
        expected = f"a number from {low:g} to {high:g}"
        reject(value is not None and not is_number(value, low, high), "", value, expected, f"correct {option}", option)
    if isinstance(camera, str | Path):
        camera = read_calibration(Path(camera))
    of_boxes = BoxOptions(
        None if person_class is None else parse_classes(person_class),
        None if box_scale is None else parse_box_scale(box_scale), min_score,
    )  # fmt: skip
    options = RecordingOptions(
        fps, px_per_m, camera, images, None if background is None else parse_choice(background),
        of_boxes if boxes is None else BoxOptions(),
    )  # fmt: skip
    sequences = _open(path, options)
    got = f"{len(sequences)} sequences"
    reject(boxes is not None and len(sequences) > 1, "", got, "one sequence", "give one of them", "--boxes")
    if boxes is not None:
        sequences = [with_boxes(sequences[0], Path(boxes), of_boxes)]
    return sequences if camera is None else [_with_checked_camera(each) for each in sequences]


def _with_checked_camera(sequence: Sequence) -> Sequence:
    """Returns the sequence, which warns of a camera that does not fit its boxes: those detected, else the labelled."""
    frames = sequence.without_pictures() if sequence.has_detections else ()
    found = (frame.detections for frame in islice(frames, CHECKED))
    detected = [each.box for each in found if each is not None and each.box is not None]
    load = sequence.load_truth
    if detected or load is None:
        _check_camera(sequence, np.concatenate([np.zeros((0, 4)), *detected]))
        return sequence

    def truth() -> Truth:
        labels = load()
        _check_camera(sequence, np.zeros((0, 4)) if labels.box is None else labels.box)
        return labels

    return replace(sequence, load_truth=truth)


def _check_camera(sequence: Sequence, box: Array) -> None:
    from sim.scene.standing import stature_doubt

    if sequence.camera is not None and (doubt := stature_doubt(box, sequence.camera)):
        warnings.warn(f"{sequence.source['path']}: {doubt}", stacklevel=2)


def _open(path: Path, options: RecordingOptions) -> list[Sequence]:
    reject(not os.path.exists(path), path, "nothing there", KINDS, "check the path")
    if not os.path.isdir(path):
        require_regular(path)
        return [_open_one(p, options) for p in _unpacked(path)]
    found = list(_find(path, DEPTH))
    if not found:
        got, remedy = "a folder without sequences", "check the path"
        if any(next(path.glob(pattern), None) for pattern in ("run.json", "*/run.json")):
            got = "tracks, what `flockscope track` wrote"
            remedy = "give the sequence or dataset first, then the tracks: swap the arguments"
        elif sum(p.suffix.lower() in PICTURES for p in path.iterdir() if not is_hidden(p)) > 1:
            got, remedy = "a folder of pictures, without img1", f"move the pictures to {path / 'img1'}"
        elif texts := [p for p in path.iterdir() if p.suffix.lower() in TEXTS and not is_hidden(p)]:
            got, remedy = f"a folder of texts, as {min(texts).name}", "give one text, with its path"
        raise InputError(file=path, got=got, expected=KINDS, remedy=remedy)
    return _distinct([_open_one(p, options) for path in found for p in _unpacked(path)])


def _unpacked(path: Path) -> Iterable[Path]:
    return packs.unpacked(path.absolute()) if packs.is_shard(path) else (path,)


def _distinct(sequences: list[Sequence]) -> list[Sequence]:
    # Recordings may share a name, in their files or of files in several folders; the files or folders do not.
    count = Counter(s.name for s in sequences)
    for k, each in enumerate(sequences):
        if count[each.name] > 1 and each.source["kind"] != "generated":
            path = Path(each.source["path"]).absolute()
            name = path.name if path.is_dir() else path.stem if path.stem != each.name else path.parent.name
            words = f"is the name of {count[each.name]} sequences; it is called {name}, as its folder or file"
            warnings.warn(f"{path}: {each.name} {words}", stacklevel=3)
            sequences[k] = replace(each, name=name)
    return sequences


def holds_sequences(folder: Path) -> bool:
    """Returns True if `open_source` finds a sequence or recording in the folder, at most 3 levels down."""
    return bool(_find(folder, DEPTH))


def generated_folders(path: Path) -> list[Path]:
    """Returns the folders of the generated sequences at a path or at most 3 levels below it, sorted; of shards those
    that they are unpacked to.

    Raises InputError if there are none, or a sequence is of another kind.
    """
    shards = _find(path, DEPTH) if path.is_dir() else [path] if packs.is_shard(path) else []
    found = [folder for each in shards for folder in _unpacked(each)]
    other = next((p for p in found if _kind(p) != "generated"), None)
    got = "no sequences" if other is None else f"a recording, {other.name}"
    wrong, remedy = not found or other is not None, "give what `flockscope generate` made"
    reject(wrong, path, got, "a generated sequence or dataset", remedy)
    return found


def _open_one(path: Path, options: RecordingOptions) -> Sequence:
    path = path.parent if path.name == "obsmat.txt" else path
    kind, suffix = _kind(path), path.suffix.lower()
    if kind is None:
        of_boxes = "if these are boxes: flockscope track TRACKER VIDEO --boxes FILE"
        remedy = of_boxes if suffix == ".json" else f"if it holds rows of people, write them as .csv, and {NAME_THEM}"
        raise InputError(file=path, got=f"a {suffix or 'nameless'} file", expected=VIDEOS, remedy=remedy)
    name, refused, why, read = READERS[kind]
    options.reject(path, name, why, refused)
    return read(path, options)


def _generated(folder: Path, options: RecordingOptions) -> Sequence:
    return sequence_folder.open_sequence(folder, background=options.background)


IN_METRES, ON_LABELS = "it is in metres, without pictures", "camera background box_options"
IN_IMAGE = "its truth is in the image, without pictures"
TRAJECTORIES = ("a text of trajectories", f"px_per_m {ON_LABELS}", IN_METRES)
DRIVES = "its camera drives, and it has labels of people only"
# of each kind of source its name, the options without effect on it, why they have none, and the reader
READERS: dict[str, tuple[str, str, str, Callable[[Path, RecordingOptions], Sequence]]] = {
    "generated": ("a generated sequence", "fps px_per_m camera box_options", "it knows its own", _generated),
    "biwi": ("a BIWI recording", f"px_per_m {ON_LABELS}", IN_METRES, biwi.open_folder),
    "mot": ("a MOTChallenge folder", "", "", mot_folder.open_folder),
    "caviar": ("a file of CVML", "background box_options", IN_IMAGE, caviar.open_file),
    "video": ("a video without --boxes", "box_options", "it has no boxes", video.open_video),
    "text": ("a text", "background", "it has no pictures", mot_text.open_text),
    "kitti": ("a text of KITTI", "camera background box_scale min_score", DRIVES, people_texts.open_kitti),
    **{k: (*TRAJECTORIES, partial(people_texts.open_text, k)) for k in people_texts.LAYOUTS},
}


def _kind(path: Path) -> str | None:
    if path.is_dir():
        if is_sequence(path):
            return "generated"
        if is_present(path / "obsmat.txt"):
            return "biwi"
        parts = ("seqinfo.ini", "gt/gt.txt", "det/det.txt", "img1")
        return "mot" if any((path / part).exists() for part in parts) else None
    suffix = path.suffix.lower()
    if suffix in (*TEXTS, people_texts.NDJSON):
        return people_texts.layout_of(path) or "text"
    return "caviar" if suffix == ".xml" else "video" if suffix in video.SUFFIXES else None


def _find(folder: Path, depth: int) -> list[Path]:
    if _kind(folder) is not None:
        return [folder]
    if depth == 0:
        return []
    found = [p for p in sorted(folder.iterdir()) if not is_hidden(p)]
    deeper = [q for p in found if p.is_dir() for q in _find(p, depth - 1)]
    return deeper + [p for p in found if p.is_file() and _is_recording(p)]


def _is_recording(path: Path) -> bool:
    suffix = path.suffix.lower()
    known = suffix in (*video.SUFFIXES, people_texts.NDJSON) or packs.is_shard(path)
    return known or (suffix == ".xml" and caviar.is_caviar(path))
