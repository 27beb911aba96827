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
    """Return what a seal states of each file, {"sha256": its hash, "bytes": its size}, by name, sorted.

    files: content by name.
    """
    return {name: {"sha256": hashing.file_hash(body), "bytes": len(body)} for name, body in sorted(files.items())}


def check_facts(path: Path, files: Any, remedy: str) -> None:
    """Raise InputError if `files`, the entry of the seal `path`, has not the form of what
    `file_facts` returns: "sha256" and "bytes" by name. Whether the files exist and match is not checked.

    Every name must lead to a file inside the seal's folder. remedy: for the error.
    """
    expected = "names inside the folder, each with sha256 and bytes"
    if not isinstance(files, dict):
        raise InputError(file=path, place="files", got=type(files).__name__, expected=expected, remedy=remedy)
    for name, facts in files.items():
        inside = name and not PurePosixPath(name).is_absolute() and ".." not in PurePosixPath(name).parts
        right = isinstance(facts, dict) and isinstance(facts.get("sha256"), str) and isinstance(facts.get("bytes"), int)
        if not inside or "\0" in name or not right:
            raise InputError(file=path, place="files", got=repr(name), expected=expected, remedy=remedy)


def with_hash(document: dict[str, Any]) -> dict[str, Any]:
    """Return a copy of the document with the field `sha256`, the canonical hash of all its other fields.

    An old `sha256` is replaced; `document` is not changed. Raises TypeError for one that cannot be hashed, as a set.
    """
    body = {key: value for key, value in document.items() if key != "sha256"}
    return {**body, "sha256": hashing.canonical_hash(body)}


def require_intact(path: Path, document: dict[str, Any], remedy: str, *, exact: bool = False) -> None:
    """Raise InputError if a seal was altered: its fields do not have the hash in its key sha256, or `check_facts`
    refuses its key files.

    path: of the seal's file; document: what was read from it, with both keys. exact: True also refuses a file whose
    bytes are not those that we write for the document, down to the last blank. remedy: for the error.
    """
    if document["sha256"] != with_hash(document)["sha256"] or (
        exact and path.read_bytes() != tables.json_document(document)
    ):
        raise InputError(file=path, got="altered fields", expected="those that its sha256 names", remedy=remedy)
    check_facts(path, document["files"], remedy)


def damaged_files(
    folder: Path, files: dict[str, Any], *, seal: str, remedy: str, size_only: Container[str] = ()
) -> Iterator[InputError]:
    """Yield (not raise) an InputError for each file that is missing, unreadable or whose hash differs from its seal.

    folder: holds the files, which are read while iterating. files: the facts of each file by name. seal: the name of
    the document that states them, and remedy: for the error. size_only: names of files whose content is not
    compared if they have the right size. Files that `files` does not name are ignored.
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
