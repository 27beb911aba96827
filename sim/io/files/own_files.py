"""Tells a file that an earlier run wrote from a file of the same name that somebody else wrote."""

from __future__ import annotations

from pathlib import Path

from scenarios.errors import InputError

MEBIBYTE = 1 << 20


def refuse_foreign_file(path: Path, *marks: str) -> None:
    """Raise InputError if a file exists at `path` and lacks one of the marks; do nothing otherwise.

    For files that the user has not named, such as an index in an output folder: these are replaced only if we wrote
    them. marks: texts that all of our files of this kind have in their first MiB.
    """
    if not path.exists():
        return
    with path.open("rb") as file:
        head = file.read(MEBIBYTE)
    if not all(mark.encode() in head for mark in marks):
        raise InputError(
            file=path, got="a file that flockscope did not write", expected="its own file, or none",
            remedy="move it away, or choose another --out",
        )  # fmt: skip
