"""Reads files of users: a regular file of bounded size, as bytes; anything else raises InputError before it is opened.

A FIFO or a device would block or never end. A folder, a socket and a circle of symbolic links have no content.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from scenarios.errors import InputError

KINDS = {
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFDIR: "a folder",
}


def require_regular(path: Path, remedy: str = "check the path") -> int:
    """Return the size in bytes of the regular file `path`; symbolic links are followed.

    The file is not opened. Raises InputError, with `remedy`, if there is no such file, it is no regular file, or the
    path cannot be looked up, as one with a NUL character or a circle of links.
    """
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:
        got = getattr(error, "strerror", None) or "a path that cannot be"
        raise InputError(file=path, got=got, expected="a readable file", remedy=remedy) from None
    if not stat.S_ISREG(found.st_mode):
        got = KINDS.get(stat.S_IFMT(found.st_mode), "no regular file")
        raise InputError(file=path, got=got, expected="a regular file", remedy=remedy)
    return found.st_size


def refuse_irregular(path: Path) -> None:
    """Raise InputError as `require_regular` does, but not for a missing file or a link to a missing one."""
    if os.path.lexists(path) and (os.path.exists(path) or not _dangles(path)):
        require_regular(path)


def is_present(path: Path) -> bool:
    """Return True if the regular file `path` exists, False if there is nothing or a link to a missing file.

    Raises InputError if there is something else, as a FIFO: a reader must not take it for a missing file.
    """
    refuse_irregular(path)
    return os.path.isfile(path)


def _dangles(path: Path) -> bool:
    try:
        os.stat(path)
    except FileNotFoundError:
        return True
    except OSError:
        return False
    return False


def read_regular(path: Path, limit: int, remedy: str = "check the path") -> bytes:
    """Return the bytes of the regular file `path`.

    limit: the greatest size in bytes. Raises InputError, with `remedy`, if the file is missing, unreadable, no regular
    file or larger.
    """
    size = require_regular(path, remedy)
    if size > limit:
        got, expected = f"a file of {size:,} bytes", f"at most {limit:,} bytes"
        raise InputError(file=path, got=got, expected=expected, remedy="check that this is the right file")
    try:
        return path.read_bytes()
    except OSError as error:
        got = error.strerror or "no access"
        raise InputError(file=path, got=got, expected="a readable file", remedy=remedy) from None
