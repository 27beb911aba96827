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

from scenarios.errors import InputError, shortened
from scenarios.limits import DEPTH, NESTING
from scenarios.loading.toml_files import Table, did_you_mean
from scenarios.reading import parse_toml

KeyPath = tuple[str | int, ...]
SHOWN = 120  # characters of a setting that messages show


def apply_settings(table: Table, settings: Iterable[str], file: object = "") -> tuple[Table, dict[KeyPath, str]]:
    """Returns a copy of the table with each `key=value` applied, and the text of each by path of its key.

    A misspelt key is found by `validate`. file: for messages.
    """
    table = copy.deepcopy(table)
    places: dict[KeyPath, str] = {}
    for text in settings:
        key, value = parse_setting(text)
        places[_put(table, key, value, text, file)] = text
    return table, places


def place_of(text: str) -> str:
    """Returns the place of a setting for messages."""
    return f"--set {shortened(text, SHOWN)}"


def parse_setting(text: str) -> tuple[list[str], Any]:
    """Returns the steps of the key and the TOML value of a setting `a.b=value`."""
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
    """Returns the value of a TOML text, or of a word without quotes; `text` is the whole setting, for messages."""
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
    """Sets the value in the table; returns the path of its key, with ids replaced by indices."""
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
    """Returns the index in the array that the first steps name, by index or id, and the steps after them."""
    if (index := _position(steps[0], len(rows))) is not None:
        return index, steps[1:]
    ids = {str(row["id"]): k for k, row in reversed(list(enumerate(rows))) if isinstance(row, dict) and "id" in row}
    # Ids may have dots; the longest wins, and an existing index wins over an id.
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
    return int(step) if re.fullmatch("[0-9]{1,9}", step) and int(step) < length else None


def _with_id(rows: list[Any], index: int, value: Any) -> Any:
    if index < len(rows) and isinstance(value, dict) and isinstance(rows[index], dict) and "id" in rows[index]:
        return {"id": rows[index]["id"], **value}
    return value
