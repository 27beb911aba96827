"""Which tracks belong to which sequence: by name, over whole datasets on either side."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.io.store.track_files import read_tracks
from sim.types import Sequence
from tracking.run import TrackingRun

OURS = ("tracks.parquet", "tracks.txt")
DEPTH = 3
EXPECTED = "a folder made by `flockscope track`, a folder of such, or MOTChallenge text"


@dataclass(frozen=True)
class Result:
    """Stored tracks: the sequence they say they are of ("" where they do not say), where, and what run.json holds."""

    name: str
    path: Path
    info: dict[str, Any]

    def read(self, sequence: Sequence) -> TrackingRun:
        """The tracks, at the sequence's frame rate; InputError where they were made at another one."""
        fps = self.info.get("fps")
        if fps is not None and abs(fps - sequence.fps) > 1e-9 * sequence.fps:
            raise InputError(
                file=self.path, place="run.json", got=f"tracks at {fps:g} fps", expected=f"{sequence.fps:g} fps",
                remedy=f"read the sequence with --fps {fps:g}, as `track` did",
            )  # fmt: skip
        return TrackingRun(tuple(read_tracks(self.path, fps=sequence.fps, length=sequence.length)), self.info)


def results(path: Path) -> list[Result]:
    """All stored tracks of a path, in the order of their paths; InputError where there are none."""
    if not path.exists():
        raise InputError(file=path, got="nothing there", expected=EXPECTED, remedy="check the path")
    found = [Result("", path, {})] if path.is_file() else list(_below(path, DEPTH))
    if not found:
        raise InputError(file=path, got="no tracks", expected=EXPECTED, remedy="check the path")
    return found


def _below(folder: Path, depth: int) -> list[Result]:
    if any((folder / name).is_file() for name in OURS):
        info = _run_info(folder / "run.json")
        return [Result(str(info.get("sequence", folder.name)), folder, info)]
    texts = [Result(p.stem, p, {}) for p in sorted(folder.glob("*.txt"))]
    if depth == 0:
        return texts
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir() and not p.name.startswith(".")]
    return [result for p in inner for result in _below(p, depth - 1)] + texts


def _run_info(path: Path) -> dict[str, Any]:
    """What run.json holds, {} where it is not there."""
    if not path.is_file():
        return {}
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        found = None
    if not isinstance(found, dict):
        raise InputError(
            file=path, got="no JSON object", expected="what `flockscope track` wrote", remedy="track again"
        )
    return found


def pair(sequences: list[Sequence], found: list[Result]) -> list[tuple[Sequence, Result]]:
    """Each sequence with its tracks. One sequence and one text without a name belong together; else names decide.

    Tracks of sequences that are not there are left out; InputError for a sequence without tracks, or with two.
    """
    if len(sequences) == len(found) == 1 and not found[0].name:
        return [(sequences[0], found[0])]
    by_name: dict[str, Result] = {}
    for result in found:
        name = result.name or result.path.stem
        if name in by_name:
            raise InputError(
                file=result.path, got=f"tracks of {name} a second time", expected="one result for each sequence",
                remedy=f"the first: {by_name[name].path}; give one run at a time",
            )  # fmt: skip
        by_name[name] = result
    for sequence in sequences:
        if sequence.name not in by_name:
            raise InputError(
                file=found[0].path.parent if len(found) > 1 else found[0].path,
                got="tracks of " + ", ".join(sorted(by_name)[:5]), expected=f"tracks of {sequence.name}",
                remedy="track it first, or give the right folder",
            )  # fmt: skip
    return [(sequence, by_name[sequence.name]) for sequence in sequences]
