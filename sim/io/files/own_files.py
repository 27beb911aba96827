"""Tells a file that an earlier run wrote from a file of the same name that somebody else wrote."""

from __future__ import annotations

from pathlib import Path

from scenarios.errors import InputError

MEBIBYTE = 1 << 20


def has_marks(path: Path, *marks: str) -> bool:
    """Return True if all of the texts `marks` stand in the first MiB of the file."""
    with path.open("rb") as file:
        head = file.read(MEBIBYTE)
    return all(mark.encode() in head for mark in marks)


def refuse_foreign_file(path: Path, *marks: str) -> None:
    """Raise InputError if a file exists at `path` and lacks one of the marks; do nothing otherwise.

    For files that the user has not named, such as an index in an output folder: these are replaced only if we wrote
    them. marks: texts that all of our files of this kind have in their first MiB.
    """
    if path.exists() and not has_marks(path, *marks):
        raise InputError(
            file=path, got="a file that flockscope did not write", expected="its own file, or none",
            remedy="move it away, or choose another --out",
        )  # fmt: skip
