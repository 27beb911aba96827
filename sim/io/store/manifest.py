"""manifest.json, written last: a stored sequence is complete if and only if it has one.

It holds the hash of every file, the identity of the sequence, versions and the CPU's instruction level. It holds no
time, host or path, so the same seed, scenario and versions give the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io.files import tables
from sim.io.files.own_files import is_ours
from sim.io.files.value_check import TEXT, Rules
from sim.io.store import seal
from sim.io.store.seal import with_hash as with_hash
from sim.io.store.streams import check_streams, coding, is_picture

SCHEMA = 1
MANIFEST = "manifest.json"
MARKS: Rules = {"scenario_hash": TEXT, "content_hash": TEXT}
"""What every manifest.json of ours has, and no other program writes."""

REDO = "run the same `flockscope generate` again"


def is_sequence(folder: Path) -> bool:
    """Return True if the folder has a manifest.json or scenario.toml: it is a stored sequence, perhaps an incomplete
    one.
    """
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def is_own_sequence(folder: Path) -> bool:
    """Return True if flockscope wrote the sequence in the folder: its manifest is ours or, if that is missing or
    damaged, one of its tables.
    """
    return any(is_ours(path, MARKS) for path in (folder / MANIFEST, *folder.rglob("*.parquet")))


def identity(scenario: str, seed: int, repeat: int, streams: Iterable[str] = (), images: str = "jpg") -> dict[str, Any]:
    """Return the fields of a manifest that identify a sequence, by name.

    Keys: format, schema, engine (numbers of versions), seed, repeat, scenario_hash, streams (in the order left, right,
    disparity, ids, background; "background" is added to "left" or "right"), images (None if no stream depends on it).
    scenario: TOML text of the resolved scenario. repeat: number of the suite entry's copy, 0 without copies. streams:
    stored pictures. images: their file type, "jpg", "png" or "mp4". Raises InputError for an unknown stream or file
    type.
    """
    wanted = check_streams(streams, images)
    return {
        "format": tables.FORMAT,
        "schema": SCHEMA,
        "engine": hashing.ENGINE,
        "seed": seed,
        "repeat": repeat,
        "scenario_hash": hashing.scenario_hash(scenario),
        "streams": list(wanted),
        "images": coding(wanted, images),
    }


def read_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest.json of a sequence folder, as a dict.

    Raises InputError if it is missing, unreadable or no JSON object, has another format number, lacks a key,
    names a file outside the folder, or was altered, that is, its fields do not have the hash in its key sha256. The
    files that it names are not read.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(file=path, got="missing", expected="the manifest of a complete sequence", remedy=REDO)
    manifest = tables.read_document(path, REDO)
    missing = {"format", "sequence", "files", "seed", "repeat", "scenario_hash", "truth_hash", "content_hash", "sha256"}
    missing -= manifest.keys()
    if missing:
        raise InputError(file=path, got=f"no {', '.join(sorted(missing))}", expected="all keys", remedy=REDO)
    seal.require_intact(path, manifest, REDO)
    return manifest


def damaged_files(folder: Path, manifest: dict[str, Any], *, pictures: bool = True) -> Iterator[InputError]:
    """Yield (not raise) an InputError for each file of the manifest that is missing, unreadable or whose hash differs.

    folder: the sequence folder. Files are read while iterating, in the order of the manifest. pictures: True compares
    the hash of every file. False compares only the size of pictures; a picture of another size is reported. Files that
    the manifest does not name are ignored.
    """
    size_only = () if pictures else tuple(filter(is_picture, manifest["files"]))
    return seal.damaged_files(folder, manifest["files"], seal=MANIFEST, remedy=REDO, size_only=size_only)
