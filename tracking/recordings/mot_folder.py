"""Reader for MOTChallenge folders (seqinfo.ini, img1/, gt/, det/), as Sequences."""

from __future__ import annotations

import configparser
import warnings
from collections.abc import Iterator
from dataclasses import astuple, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import FRAME_RATES, FRAMES, PICTURE_SIZES, fits_picture
from scenarios.limits import PICTURE_SIDE as SIDE
from scenarios.reading import is_present
from sim.arrays import joined
from sim.pictures.background_sample import BackgroundChoice, BackgroundSample
from sim.pictures.picture_folder import PictureFolder, fill_gaps, find_pictures, find_right_pictures
from sim.scene.camera import scaled_to_image
from sim.store.numeric_text import bounded_number, read_text
from sim.store.recorded_sequence import Pictures, recorded_sequence
from sim.types import Image, Ints, Sequence, Truth
from tracking.recordings import mot_text
from tracking.recordings.mot_table import read_table, size_doubt
from tracking.recordings.options import NO_OPTIONS, RecordingOptions


@dataclass(frozen=True)
class SeqInfo:
    """The content of a seqinfo.ini."""

    name: str  # the folder's name if missing
    fps: float | None  # frames per second, None if missing
    length: int | None  # number of frames, None if missing
    image_size: tuple[int, int] | None  # (width, height) px, None if one is missing
    image_dir: str = "img1"  # the folder of the pictures, relative to the sequence's, "img1" if missing


def read_seqinfo(path: Path) -> SeqInfo:
    """Returns the values in the section [Sequence] of a seqinfo.ini; default values for missing keys, or no file."""
    parser = configparser.ConfigParser(interpolation=None)
    try:
        parser.read_string(read_text(path) if is_present(path) else "")
    except configparser.Error as error:
        reason = (error.message.splitlines() or ["no ini file"])[0]
        raise InputError(file=path, got=reason, expected="key=value lines", remedy="correct the file") from None
    if parser.sections() and not parser.has_section("Sequence"):
        got = ", ".join(f"[{name}]" for name in parser.sections())
        raise InputError(file=path, got=got, expected="[Sequence]", remedy="correct the name of the section")
    section = dict(parser["Sequence"]) if parser.sections() else {}

    def number(key: str, low: float, high: float, whole: bool = True) -> Any:
        if key.lower() not in section:
            return None
        value = bounded_number(path, key, section[key.lower()], low, high, whole)
        return int(value) if whole else value

    length, w, h = (number(k, 1, high) for k, high in (("seqLength", FRAMES), ("imWidth", SIDE), ("imHeight", SIDE)))
    size = None if w is None or h is None else (w, h)
    if size is not None and not fits_picture(*size):
        got = "{}×{} px".format(*size)
        raise InputError(file=path, place="imWidth, imHeight", got=got, expected=PICTURE_SIZES, remedy="correct them")
    name, rate = section.get("name", path.parent.name), number("frameRate", *FRAME_RATES, whole=False)
    return SeqInfo(name, rate, length, size, section.get("imdir", "img1"))


