"""Finds the stored tracks below a path and matches them with sequences by name."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.io.store.track_files import read_tracks
from sim.types import Sequence
from tracking.run import TrackingRun

TRACK_FILES = ("tracks.parquet", "tracks.txt")
"""A folder with one of these files holds the tracks of one sequence."""

DEPTH = 3
"""Tracks are looked for in this many levels of folders below the path."""

EXPECTED = "a folder made by `flockscope track`, a folder of such folders, or MOTChallenge text"


@dataclass(frozen=True)
class StoredTracks:
    """The stored tracks of one sequence, not read yet.

    name: the sequence's name: from run.json, or else the name of the folder or, without suffix, of the text; "" for a
    text file that the user gave itself. path: the folder with the tracks, or the text file. info: the content of
    run.json as a dictionary, empty if there is none.
    """

    name: str
    path: Path
    info: dict[str, Any]

    def read(self, sequence: Sequence) -> TrackingRun:
        """Reads the tracks at the sequence's frame rate; returns them, one `Tracks` per frame, with `info`.

        Raises InputError if run.json states another frame rate, there are no tracks, or a file is damaged. Also if a
        MOTChallenge text has a frame beyond the sequence's length, or an event's frame is outside the tracks. Warns
        about a text without rows.
        """
        fps = self.info.get("fps")
        if fps is not None and abs(fps - sequence.fps) > 1e-9 * sequence.fps:
            raise InputError(
                file=self.path, place="run.json", got=f"tracks at {fps:g} fps", expected=f"{sequence.fps:g} fps",
                remedy=f"read the sequence with --fps {fps:g}, as `track` did",
            )  # fmt: skip
        return TrackingRun(tuple(read_tracks(self.path, fps=sequence.fps, length=sequence.length)), self.info)


def find_tracks(path: Path) -> list[StoredTracks]:
    """Returns all stored tracks at or below a path, not read yet, in the order of their paths; text files of a folder
    come last.

    path: a text file in MOTChallenge format, a folder with tracks.parquet or tracks.txt, or a folder that holds such
    folders or *.txt files, at most three levels down. Hidden folders are left out. Raises InputError if the path does
    not exist or holds no tracks, or if a run.json is no JSON object.
    """
    if not path.exists():
        raise InputError(file=path, got="no such file or folder", expected=EXPECTED, remedy="check the path")
    found = [StoredTracks("", path, {})] if path.is_file() else list(_below(path, DEPTH))
    if not found:
        raise InputError(file=path, got="no tracks", expected=EXPECTED, remedy="check the path")
    return found


def _below(folder: Path, depth: int) -> list[StoredTracks]:
    """Returns the stored tracks in a folder and in `depth` levels of folders below it; none found: an empty list.

    A folder with tracks.parquet or tracks.txt counts as one and is not searched further. Hidden folders are left out.
    Raises InputError if a run.json is no JSON object.
    """
    if any((folder / name).is_file() for name in TRACK_FILES):
        info = _run_info(folder / "run.json")
        return [StoredTracks(str(info.get("sequence", folder.name)), folder, info)]
    texts = [StoredTracks(p.stem, p, {}) for p in sorted(folder.glob("*.txt"))]
    if depth == 0:
        return texts
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir() and not p.name.startswith(".")]
    return [stored for p in inner for stored in _below(p, depth - 1)] + texts


def _run_info(path: Path) -> dict[str, Any]:
    """Returns the content of the run.json at `path`, an empty dictionary if there is no such file.

    Raises InputError if the file is no JSON object, OSError if it cannot be read.
    """
    if not path.is_file():
        return {}
    try:
        info = json.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        info = None
    if not isinstance(info, dict):
        raise InputError(
            file=path, got="no JSON object", expected="the run.json of `flockscope track`", remedy="track again"
        )
    return info


def match_tracks(sequences: list[Sequence], stored: list[StoredTracks]) -> list[tuple[Sequence, StoredTracks]]:
    """Returns each sequence with the stored tracks of the same name, in the order of `sequences`; [] without sequences.

    A single text file that was given itself matches a single sequence whatever their names; otherwise its name is that
    of the file without suffix. Tracks of other sequences are ignored. Raises InputError if a sequence has no tracks, or
    if two of `stored` have the same name. `stored` must not be empty if there is a sequence.
    """
    if len(sequences) == len(stored) == 1 and not stored[0].name:
        return [(sequences[0], stored[0])]
    by_name: dict[str, StoredTracks] = {}
    for each in stored:
        name = each.name or each.path.stem
        if name in by_name:
            raise InputError(
                file=each.path, got=f"tracks of {name} a second time", expected="one result for each sequence",
                remedy=f"the first: {by_name[name].path}; give one run at a time",
            )  # fmt: skip
        by_name[name] = each
    for sequence in sequences:
        if sequence.name not in by_name:
            raise InputError(
                file=stored[0].path.parent if len(stored) > 1 else stored[0].path,
                got="tracks of " + ", ".join(sorted(by_name)[:5]), expected=f"tracks of {sequence.name}",
                remedy="track it first, or give the right folder",
            )  # fmt: skip
    return [(sequence, by_name[sequence.name]) for sequence in sequences]
