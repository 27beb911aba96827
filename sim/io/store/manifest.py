"""The manifest of a stored sequence: what makes it complete, and what it must be like.

It names every file with its hash, the resolved scenario's hash, versions and the CPU's feature level, and no time, host
or path: the same seed, scenario and versions give the same bytes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io.files import tables
from sim.io.store.streams import check_streams, coding, is_picture

SCHEMA = 1
MANIFEST = "manifest.json"
REDO = "run the same `flockscope generate` again"


def is_sequence(folder: Path) -> bool:
    """Whether a folder is, or was meant to be, a stored sequence of ours."""
    return (folder / MANIFEST).is_file() or (folder / "scenario.toml").is_file()


def identity(scenario: str, seed: int, repeat: int, streams: Iterable[str] = (), images: str = "jpg") -> dict[str, Any]:
    """What says that a stored sequence is the one asked for."""
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


def with_hash(manifest: dict[str, Any]) -> dict[str, Any]:
    """The manifest with the hash of all its other fields as `sha256`, so that none can change unnoticed."""
    body = {key: value for key, value in manifest.items() if key != "sha256"}
    return {**body, "sha256": hashing.canonical_hash(body)}


def read_manifest(folder: Path) -> dict[str, Any]:
    """The manifest; InputError where it is missing, broken, altered or of another format."""
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(file=path, got="missing", expected="the manifest of a complete sequence", remedy=REDO)
    manifest = tables.read_json(path)
    if manifest.get("format") != tables.FORMAT:
        raise InputError(
            file=path, place="format", got=manifest.get("format"), expected=tables.FORMAT, remedy="use the same version"
        )
    missing = {"sequence", "files", "seed", "repeat", "scenario_hash", "truth_hash", "content_hash", "sha256"}
    missing -= manifest.keys()
    if missing:
        raise InputError(file=path, got=f"no {', '.join(sorted(missing))}", expected="all keys", remedy=REDO)
    if manifest["sha256"] != with_hash(manifest)["sha256"]:
        raise InputError(file=path, got="altered fields", expected="those that its sha256 names", remedy=REDO)
    return manifest


def damaged_files(folder: Path, manifest: dict[str, Any], *, pictures: bool = True) -> Iterator[InputError]:
    """Each file that is missing or not the one of the manifest; pictures may be taken at their size."""
    for name, facts in manifest["files"].items():
        path = folder / name
        wanted = f"the file of {facts['bytes']} bytes that manifest.json names"
        try:
            if not pictures and is_picture(name) and path.stat().st_size == facts["bytes"]:
                continue
            body = path.read_bytes()
        except OSError:
            yield InputError(file=path, got="missing", expected=wanted, remedy=REDO)
            continue
        if hashing.file_hash(body) != facts["sha256"]:
            kind = "truncated" if len(body) < facts["bytes"] else "altered"
            yield InputError(file=path, got=f"{kind}: {len(body)} bytes", expected=wanted, remedy=REDO)
