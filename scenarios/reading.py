"""Reads files of users as bytes, and TOML and JSON texts as plain values; what is wrong is an InputError of one line.

Only a regular file of bounded size is opened: a FIFO or a device would block or never end; a folder, a socket and a
circle of symbolic links have no content. Values are refused that other code could not hold: deep nesting, whole numbers
beyond 64 bits, and in JSON the words NaN and Infinity.
"""

from __future__ import annotations

import json
import os
import stat
import tomllib
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from scenarios.errors import InputError
from scenarios.limits import DEPTH, INTEGER, NESTING

FAR = "whole numbers within 64 bits"


def parse_toml(text: str, file: object = "") -> dict[str, Any]:
    """Returns the table in a TOML text; raises InputError, which names `file`, if the text is not valid."""
    remedy = "correct the line; strings need quotes, tables inside a line need { }"
    table: dict[str, Any] = _parsed(tomllib.loads, text, file, "TOML", remedy)
    return table


def parse_json(text: str, file: object = "", remedy: str = "correct the file") -> Any:
    """Returns the value in a JSON text; raises InputError, which names `file` and `remedy`, if it is not valid."""
    return _parsed(partial(json.loads, parse_constant=_constant, object_pairs_hook=_object), text, file, "JSON", remedy)


def _parsed(load: Callable[[str], Any], text: str, file: object, form: str, remedy: str) -> Any:
    try:
        value = load(text)
    except RecursionError:
        raise _too_deep(file) from None
    except (ValueError, OverflowError) as error:  # OverflowError: of dates, which tomllib lets through
        place, got = "", str(error)
        if isinstance(error, json.JSONDecodeError):
            place, got = f"line {error.lineno}", f"no JSON ({error.msg})"
        elif isinstance(error, tomllib.TOMLDecodeError) and " (at " in got:
            got, _, place = got.removesuffix(")").rpartition(" (at ")
        raise InputError(file=file, place=place, got=got, expected=form, remedy=remedy) from None
    _require_plain(value, file)
    return value


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError(f"the key {Counter(key for key, _ in pairs).most_common(1)[0][0]!r} twice in an object")
    return found


def _constant(word: str) -> NoReturn:
    raise ValueError(f"{word}, which is no number of JSON")


def _too_deep(file: object) -> InputError:
    return InputError(file=file, got="deeper nesting", expected=NESTING, remedy="check that this is the right file")


def _require_plain(value: Any, file: object) -> None:
    # Without recursion: the nesting may be deeper than Python's stack.
    level = [value]
    for _ in range(DEPTH + 1):
        for item in level:
            if isinstance(item, int) and abs(item) > INTEGER:
                raise InputError(file=file, got=item, expected=FAR, remedy="correct the number")
        inside = (item.values() if isinstance(item, dict) else item for item in level if isinstance(item, dict | list))
        level = [inner for items in inside for inner in items]
        if not level:
            return
    raise _too_deep(file)


def require_regular(path: Path, remedy: str = "check the path", missing: bool = False) -> int:
    """Returns the size in bytes of the regular file `path`, which is not opened; links are followed.

    Raises InputError if it is no regular file. missing: True returns -1 if the file or the target of the link is
    missing.
    """
    try:
        found = os.stat(path)
    except (OSError, ValueError) as error:
        if missing and isinstance(error, FileNotFoundError):
            return -1
        got = getattr(error, "strerror", None) or "a path that cannot be"
        raise InputError(file=path, got=got, expected="a readable file", remedy=remedy) from None
    if not stat.S_ISREG(found.st_mode):
        got = "a folder" if stat.S_ISDIR(found.st_mode) else "a FIFO, a socket or a device"
        raise InputError(file=path, got=got, expected="a regular file", remedy=remedy)
    return found.st_size


def is_present(path: Path) -> bool:
    """Returns True if `path` is a regular file, False if nothing is there; raises InputError for anything else."""
    return require_regular(path, missing=True) >= 0


def read_regular(path: Path, limit: int, remedy: str = "check the path") -> bytes:
    """Returns the bytes of the regular file `path`; raises InputError if it has more than `limit` or cannot be read."""
    size = require_regular(path, remedy)
    if size > limit:
        got, expected = f"a file of {size:,} bytes", f"at most {limit:,} bytes"
        raise InputError(file=path, got=got, expected=expected, remedy="check that this is the right file")
    try:
        return path.read_bytes()
    except OSError as error:
        got = error.strerror or "no access"
        raise InputError(file=path, got=got, expected="a readable file", remedy=remedy) from None
