"""Finds stored tracks below a path, matches them with sequences by name, and chooses the folders of new ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.io.files.own_files import is_hidden, output_paths
from sim.io.formats.options import BoxScale
from sim.io.store.seal import AGAIN, RUN, WHOLE, check_run, is_run, is_sequence, read_run, run_folder, tracked_hash
from sim.io.store.track_files import read_checked_tracks
from sim.types import Sequence
from tracking.running.run import TrackingRun

DEPTH = 3  # Tracks are looked for in this many levels of folders below the path.

EXPECTED = "a folder made by `flockscope track`, a folder of such folders, or MOTChallenge text"

# Keys of run.json that say with what a sequence was tracked. Runs that are scored together have them in common.
METHOD = ("tracker", "config", "grouping")

SHOWN = 3  # Most parameters that the error on two configs names.


# Endings of files that hold no tracks.
OTHER_FILES = (".toml", ".py", ".json", ".ini", ".html", ".svg", ".jpg", ".png", ".mp4", ".xml", ".ndjson")

DATASET = ("", "*", "*/*")  # Where a stored sequence lies below a sequence folder, a split of a dataset, or a dataset.


@dataclass(frozen=True)
class StoredTracks:
    """The stored tracks of one sequence, not read yet."""

    name: str | None  # from run.json, else of the folder or text; None for a file that the user gave itself
    path: Path  # the folder with the tracks, or the file
    info: dict[str, Any]  # content of run.json; {} for tracks of another program and for a run that was not finished

    def check(self) -> None:
        """Raises InputError if these are tracks of a run of ours that is unfinished, damaged or mixed with another."""
        folder = run_folder(self.path)
        if folder is not None:
            check_run(folder)

    def read(self, sequence: Sequence, box_scale: BoxScale | None = None) -> TrackingRun:
        """Reads the tracks at the sequence's frame rate; returns them, one `Tracks` per frame, with `info`."""
        fps, seal = self.info.get("fps"), (self.path if self.path.is_dir() else self.path.parent) / RUN
        if fps is not None and abs(fps - sequence.fps) > 1e-9 * sequence.fps:
            raise InputError(
                file=seal, place="fps", got=f"tracks at {fps:g} fps", expected=f"{sequence.fps:g} fps",
                remedy=f"track it again with --fps {sequence.fps:g}, or, if {fps:g} is the true rate, read the "
                f"sequence with --fps {fps:g}, as `track` did",
            )  # fmt: skip
        tracked = self.info.get("truth_hash")
        if tracked is not None and tracked_hash(sequence) not in (None, tracked):
            raise InputError(
                file=seal, place="truth_hash", got=f"tracks of another {sequence.name}",
                expected=f"those of {sequence.source.get('path', 'this sequence')}",
                remedy=f"{AGAIN}: its labels, scenario or settings are others",
            )  # fmt: skip
        tracks = read_checked_tracks(
            self.path, fps=sequence.fps, length=sequence.length, person_class=sequence.source.get("class"),
            box_scale=box_scale,
        )  # fmt: skip
        return TrackingRun(tuple(tracks), self.info)


def find_tracks(path: Path) -> list[StoredTracks]:
    """Returns all stored tracks at or below a path, not read yet, in the order of their paths."""
    if not path.exists():
        raise InputError(file=path, got="no such file or folder", expected=EXPECTED, remedy="check the path")
    _refuse_other_things(path)
    folder = run_folder(path)
    info = read_run(folder) if folder is not None and path.name in WHOLE else {}
    found = [StoredTracks(None, path, info)] if path.is_file() else list(_below(path, DEPTH))
    if not found:
        raise InputError(file=path, got="no tracks", expected=EXPECTED, remedy="check the path")
    return found


def _below(folder: Path, depth: int) -> list[StoredTracks]:
    if is_run(folder):
        info = read_run(folder) if (folder / RUN).is_file() else {}
        return [StoredTracks(info.get("sequence", folder.name), folder, info)]
    if (folder / "tracks.txt").is_file():
        return [StoredTracks(folder.name, folder, {})]
    texts = [StoredTracks(p.stem, p, {}) for p in sorted(folder.glob("*.txt")) if not is_hidden(p)]
    if depth == 0:
        return texts
    inner = [p for p in sorted(folder.iterdir()) if p.is_dir() and not is_hidden(p)]
    return [stored for p in inner for stored in _below(p, depth - 1)] + texts


