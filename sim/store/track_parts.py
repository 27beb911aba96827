"""Tracks on disk while they are made: a run killed at any moment loses what was tracked in its last second.

While a tracker runs, `TrackParts` writes its tracks to parts, each a small run of consecutive frames (`track_files`),
in the folder `parts` of the run's own. At the end, or when somebody reads what a killed run left, they are made one
run.
"""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.store.atomic import PARTIAL, lock_folder
from sim.store.seal import RUN, read_run, reject_foreign
from sim.store.track_files import read_run as read_part
from sim.store.track_files import write_tracks
from sim.types import Camera, Scene, Tracks

PARTS = "parts"
OURS = re.compile(r"\d{7,}(-joined)?|\.partial-.*")  # names in that folder
EVERY = 0.25  # s between two parts
JOINED = 60  # parts that are made one, so that there are few of them


class TrackParts:
    """Writes the tracks of a run in parts. folder: of the run, which must be locked. fps, camera, scene: as of
    `write_tracks`.

    State: waiting, tracks that no part has yet; small, the parts that are not joined yet, by first frame; written, when
    the last part was.
    """

    def __init__(self, folder: Path, fps: float, camera: Camera | None = None, scene: Scene | None = None) -> None:
        self.folder, self.fps, self.camera, self.scene = folder, fps, camera, scene
        self.waiting, self.small, self.written = list[Tracks](), list[int](), time.monotonic()
        reject_foreign(folder)
        foreign = next((path for path in _inside(folder) if not OURS.fullmatch(path.name)), None)
        if foreign is not None:
            expected, remedy = "no folder parts, or that of a run", "choose another --out"
            raise InputError(file=foreign, got="a file of another program", expected=expected, remedy=remedy)
        if has_parts(folder):
            remedy = "score or view it, which makes a run of it, or choose another --out"
            raise InputError(file=folder, got="what a killed run has kept", expected="no such run", remedy=remedy)
        # in this order, so that a kill in between does not leave parts that belong to another run
        _remove(_inside(folder))
        (folder / RUN).unlink(missing_ok=True)

    def add(self, tracks: Sequence[Tracks], info: dict[str, Any], *, now: bool = False) -> None:
        """Adds the tracks of the next frames. They are written if EVERY s have passed since others were, or `now`.
        info: what run.json says so far."""
        self.waiting += tracks
        if not self.waiting or not (now or time.monotonic() - self.written >= EVERY):
            return
        self._write(self.waiting, info, _path(self.folder, self.waiting[0].index))
        self.small.append(self.waiting[0].index)
        self.waiting, self.written = [], time.monotonic()
        if len(self.small) >= JOINED:
            small, self.small = [_path(self.folder, first) for first in self.small], []
            # overlapping parts do no harm, should the run be killed now
            joined = small[0].with_name(f"{small[0].name}-joined")
            self._write([t for part in small for t in read_part(part)], info, joined)
            _remove(small)

    def finish(self, info: dict[str, Any], last: Tracks | None = None) -> Path:
        """Makes one run of all parts, with run.json, and returns its folder. last: the last frame's tracks anew, if
        they have changed since they were added."""
        self.add([], info, now=True)
        every = read_parts(self.folder)[0]
        if last is not None and every and every[-1].index == last.index:
            every[-1] = last
        return self._write_whole(every, info)

    def _write_whole(self, every: Sequence[Tracks], info: dict[str, Any]) -> Path:
        self._write(every, {**info, "frames": len(every)}, self.folder)
        _remove(_inside(self.folder))
        return self.folder

    def _write(self, tracks: Sequence[Tracks], info: dict[str, Any], path: Path) -> None:
        every = of_one_plane(list(tracks))
        write_tracks(path, every, fps=self.fps, camera=self.camera, scene=self.scene, info=info)


def _inside(folder: Path) -> list[Path]:
    return sorted((folder / PARTS).iterdir()) if (folder / PARTS).is_dir() else []


def _remove(parts: Sequence[Path]) -> None:
    """Removes parts, the last one first, so that those that a kill leaves are whole and follow each other."""
    for part in reversed(parts):
        (part / RUN).unlink(missing_ok=True)
        shutil.rmtree(part)
    with suppress(OSError):
        for folder in {part.parent for part in parts}:
            folder.rmdir()  # if it is empty


def _path(folder: Path, first: int) -> Path:
    return folder / PARTS / f"{first:07d}"


def has_parts(folder: Path) -> bool:
    """Returns True if a run in the folder was not finished, and left parts."""
    inside = _inside(folder)
    return bool(inside) and all(OURS.fullmatch(path.name) for path in inside) and not (folder / RUN).exists()


def read_parts(folder: Path) -> tuple[list[Tracks], dict[str, Any]]:
    """Returns the tracks of all whole parts, one `Tracks` per frame from the first, and the last run.json. Frames
    before anybody was seen get the plane of those after."""
    tracks, info = list[Tracks](), dict[str, Any]()
    # a part that is joined comes after the first of those that it was made of, and holds more
    for path in sorted(_inside(folder), key=lambda path: (path.name[:7], -len(path.name))):
        if path.name.startswith(PARTIAL) or not (path / RUN).is_file():
            continue  # it was being written
        new = [t for t in read_part(path) if not tracks or t.index > tracks[-1].index]
        if not new:
            continue  # it was joined, and was being removed
        if tracks and new[0].index != tracks[-1].index + 1:
            break
        tracks += new
        info = read_run(path)
    return of_one_plane(tracks), info


def of_one_plane(tracks: list[Tracks]) -> list[Tracks]:
    """Returns the tracks with the plane of the first people in frames without people."""
    known = next((t for t in tracks if len(t.id)), None)
    if known is None:
        return tracks
    nobody = known.replace(groups=None, events=()).keep(np.zeros(len(known.id), bool))
    return [
        t if len(t.id) or t.plane == known.plane else nobody.replace(
            index=t.index, t=t.t, groups=t.groups, events=t.events, derived=t.derived
        ) for t in tracks
    ]  # fmt: skip


def join_parts(folder: Path) -> dict[str, Any]:
    """Makes one run of the parts that a killed run left in a folder, and returns its run.json. Raises InputError if the
    run goes on still, or no part is whole."""
    with lock_folder(folder, held=True):
        tracks, info = read_parts(folder)
        if not tracks:
            remedy = "track again: the run was killed before tracks were stored"
            raise InputError(file=folder, got="no whole part of a run", expected="tracks", remedy=remedy)
        info = {key: value for key, value in info.items() if key not in ("format", "files", "sha256", "boxes")}
        write_tracks(folder, tracks, fps=info["fps"], info={**info, "frames": len(tracks), "ended": "killed"})
        _remove(_inside(folder))
    return read_run(folder)