def open_folder(path: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns a MOTChallenge folder (seqinfo.ini, img1/, gt/gt.txt, det/det.txt, each optional) as Sequence.

    img1_right/ holds the pictures of the right camera of a rectified pair. The length is that of seqinfo.ini, else the
    last frame of texts and pictures. The truth is read, and checked, when asked for.
    """
    info, images, background = read_seqinfo(path / "seqinfo.ini"), options.images, options.background
    rate = mot_text.frame_rate(options.fps, info.fps)
    gt, det = path / "gt" / "gt.txt", path / "det" / "det.txt"
    found, of_boxes = None, options.box_options
    if is_present(det):
        table = read_table(det, length=info.length, box_scale=of_boxes.box_scale, px_per_m=options.px_per_m)
        if not is_present(gt):  # else --class may be of the labels
            mot_text.require_classes(table, of_boxes.person_class)
        found = mot_text.detections_of_table(table, of_boxes)
    else:
        names = "box_scale min_score" if is_present(gt) else "box_scale min_score person_class"
        options.reject(path, "a recording without det/det.txt", "it has no detections", names)
    pictures = left_pictures(path)
    right = find_right_pictures(path / f"{info.image_dir}_right", pictures)
    length = info.length or max(_labelled_frames(path).max(initial=0).item(), pictures.last)
    expected = "a row in gt.txt or det.txt, a picture, or seqLength in seqinfo.ini"
    reject(not length, path, "nothing that tells its length", expected, "complete it")
    beyond = [file.name for frame, file in pictures.files.items() if frame > length]
    if beyond and len(pictures.files) <= length:
        got, expected = f"{beyond[0]} among {len(pictures.files)} pictures", f"frames 1 to {length}"
        remedy = "rename the pictures: each gets the number of its frame, or correct seqLength"
        raise InputError(file=path, got=got, expected=expected, remedy=remedy)
    if beyond:
        warnings.warn(f"{path}: {len(beyond)} pictures beyond frame {length} (seqLength) are not read", stacklevel=2)
    seen = pictures.first_size() if images or info.image_size is None else None
    size = info.image_size or seen
    if seen is not None and size != seen:
        got, expected = "{} × {}".format(*size or ()), "{} × {}, the size of the pictures".format(*seen)
        ini, remedy = path / "seqinfo.ini", "correct it, or restore the pictures"
        raise InputError(file=ini, place="imWidth, imHeight", got=got, expected=expected, remedy=remedy)
    if found is not None and found.box is not None and size is not None and (doubt := size_doubt(found.box, size)):
        warnings.warn(f"{det}: {doubt}", stacklevel=2)
    if not pictures.files:
        options.reject(path, "a recording without pictures", "it has none", "background")
    choice = (background or BackgroundChoice()).of(length, path, size) if pictures.files else None

    def shown(folder: PictureFolder, name: str) -> Pictures | None:
        every = range(1, length + 1)
        there = images and pictures.files and folder.files
        return (lambda: fill_gaps(folder.read(every, seen), length, name)) if there else None

    def truth() -> Truth:
        table = read_table(gt, length=length, px_per_m=options.px_per_m)
        return mot_text.truth_of_table(table, info.name, rate, length, options.scale, of_boxes.person_class)

    def sample(wanted: list[int]) -> Iterator[tuple[int, Image]]:
        return pictures.read(wanted, seen or pictures.first_size())

    more: dict[str, Any] = {} if choice is None else {"background": str(choice)}
    more |= {} if pictures.numbering is None else {"numbering": astuple(pictures.numbering)}
    source = {"kind": "mot", "path": str(path), **of_boxes.given(), **more}
    return recorded_sequence(
        source, info.name, rate, length, detections=None if found is None else partial(found.at, fps=rate),
        left=shown(pictures, path.name), right=shown(right, f"{path.name}, right"),
        load_truth=truth if gt.is_file() else None, image_size=size, px_per_m=options.scale,
        camera=options.camera and scaled_to_image(options.camera, size, path),
        load_background=None if choice is None else BackgroundSample(choice, length, path, sample),
    )  # fmt: skip


def left_pictures(path: Path) -> PictureFolder:
    """Returns the PictureFolder of the left camera of the MOTChallenge folder `path`."""
    info = read_seqinfo(path / "seqinfo.ini")
    texts = is_present(path / "gt" / "gt.txt") or is_present(path / "det" / "det.txt")
    return find_pictures(path / info.image_dir, info.length, (lambda: _labelled_frames(path)) if texts else None)


def _labelled_frames(path: Path) -> Ints:
    texts = filter(is_present, (path / "det" / "det.txt", path / "gt" / "gt.txt"))
    return np.unique(joined((read_table(text, px_per_m=1.0).frame for text in texts), kind=np.int64))
