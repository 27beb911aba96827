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
    """Returns the size in bytes of the regular file `path`, which is not opened; links are followed."""
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
    """Raises InputError as `require_regular` does, but not for a missing file or a link to one."""
    if os.path.lexists(path) and (os.path.exists(path) or not _dangles(path)):
        require_regular(path)


def is_present(path: Path) -> bool:
    """Returns True if the regular file exists; raises InputError for something else, as a FIFO."""
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
    """Returns the bytes of the regular file `path`, at most `limit`."""
    size = require_regular(path, remedy)
    if size > limit:
        got, expected = f"a file of {size:,} bytes", f"at most {limit:,} bytes"
        raise InputError(file=path, got=got, expected=expected, remedy="check that this is the right file")
    try:
        return path.read_bytes()
    except OSError as error:
        got = error.strerror or "no access"
        raise InputError(file=path, got=got, expected="a readable file", remedy=remedy) from None
