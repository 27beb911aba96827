"""Applies `--set key=value` to a scenario's table: `camera.fps=25`, `group.a.size=3`, `group.0.size`,
`world.size.0=20`.

A step into an array is an index from 0 or an `id`. Values are TOML (`3`, `[8, 5]`, `{ uniform = [0, 5] }`, `"top"`); a
word without quotes is a string. The value replaces that of the key, also where it is a table; a table that replaces a
row of an array keeps the row's id. A table set on a new id (`group.x={ size = 2, … }`) is appended to the array.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import DEPTH, NESTING
from scenarios.loading.toml_files import Table, did_you_mean
from scenarios.parsing import parse_toml
from scenarios.printable import shortened

KeyPath = tuple[str | int, ...]
SHOWN = 120
"""Characters of a setting that messages show."""


def apply_settings(table: Table, settings: Iterable[str], file: object = "") -> tuple[Table, dict[KeyPath, str]]:
    """Returns a copy of the table with each `key=value` applied in turn, and the text of each setting by path of its
    key.

    A path is a tuple of keys and indices; it has indices from 0 where the key has ids. A key of a table that does not
    exist is added, so a misspelt key is found only by `validate`. Raises InputError if a setting is not of the form
    key=value, its value is not TOML, or its key leads into a plain value or to a row that an array does not have. file:
    named in the last two messages.
    """
    table = copy.deepcopy(table)
    places: dict[KeyPath, str] = {}
    for text in settings:
        key, value = parse_setting(text)
        places[_put(table, key, value, text, file)] = text
    return table, places


def place_of(text: str) -> str:
    """Returns the place of a setting for messages: `--set key=value`, of the setting at most 120 characters."""
    return f"--set {shortened(text, SHOWN)}"


def parse_setting(text: str) -> tuple[list[str], Any]:
    """Returns the steps of the key (`a.b` gives ["a", "b"]) and the TOML value of a setting `a.b=value`.

    The key ends at the first `=` and is cut at every dot, also inside quotes. A word without quotes is a string. Raises
    InputError for any other form, an empty step, a key of more than 32 steps, or a value that is not TOML.
    """
    key, equals, value = text.partition("=")
    steps = key.strip().split(".")
    if not equals or not all(steps):
        raise InputError(
            place=place_of(text), got=repr(text), expected="key=value", remedy="write for example --set group.a.size=3"
        )
    if len(steps) > DEPTH:
        raise InputError(place=place_of(text), got=f"{len(steps)} steps", expected=NESTING, remedy="shorten the key")
    return steps, parse_value(value.strip(), text)


def parse_value(value: str, text: str) -> Any:
    """Returns the Python value of the text of a TOML value.

    A word without quotes (a letter, then letters, digits, `_ . * : -`) is a string. Raises InputError for any other
    text; `text`, the whole setting, appears in its message.
    """
    try:
        table = parse_toml(f"value = {value}")
    except InputError:
        if re.fullmatch(r"[A-Za-z][\w.*:-]*", value):
            return value
        table = {}
    if list(table) != ["value"]:
        raise InputError(
            place=place_of(text), got=repr(value), expected="a TOML value", remedy="quote strings, put lists in [ ]"
        )
    return table["value"]


def _put(table: Table, steps: list[str], value: Any, text: str, file: object) -> KeyPath:
    """Sets the value in the table, which is modified; returns the path of its key, with ids replaced by indices from 0.

    steps: of the key, as ["group", "a", "size"]. text: the whole setting, and file: that of the table, for messages.
    Missing tables on the way are created. A table that replaces a row keeps the row's id. Raises InputError if the key
    leads into a plain value or to a row that an array does not have.
    """
    here: Any = table
    path: list[str | int] = []
    while True:
        if isinstance(here, dict):
            step, steps = steps[0], steps[1:]
            path.append(step)
            if not steps:
                here[step] = value
                return tuple(path)
            here = here.setdefault(step, {})
        elif isinstance(here, list):
            index, steps = _index(here, steps, value, text, file)
            path.append(index)
            if not steps:
                here[index : index + 1] = [_with_id(here, index, value)]
                return tuple(path)
            here = here[index]
        else:
            raise InputError(
                file=file,
                place=place_of(text),
                got=f"{'.'.join(map(str, path))} = {here!r}, which has no {steps[0]!r}",
                expected="a key that exists",
                remedy=f"set {'.'.join(map(str, path))} itself",
            )


def _index(rows: list[Any], steps: list[str], value: Any, text: str, file: object) -> tuple[int, list[str]]:
    """Returns the index in the array `rows` that the first steps name, by index from 0 or by id, and the steps after
    them.

    Ids may have dots; the longest id wins; an existing index wins over an id. A table `value` set on a new id gives the
    index after the last row, if the array has ids; `id` is added to that table, which is modified. Raises InputError if
    there is no such row. text: the whole setting, and file: that of the table, for the message.
    """
    if (index := _position(steps[0], len(rows))) is not None:
        return index, steps[1:]
    ids = {str(row["id"]): k for k, row in reversed(list(enumerate(rows))) if isinstance(row, dict) and "id" in row}
    for n in range(len(steps), 0, -1):
        name = ".".join(steps[:n])
        if name in ids:
            return ids[name], steps[n:]
    if isinstance(value, dict) and len(steps) == 1 and ids and not re.fullmatch("[0-9]+", steps[0]):
        value.setdefault("id", steps[0])
        return len(rows), []
    raise InputError(
        file=file,
        place=place_of(text),
        got=f"{steps[0]!r} in an array of {len(rows)}",
        expected="an index from 0 or an id" if ids else "an index from 0",
        remedy=did_you_mean(steps[0], list(ids) or [str(k) for k in range(len(rows))]),
    )


def _position(step: str, length: int) -> int | None:
    """Returns the index that a step names in an array of `length` items; None if it is no number or beyond the end."""
    return int(step) if re.fullmatch("[0-9]{1,9}", step) and int(step) < length else None


def _with_id(rows: list[Any], index: int, value: Any) -> Any:
    """Returns the value; if it is a table without `id` that replaces a row with one, a copy with the row's id.

    index may be one past the last row: the value is then returned as it is.
    """
    if index < len(rows) and isinstance(value, dict) and isinstance(rows[index], dict) and "id" in rows[index]:
        return {"id": rows[index]["id"], **value}
    return value
