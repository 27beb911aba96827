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
# what every manifest.json of ours has, and no other program writes
MARKS: Rules = {"scenario_hash": TEXT, "content_hash": TEXT}

REDO = "run the same `flockscope generate` again"


def is_sequence(folder: Path) -> bool:
    """Returns True if the folder is a stored sequence, perhaps an incomplete one."""
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def is_own_sequence(folder: Path) -> bool:
    """Returns True if flockscope wrote the sequence: its manifest or, without a readable one, a table is ours."""
    return any(is_ours(path, MARKS) for path in (folder / MANIFEST, *folder.rglob("*.parquet")))


def identity(scenario: str, seed: int, repeat: int, streams: Iterable[str] = (), images: str = "jpg") -> dict[str, Any]:
    """Returns the fields of a manifest that identify a sequence.

    scenario: TOML text of the resolved scenario. repeat: number of the suite entry's copy, 0 without copies.
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
    """Reads the manifest.json of a sequence folder, and checks its seal, but no other file."""
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
    """Yields an error for each file of the manifest that is missing or altered.

    pictures: False compares only the size of pictures; their hash is checked when they are read.
    """
    size_only = () if pictures else tuple(filter(is_picture, manifest["files"]))
    return seal.damaged_files(folder, manifest["files"], seal=MANIFEST, remedy=REDO, size_only=size_only)
