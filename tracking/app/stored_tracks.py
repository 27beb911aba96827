"""Finds stored tracks below a path, matches them with sequences by name, and chooses the folders of new ones."""

from __future__ import annotations

import warnings
from collections import Counter
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, shortened
from sim.store import seal
from sim.store.own_files import is_hidden, output_paths
from sim.store.track_parts import has_parts, join_parts
from sim.types import Sequence
from tracking.recordings.mot_table import size_doubt
from tracking.recordings.mot_text import frame_rate
from tracking.recordings.options import BoxScale, refuse_options
from tracking.recordings.source import holds_sequences
from tracking.recordings.track_texts import read_checked_tracks
from tracking.running.run import TrackingRun

DEPTH = 3  # Tracks are looked for in this many levels of folders below the path.

EXPECTED = "a folder made by `flockscope track`, a folder of such folders, or MOTChallenge text"
STATED = "run.json states it"

# Endings of files that hold no tracks.
OTHER_FILES = (".toml", ".py", ".json", ".ini", ".html", ".svg", ".jpg", ".png", ".mp4", ".xml", ".ndjson")


@dataclass(frozen=True)
class StoredTracks:
    """The stored tracks of one sequence, not read yet."""

    name: str | None  # from run.json, else of the folder or text; None for a live run, and a file given itself
    path: Path  # the folder with the tracks, or the file
    info: dict[str, Any]  # content of run.json; {} for tracks of another program and for a run that was not finished

    @property
    def folder(self) -> Path:
        """The folder with the tracks."""
        return self.path if self.path.is_dir() else self.path.parent

    def check(self) -> None:
        """Raises InputError if flockscope stored these tracks and the run is unfinished, damaged or mixed with another.
        Tracks of other programs are not checked."""
        folder = seal.run_folder(self.path)
        if folder is not None:
            seal.check_run(folder)

    def sequence(self, fps: float | None) -> Sequence:
        """Returns a `Sequence` without frames that stands for the tracked one, from run.json. fps: the frame rate;
        None: that of run.json, else 25 with a warning. Raises InputError if both are given."""
        self.check()
        info, scale = self.info, self.info.get("px_per_m")
        if "fps" in info:
            refuse_options({"fps": fps}, "fps", self.folder, "a run", STATED)
        source = {
            "kind": "run", "path": str(self.folder), "truth_hash": info.get("truth_hash"),
            "px_per_m_frames": int(info.get("px_per_m_frames") or 0),
        }  # fmt: skip
        return Sequence(
            info.get("sequence", self.folder.name), frame_rate(fps, info.get("fps")), info.get("frames"),
            lambda: iter(()), px_per_m=float("nan") if scale is None else scale, source=source,
        )  # fmt: skip

    def read(self, sequence: Sequence, box_scale: BoxScale | None = None) -> TrackingRun:
        """Reads the tracks and returns them as a run of this sequence, one `Tracks` per frame, with `info`. Raises
        InputError if they are of another sequence or frame rate. box_scale: factors of boxes in texts of others."""
        fps, stated = self.info.get("fps"), self.folder / seal.RUN
        if fps is not None and abs(fps - sequence.fps) > 1e-9 * sequence.fps:
            remedy = f"read the sequence with --fps {fps:g}, as `track` did, or track it again"
            expected = f"{sequence.fps:g} fps"
            raise InputError(file=stated, place="fps", got=f"tracks at {fps:g} fps", expected=expected, remedy=remedy)
        tracked = self.info.get("truth_hash")
        if tracked is not None and seal.tracked_hash(sequence) not in (None, tracked):
            got, expected = f"tracks of another {sequence.name}", f"those of {sequence.source.get('path', 'this one')}"
            remedy = f"{seal.AGAIN}: its labels, scenario or settings are others"
            raise InputError(file=stated, place="truth_hash", got=got, expected=expected, remedy=remedy)
        tracks = read_checked_tracks(
            self.path, fps=sequence.fps, length=sequence.length, person_class=sequence.source.get("class"),
            box_scale=box_scale, px_per_m=sequence.px_per_m if sequence.px_per_m > 0 else None,
            begin=sequence.source.get("begin", 0.0),
        )  # fmt: skip
        frames = self.info.get("frames")
        if self.info.get("ended") and sequence.length is not None and frames is not None and frames < sequence.length:
            words = f"its run has {frames} of {sequence.length} frames; nobody counts as found in the others"
            warnings.warn(f"{self.folder}: {words}", stacklevel=2)
        boxes = [t.box for t in tracks if t.box is not None and not self.info]
        size = sequence.image_size
        if boxes and size is not None and (doubt := size_doubt(np.concatenate(boxes), size)):
            warnings.warn(f"{self.path}: {doubt}", stacklevel=2)
        return TrackingRun(tuple(tracks), self.info)


def holds_tracks(path: Path) -> bool:
    """Returns True if a path is a run that flockscope stored (its folder or a file), or a folder without sequences."""
    own = seal.run_folder(path) is not None and (path.is_dir() or path.name in seal.WHOLE)
    return own or (path.is_dir() and not holds_sequences(path))


