"""Seals: a JSON document, written last into a folder, that names each file with its hash, and the hash of itself.

manifest.json seals a stored sequence, run.json the tracks of a run.
"""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from scenarios.errors import InputError
from sim import hashing
from sim.io.files import tables


def file_facts(files: Mapping[str, bytes]) -> dict[str, dict[str, Any]]:
    """Returns what a seal states of each file, {"sha256", "bytes"} by name, sorted. files: content by name."""
    return {name: {"sha256": hashing.file_hash(body), "bytes": len(body)} for name, body in sorted(files.items())}


def check_facts(path: Path, files: Any, remedy: str) -> None:
    """Raises InputError if `files` does not have the form of `file_facts`, or a name leads out of the folder."""
    expected = "names inside the folder, each with sha256 and bytes"
    if not isinstance(files, dict):
        raise InputError(file=path, place="files", got=type(files).__name__, expected=expected, remedy=remedy)
    for name, facts in files.items():
        inside = name and not PurePosixPath(name).is_absolute() and ".." not in PurePosixPath(name).parts
        right = isinstance(facts, dict) and isinstance(facts.get("sha256"), str) and isinstance(facts.get("bytes"), int)
        if not inside or "\0" in name or not right:
            raise InputError(file=path, place="files", got=repr(name), expected=expected, remedy=remedy)


def with_hash(document: dict[str, Any]) -> dict[str, Any]:
    """Returns a copy of the document with the key sha256, the hash of all others."""
    body = {key: value for key, value in document.items() if key != "sha256"}
    return {**body, "sha256": hashing.canonical_hash(body)}


def require_intact(path: Path, document: dict[str, Any], remedy: str, *, exact: bool = False) -> None:
    """Raises InputError if a seal was altered; `exact` also compares its bytes, down to the last blank."""
    if document["sha256"] != with_hash(document)["sha256"] or (
        exact and path.read_bytes() != tables.json_document(document)
    ):
        raise InputError(file=path, got="altered fields", expected="those that its sha256 names", remedy=remedy)
    check_facts(path, document["files"], remedy)


def damaged_files(
    folder: Path, files: dict[str, Any], *, seal: str, remedy: str, size_only: Container[str] = ()
) -> Iterator[InputError]:
    """Yields an error for each file that is missing, unreadable or not as stated.

    files: facts by name. seal: the name of the document that states them. size_only: names whose content is not
    compared.
    """
    for name, facts in files.items():
        path = folder / name
        wanted = f"the file of {facts['bytes']} bytes that {seal} names"
        try:
            size = path.stat().st_size if path.is_file() else None  # a FIFO would block its reader
            whole = size == facts["bytes"] and (name in size_only or _hash_of(path) == facts["sha256"])
        except OSError:
            size, whole = None, False
        if whole:
            continue
        kind = "truncated" if size is not None and size < facts["bytes"] else "altered"
        got = "missing" if size is None else f"{kind}: {size} bytes"
        yield InputError(file=path, got=got, expected=wanted, remedy=remedy)


def _hash_of(path: Path) -> str:
    return hashing.file_hash(path.read_bytes())