def match_tracks(sequences: list[Sequence], stored: list[StoredTracks]) -> list[tuple[Sequence, StoredTracks]]:
    """Returns each sequence with the stored tracks of the same name, in the order of `sequences`."""
    if len(sequences) == len(stored) == 1 and stored[0].name is None:
        matched = [(sequences[0], stored[0])]
    else:
        by_name = _by_name(stored)
        matched = [(sequence, _named(sequence, by_name, stored)) for sequence in sequences]
    for _, each in matched:
        each.check()
    _refuse_mixture([each for _, each in matched])
    return matched


def _by_name(stored: list[StoredTracks]) -> dict[str, StoredTracks]:
    found: dict[str, StoredTracks] = {}
    for each in stored:
        name = each.path.stem if each.name is None else each.name
        if name in found:
            raise InputError(
                file=each.path, got=f"tracks of {name} a second time", expected="one result for each sequence",
                remedy=f"the first: {found[name].path}; give one run at a time",
            )  # fmt: skip
        found[name] = each
    return found


def _named(sequence: Sequence, by_name: dict[str, StoredTracks], stored: list[StoredTracks]) -> StoredTracks:
    if sequence.name in by_name:
        return by_name[sequence.name]
    for each in stored:
        if not each.info:
            each.check()
    folder, remedy = Path(sequence.source.get("path", "")), "track it first, or give the right folder"
    if folder.name in by_name and (folder / "seqinfo.ini").is_file():
        remedy = (
            f"name={sequence.name} in {folder / 'seqinfo.ini'} is another than its folder's, {folder.name}: correct it"
        )
    elif (
        len(stored) == 1
        and stored[0].info.get("truth_hash") is None
        and (text := stored[0].path / "tracks.txt").is_file()
    ):
        remedy += f"; if they are of the same frames, give {text}"
    raise InputError(
        file=stored[0].path.parent if len(stored) > 1 else stored[0].path,
        got="tracks of " + ", ".join(sorted(by_name)[:5]), expected=f"tracks of {sequence.name}", remedy=remedy,
    )  # fmt: skip


def _refuse_mixture(stored: Iterable[StoredTracks]) -> None:
    runs = [each for each in stored if each.info]
    for each in runs[1:]:
        first = runs[0]
        if _method(each) != _method(first):
            got = f"{_method_words(first, each)} in {first.path.name}, {_method_words(each, first)} in {each.path.name}"
            raise InputError(
                file=each.path.parent, got=got, expected="one tracker with one config",
                remedy="keep one folder per run: track again with another --out, and score them apart",
            )  # fmt: skip


def _method(stored: StoredTracks) -> list[Any]:
    return [stored.info.get(key) for key in METHOD]


def _method_words(stored: StoredTracks, other: StoredTracks) -> str:
    mine, theirs = ({**(s.info.get("config") or {}), **(s.info.get("grouping") or {})} for s in (stored, other))
    tracker = str(stored.info.get("tracker"))
    if tracker != str(other.info.get("tracker")):
        return tracker
    changed = [f"{key} = {value}" for key, value in mine.items() if theirs.get(key) != value][:SHOWN]
    return f"{tracker} ({', '.join(changed)})" if changed else tracker


def _refuse_other_things(path: Path) -> None:
    if path.is_file() and path.suffix.lower() in OTHER_FILES:
        raise InputError(
            file=path, got=f"a {path.suffix.lower()} file, no tracks", expected=EXPECTED, remedy="check the path"
        )
    folders = (folder for pattern in DATASET for folder in ([path] if not pattern else path.glob(pattern)))
    if path.is_dir() and any(is_sequence(folder) for folder in folders):
        raise InputError(
            file=path, got="a generated dataset, no tracks", expected=EXPECTED,
            remedy="give the --out of `flockscope track`",
        )  # fmt: skip


def run_folders(sequences: list[Sequence], source: Path, out: Path) -> list[Path]:
    """Returns the folder for each sequence's run: `out` itself if the source is one sequence, else one below it."""
    own = Path(sequences[0].source.get("path", source))
    if len(sequences) == 1 and (own == source or source.is_file() or own.is_file()):
        return [out]
    return output_paths(out, [sequence.name for sequence in sequences], source=source)
