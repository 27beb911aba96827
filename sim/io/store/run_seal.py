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
from sim.io.files.value_check import FLAG, TABLE, TEXT, Rules, check_values, number, one_of, or_none, whole
from sim.io.store import seal
from sim.io.store.manifest import MANIFEST
from sim.io.store.manifest import MARKS as MANIFEST_MARKS
from sim.types import Sequence

RUN = "run.json"
EXACT = "tracks.parquet"
PAIRS = "pairs.parquet"
NAMES = ("tracks.txt", "tracks.mot.txt", EXACT, "groups.csv", "groups.parquet", PAIRS, "events.json", RUN)
"""Names of the files of a run; files of other names in its folder belong to somebody else."""

WHOLE = ("tracks.txt", EXACT)
"""Files that stand for the whole run if they are given alone; tracks.mot.txt is a text as other programs read it."""

AGAIN = "track again"
OLD = "delete run.json, then track again; tracks of another program are read without it"

MARKS: Rules = {"boxes": one_of("measured", "projected", "none")}
"""What every run.json of ours has, also of an older version, and no other program writes."""

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
"""What the values of run.json must be that commands read; keys that it lacks are not checked."""


def is_run(folder: Path) -> bool:
    """Return True if the folder holds a run of ours, perhaps an unfinished or damaged one; text alone is no such run.

    It does if its run.json or its tracks.parquet is ours, or cannot be parsed and so may be ours.
    """
    paths = [folder / name for name in (RUN, EXACT) if (folder / name).is_file()]
    return any(is_ours(path, MARKS) is not False for path in paths)


def run_folder(path: Path) -> Path | None:
    """Return the folder of the run that a path leads to: itself, or that of a file of ours; None if it is no run's."""
    folder = path if path.is_dir() else path.parent if path.name in NAMES else None
    return folder if folder is not None and is_run(folder) else None


def reject_foreign(folder: Path) -> None:
    """Raise InputError if the folder holds a file with a name of ours, but no run of ours: it would be replaced.

    Its run.json tells whether the run is ours, without one its tracks.parquet. Also raises InputError for the folder of
    a stored sequence, or one inside it, which would no longer be what its manifest says.
    """
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
    """Return the run.json of a run as bytes: `info` with the facts of all its other files and its own hash.

    info: what ran; the keys format, files and sha256 are added. files: content by name, without run.json. Raises
    InputError if a value of `info` is of another kind than `read_run` accepts, ValueError if it holds NaN or infinity,
    TypeError if it holds what JSON cannot.
    """
    stated = {"format": tables.FORMAT, **info, "files": seal.file_facts(files)}
    read = json.loads(tables.json_text(stated))  # hashed as it will be read
    check_values(Path(RUN), read, VALUES, "correct info")
    return tables.json_document(seal.with_hash(read))


def read_run(folder: Path) -> dict[str, Any]:
    """Return the content of the run.json of a folder; the files that it names are not read.

    Raises InputError if it is missing, unreadable, no JSON object, of another format number, without a seal (as older
    versions wrote it), or altered: its bytes must be those that we write for its content, down to the last blank. Also,
    with the key, for a value of the wrong kind.
    """
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
    """Yield (not raise) an InputError for each file of a run that is missing, altered, or of another run.

    run: the content of its run.json. All its files are read while iterating. A file of another run has one of our
    names, but run.json does not name it.
    """
    yield from seal.damaged_files(folder, run["files"], seal=RUN, remedy=AGAIN)
    for name in NAMES:
        if name not in run["files"] and name != RUN and (folder / name).exists():
            got, expected = f"a file that {RUN} does not name", "the files of one run"
            yield InputError(file=folder / name, got=got, expected=expected, remedy=AGAIN)


def check_run(folder: Path) -> dict[str, Any]:
    """Return the content of the run.json of a folder whose run is whole. Raises the first InputError of `read_run` and
    `run_problems` otherwise."""
    run = read_run(folder)
    for problem in run_problems(folder, run):
        raise problem
    return run


def tracked_hash(sequence: Sequence) -> str | None:
    """Return the SHA-256 (64 hex digits) that tells what was tracked; None for a sequence without labels.

    Of a generated sequence it is the truth_hash of its manifest, else a hash of the labels and the frame rate as read.
    Raises InputError if the labels cannot be read, WorkError if an order of a simulated script was not fulfilled.
    """
    stated = sequence.source.get("truth_hash")
    if stated is not None:
        return str(stated)
    return None if sequence.truth is None else labels_hash(sequence.truth)