def find_tracks(path: Path) -> list[StoredTracks]:
    """Returns all stored tracks at or below a path, not read yet, in the order of their paths."""
    got, remedy, found = "no such file or folder", "check the path", list[StoredTracks]()
    if path.is_file() and path.suffix.lower() in OTHER_FILES:
        got = f"a {path.suffix.lower()} file, no tracks"
    elif path.is_file():
        folder = seal.run_folder(path)
        info = seal.read_run(folder) if folder is not None and path.name in seal.WHOLE else {}
        found = [StoredTracks(None, path, info)]
    elif seal.is_dataset(path):
        got, remedy = "a generated dataset, no tracks", "give the --out of `flockscope track`"
    elif path.is_dir():
        got, found = "no tracks", list(_below(path, DEPTH))
    if not found:
        raise InputError(file=path, got=got, expected=EXPECTED, remedy=remedy)
    return found


def _below(folder: Path, depth: int) -> list[StoredTracks]:
    if has_parts(folder):
        joined = join_parts(folder)
        words = f"its run was killed; what it had stored, {counted(joined['frames'], 'frame')}, is put together"
        warnings.warn(f"{folder}: {words}", stacklevel=2)
    if seal.is_run(folder):
        info = seal.read_run(folder) if (folder / seal.RUN).is_file() else {}
        # what came in live has no name that a sequence could have
        return [StoredTracks(None if info.get("live") else info.get("sequence", folder.name), folder, info)]
    if (folder / "tracks.txt").is_file():
        return [StoredTracks(folder.name, folder, {})]
    texts = [StoredTracks(p.stem, p, {}) for p in sorted(folder.glob("*.txt")) if not is_hidden(p)]
    if depth == 0:
        return texts
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir() and not is_hidden(p)]
    return [stored for p in inner for stored in _below(p, depth - 1)] + texts


def match_tracks(sequences: list[Sequence], stored: list[StoredTracks]) -> list[tuple[Sequence, StoredTracks]]:
    """Returns each sequence with the stored tracks of the same name, in the order of `sequences`."""
    names = [each.path.stem if each.name is None else each.name for each in stored]
    ((name, count),) = Counter(names).most_common(1)
    if len(sequences) == len(stored) == 1 and stored[0].name is None:
        names = [sequences[0].name]
    elif count > 1:
        first, second, *_ = (each.path for each, own in zip(stored, names, strict=True) if own == name)
        got, remedy = f"tracks of {name} a second time", f"the first: {first}; give one run at a time"
        raise InputError(file=second, got=got, expected="one result for each sequence", remedy=remedy)
    by_name = dict(zip(names, stored, strict=True))
    for sequence in sequences:
        if sequence.name not in by_name:
            _refuse_unmatched(sequence, by_name)
    matched = [(sequence, by_name[sequence.name]) for sequence in sequences]
    for _, each in matched:
        each.check()
    _refuse_mixture([each for _, each in matched if each.info])
    return matched


def _refuse_unmatched(sequence: Sequence, by_name: dict[str, StoredTracks]) -> None:
    stored = [*by_name.values()]
    for each in stored:
        if not each.info:
            each.check()
    file, got = stored[0].path.parent if len(stored) > 1 else stored[0].path, ", ".join(sorted(by_name)[:5])
    remedy = "track it first, or give the right folder; a text that is named itself counts for any sequence"
    raise InputError(file=file, got=f"tracks of {got}", expected=f"tracks of {sequence.name}", remedy=remedy)


def _refuse_mixture(runs: list[StoredTracks]) -> None:
    """Raises InputError if stored tracks that are scored together are of different trackers or parameters."""
    for first, each in pairwise(runs):
        if (before := _method(first.info)) != (now := _method(each.info)):
            other = {key: value for key, value in now.items() if before.get(key) != value}
            got = f"{shortened(str(other or now), 80)} in {each.path.name}, other than in {first.path.name}"
            remedy = "keep one folder per run: track again with another --out, and score them apart"
            raise InputError(file=each.path.parent, got=got, expected="one tracker with one config", remedy=remedy)


def _method(info: dict[str, Any]) -> dict[str, Any]:
    return {"tracker": info.get("tracker"), **(info.get("config") or {}), **(info.get("grouping") or {})}


def check_place(folder: Path, tracker: str) -> None:
    """Raises InputError if a run of this tracker cannot be written into the folder, or would replace one of another
    tracker. Trackers of files are told apart by file name and class. An unfinished or damaged run may be replaced."""
    seal.reject_foreign(folder)
    try:
        before = str(seal.read_run(folder).get("tracker") or tracker)
    except InputError:
        return
    if Path(before).name != Path(tracker).name:
        expected, remedy = f"none, or one of {tracker}", "choose another --out, or delete it"
        raise InputError(file=folder, got=f"a run of {before}", expected=expected, remedy=remedy)


def run_folders(sequences: list[Sequence], source: Path, out: Path) -> list[Path]:
    """Returns the folder for each sequence's run: `out` itself if the source is one sequence, else one below it.
    Raises InputError if `out` is a dataset."""
    seal.reject_dataset(out)
    own = Path(sequences[0].source.get("path", source))
    if len(sequences) == 1 and (own == source or source.is_file() or own.is_file()):
        return [out]
    return output_paths(out, [sequence.name for sequence in sequences], source=source)
