"""run.json, written last: the tracks of a run are complete if and only if their folder has one.

It says which tracker ran and on what, and seals the run's files as manifest.json seals those of a sequence.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import FRAME_RATES, INTEGER
from sim.hashing import labels_hash
from sim.io.files import tables
from sim.io.files.own_files import is_ours
from sim.io.files.tables import FLAG, TABLE, TEXT, Rules, check_values, number, one_of, or_none, whole
from sim.io.store import seal
from sim.io.store.manifest import MANIFEST
from sim.io.store.manifest import MARKS as MANIFEST_MARKS
from sim.types import Sequence

RUN = "run.json"
EXACT = "tracks.parquet"
PAIRS = "pairs.parquet"
# names of the files of a run; files of other names in its folder belong to somebody else
NAMES = ("tracks.txt", "tracks.mot.txt", EXACT, "groups.csv", "groups.parquet", PAIRS, "events.json", RUN)

# files that stand for the whole run if they are given alone; tracks.mot.txt is a text as other programs read it
WHOLE = ("tracks.txt", EXACT)

AGAIN = "track again"
OLD = "delete run.json, then track again; tracks of another program are read without it"

# what every run.json of ours has, also of an older version, and no other program writes
MARKS: Rules = {"boxes": one_of("measured", "projected", "none")}

# what the values of run.json must be that commands read; keys that it lacks are not checked
VALUES: Rules = {
    **MARKS,
    "tracker": TEXT,
    "sequence": TEXT,
    "config": or_none(TABLE),
    "grouping": or_none(TABLE),
    "sensor": or_none(TABLE),
    "seed": or_none(whole(-INTEGER, INTEGER)),
    "detections": or_none(TEXT),
    "background": or_none(TEXT),
    "plane": or_none(TEXT),
    "causal": or_none(FLAG),
    "truth_hash": or_none(TEXT),
    "fps": or_none(number(*FRAME_RATES)),
    "px_per_m": or_none(number(-math.inf, math.inf)),
}


def is_run(folder: Path) -> bool:
    """Returns True if the folder holds a run of ours, perhaps an unfinished or damaged one."""
    paths = [folder / name for name in (RUN, EXACT) if (folder / name).is_file()]
    # A file that cannot be parsed may be ours.
    return any(is_ours(path, MARKS) is not False for path in paths)


def run_folder(path: Path) -> Path | None:
    """Returns the folder of the run that a path (folder or file of ours) leads to; None if it is no run's."""
    folder = path if path.is_dir() else path.parent if path.name in NAMES else None
    return folder if folder is not None and is_run(folder) else None


def reject_foreign(folder: Path) -> None:
    """Raises InputError if a file that is not ours, or a stored sequence, would be changed by a run here."""
    for place in (folder.absolute(), *folder.absolute().parents):
        if is_ours(place / MANIFEST, MANIFEST_MARKS):
            raise InputError(
                file=folder, got=f"a place inside the stored sequence {place.name}", expected="a folder of its own",
                remedy="choose another --out",
            )  # fmt: skip
    found = [name for name in (RUN, EXACT, *NAMES) if (folder / name).exists()]
    if found and not is_ours(folder / found[0], MARKS):
        got = "a file of another program, or a damaged one"
        raise InputError(
            file=folder / found[0], got=got, expected="a new folder, or one with a run",
            remedy="choose another --out, or move the file; delete a damaged run",
        )  # fmt: skip


def sealed_run(info: Mapping[str, Any], files: Mapping[str, bytes]) -> bytes:
    """Returns the run.json of a run: `info` with the facts of all its other files (content by name) and its hash."""
    stated = {"format": tables.FORMAT, **info, "files": seal.file_facts(files)}
    read = json.loads(tables.json_text(stated))  # hashed as it will be read
    check_values(Path(RUN), read, VALUES, "correct info")
    return tables.json_document(seal.with_hash(read))


def read_run(folder: Path) -> dict[str, Any]:
    """Returns the run.json of a folder, whose seal must be intact to the last blank; no other file is read."""
    path = folder / RUN
    if not path.is_file():
        got, expected = f"tracks without {RUN}", "a run that was finished"
        raise InputError(file=folder, got=got, expected=expected, remedy=f"incomplete: {AGAIN}")
    run = tables.read_document(path, OLD)
    if not isinstance(run.get("files"), dict) or "sha256" not in run:
        got, expected = "a run.json without hashes, of an older version", "one that names each file with its hash"
        raise InputError(file=path, got=got, expected=expected, remedy=OLD)
    seal.require_intact(path, run, AGAIN, exact=True)
    check_values(path, run, VALUES, AGAIN)
    return run


def run_problems(folder: Path, run: dict[str, Any]) -> Iterator[InputError]:
    """Yields an error for each file of a run that is missing, altered, or of another run."""
    yield from seal.damaged_files(folder, run["files"], seal=RUN, remedy=AGAIN)
    for name in NAMES:
        if name not in run["files"] and name != RUN and (folder / name).exists():
            got, expected = f"a file that {RUN} does not name", "the files of one run"
            yield InputError(file=folder / name, got=got, expected=expected, remedy=AGAIN)


def check_run(folder: Path) -> dict[str, Any]:
    """Returns the run.json of a folder whose run is whole; raises the first problem otherwise."""
    run = read_run(folder)
    for problem in run_problems(folder, run):
        raise problem
    return run


def tracked_hash(sequence: Sequence) -> str | None:
    """Returns the SHA-256 of the truth that was tracked; None for a sequence without labels."""
    stated = sequence.source.get("truth_hash")
    if stated is not None:
        return str(stated)
    return None if sequence.truth is None else labels_hash(sequence.truth)
