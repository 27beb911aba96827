"""Reads and writes scenario files as plain tables: where they lie, TOML, `extends`, and `--set`.

A file with `extends = "base.toml"` (relative to itself, else in the catalogue) is merged over its base:

- a table is merged key by key with the table of the same key; an empty table changes nothing;
- a distribution, a link and a `when` replace the value of the base as a whole, though they are tables, too;
- two lists of tables that all have an `id` (group, event, parts) are merged by id: rows with a known id are merged,
  rows with a new id are appended;
- any other value replaces the value of the base;
- `name` is not inherited: without one, a scenario has the name of its own file.

`--set key=value` changes such a table: `camera.fps=25`, `group.a.size=3`, `group.0.size`, `world.size.0=20`. It differs
from merging, as it replaces the value of the key, also where that is a table. A step into an array is an index from 0
or an `id`. Values are TOML (`3`, `[8, 5]`, `{ uniform = [0, 5] }`, `"top"`); a word without quotes is a string. A table
that replaces a row of an array keeps the row's id. A table set on a new id (`group.x={ size = 2, … }`) is appended to
the array.
"""

from __future__ import annotations

import copy
import difflib
import json
import os.path
import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from scenarios.errors import InputError, shortened
from scenarios.limits import DEPTH, NESTING, TOML_BYTES
from scenarios.reading import parse_toml, read_regular

if TYPE_CHECKING:
    from pydantic import BaseModel

CATALOGUE = Path(__file__).parents[1]
SUITES = CATALOGUE / "suites"
DISTRIBUTION_KEYS = frozenset({"normal", "uniform", "exponential", "poisson", "choice", "clip"})
DRAW_KEYS = DISTRIBUTION_KEYS | {"link", "values"}

Table = dict[str, Any]


def names() -> list[str]:
    """Returns the names of the scenarios in the catalogue, sorted."""
    return sorted(path.stem for path in CATALOGUE.glob("*.toml"))


def suite_names() -> list[str]:
    """Returns the names of the suites in the catalogue, sorted."""
    return sorted(path.stem for path in SUITES.glob("*.toml"))


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Returns a remedy for an unknown name `word`: "did you mean …?" with the `known` name that differs in upper and
    lower case only, else similar ones; without one `otherwise`, by default all names."""
    names = list(known)
    same = [name for name in names if name.casefold() == word.casefold()]
    if close := same or difflib.get_close_matches(word, names, n=3, cutoff=0.5):
        return f"did you mean {' or '.join(close)}?"
    return otherwise or ("choose one of " + ", ".join(names) if names else "there is none to choose from")


def find(name: str | Path, beside: Path | None = None) -> Path:
    """Returns the file of a scenario, by its name in the catalogue or its path.

    A path is sought in the folder `beside` (None: the working folder), then in the catalogue. Else InputError.
    """
    text = str(name)
    if not text.endswith(".toml"):
        path = CATALOGUE / f"{text}.toml"
        if text in names():
            return path
        expected = "the name of a scenario or a *.toml file"
        raise InputError(got=repr(text), expected=expected, remedy=did_you_mean(text, names()))
    for folder in (beside or Path(), CATALOGUE):
        if os.path.exists(folder / text):
            return folder / text
    remedy = "check the path, or name a scenario"
    raise InputError(file=text, got="no such file", expected="a scenario file", remedy=remedy)


def parse(path: Path, remedy: str = "check the path and its permissions") -> Table:
    """Returns the content of a TOML file without applying `extends`. remedy: for the error if unreadable."""
    body = read_regular(path, TOML_BYTES, remedy)
    try:
        return parse_toml(body.decode("utf-8-sig"), path)
    except UnicodeDecodeError as error:
        place, got = f"byte {error.start}", "bytes that are not UTF-8"
        raise InputError(file=path, place=place, got=got, expected="TOML", remedy="save the file as UTF-8") from None


def read(path: Path, chain: tuple[Path, ...] = ()) -> Table:
    """Returns the content of a TOML file merged over the files that it extends. chain: files that extend this one."""
    chain = (*chain, path.resolve())
    table = parse(path)
    base = table.pop("extends", None)
    if base is None:
        return {**table, "name": table.get("name", path.stem)}
    if not isinstance(base, str):
        remedy = "put the name in quotes"
        raise InputError(file=path, place="extends", got=repr(base), expected="a file's name", remedy=remedy)
    try:
        base_path = find(base, beside=path.parent)
    except InputError as error:
        raise error.replaced(file=path, place="extends", got=repr(base)) from None
    if base_path.resolve() in chain:
        got = " → ".join(p.name for p in (*chain, base_path))
        expected = "files that do not extend each other in a circle"
        raise InputError(file=path, place="extends", got=got, expected=expected, remedy="remove one `extends`")
    return {**merge(read(base_path, chain), table), "name": table.get("name", path.stem)}


def merge(below: Table, above: Table) -> Table:
    """Returns the table `above` merged over `below` by the rules in the module's text; neither is changed."""
    return {**below, **{key: _merge_value(key, below.get(key), value) for key, value in above.items()}}


def _merge_value(key: str, below: Any, above: Any) -> Any:
    if isinstance(below, dict) and isinstance(above, dict):
        whole = key == "when" or (bool(above) and above.keys() <= DRAW_KEYS) or above.keys() >= {"at", "value"}
        return above if whole else merge(below, above)
    if _has_ids(below) and _has_ids(above):
        rows = list(below)
        for row in above:
            place = next((k for k, old in enumerate(below) if old["id"] == row["id"]), len(rows))
            rows[place : place + 1] = [merge(rows[place], row) if place < len(rows) else row]
        return rows
    return above


def _has_ids(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) and "id" in row for row in value)


def dump(scenario: BaseModel, defaults: bool = True) -> str:
    """Returns a scenario, or another model of tables, as TOML with its draws; equal models give equal bytes.

    defaults: False leaves out the keys that have their default value.
    """
    draws: Table = getattr(scenario, "draws", None) or {}
    table = scenario.model_dump(by_alias=True, exclude_none=True, exclude_defaults=not (defaults or draws))
    table.pop("draws", None)
    table = apply_settings(listed(table), [Setting(key, value) for key, value in draws.items()])[0]
    tables = {key: v for key, v in table.items() if isinstance(v, dict)}
    arrays = {key: v for key, v in table.items() if isinstance(v, list) and v and isinstance(v[0], dict)}
    blocks = []
    for key in (key for key in table if key in tables or key in arrays):
        blocks += [f"[{key}]\n" + _lines(tables[key])] if key in tables else []
        blocks += [f"[[{key}]]\n" + _lines(row) for row in arrays.get(key, ())]
    return "\n".join([_lines({key: v for key, v in table.items() if key not in tables | arrays}), *blocks])


def listed(value: Any) -> Any:
    """Returns a copy of tables and arrays with lists in place of tuples."""
    if isinstance(value, dict):
        return {key: listed(inner) for key, inner in value.items()}
    return [listed(inner) for inner in value] if isinstance(value, tuple | list) else value


def _lines(table: dict[str, Any]) -> str:
    return "".join(f"{key} = {toml_value(v)}\n" for key, v in table.items())


def toml_value(v: Any) -> str:
    """Returns a value as TOML on one line; keys of dicts are not quoted."""
    if isinstance(v, bool):
        return str(v).lower()
    if isinstance(v, str):
        return json.dumps(v, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(v, dict):
        return "{ " + ", ".join(f"{key} = {toml_value(inner)}" for key, inner in v.items()) + " }"
    if isinstance(v, tuple | list):
        return "[" + ", ".join(map(toml_value, v)) + "]"
    return repr(v)


KeyPath = tuple[str | int, ...]
SHOWN = 120  # characters of a setting that messages show


class Setting(NamedTuple):
    """A key of a scenario, as "group.a.size", and its value; its text is `key=value`."""

    key: str
    value: Any

    def __str__(self) -> str:
        return f"{self.key}={toml_value(self.value)}"


def apply_settings(
    table: Table, settings: Iterable[str | Setting], file: object = ""
) -> tuple[Table, dict[KeyPath, str]]:
    """Returns a copy of the table with each setting applied, and the text of each setting by the path of its key.

    A misspelt key is not refused here but by `validate`. file: for messages.
    """
    table = copy.deepcopy(table)
    places: dict[KeyPath, str] = {}
    for setting in settings:
        text = str(setting)
        key, value = parse_setting(text) if isinstance(setting, str) else (setting.key.split("."), setting.value)
        places[_put(table, key, value, text, file)] = text
    return table, places


def place_of(text: str) -> str:
    """Returns a setting as `place` of an InputError: "--set key=value", cut in the middle if long."""
    return f"--set {shortened(text, SHOWN)}"


def parse_setting(text: str) -> tuple[list[str], Any]:
    """Returns the steps of the key, ["a", "b"], and the value of a setting `a.b=value`; else InputError."""
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
    """Returns the value of a TOML text; a word without quotes is a string. text: the whole setting, for messages."""
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


def _put(here: Any, steps: list[str], value: Any, text: str, file: object, path: KeyPath = ()) -> KeyPath:
    """Sets the value in a table or array; returns the path of its key, with ids replaced by indices."""
    if not isinstance(here, dict | list):
        key = ".".join(map(str, path))
        got, remedy = f"{key} = {here!r}, which has no {steps[0]!r}", f"set {key} itself"
        raise InputError(file=file, place=place_of(text), got=got, expected="a key that exists", remedy=remedy)
    step: Any = steps[0]
    rest = steps[1:]
    if isinstance(here, list):
        step, rest = _index(here, steps, value, text, file)
    if rest:
        inside = here.setdefault(step, {}) if isinstance(here, dict) else here[step]
        return _put(inside, rest, value, text, file, (*path, step))
    if isinstance(here, dict):
        here[step] = value
    else:
        here[step : step + 1] = [_with_id(here, step, value)]
    return (*path, step)


def _index(rows: list[Any], steps: list[str], value: Any, text: str, file: object) -> tuple[int, list[str]]:
    """Returns the index in the array that the first steps name, by index or id, and the steps after them."""
    if re.fullmatch("[0-9]{1,9}", steps[0]) and int(steps[0]) < len(rows):
        return int(steps[0]), steps[1:]
    ids = {str(rows[k]["id"]): k for k in reversed(range(len(rows))) if isinstance(rows[k], dict) and "id" in rows[k]}
    # Ids may have dots; the longest wins, and an existing index wins over an id.
    for n in range(len(steps), 0, -1):
        name = ".".join(steps[:n])
        if name in ids:
            return ids[name], steps[n:]
    if isinstance(value, dict) and len(steps) == 1 and ids and not re.fullmatch("[0-9]+", steps[0]):
        value.setdefault("id", steps[0])
        return len(rows), []
    expected = "an index from 0 or an id" if ids else "an index from 0"
    known = list(ids) or [str(k) for k in range(len(rows))]
    got, remedy = f"{steps[0]!r} in an array of {len(rows)}", did_you_mean(steps[0], known)
    raise InputError(file=file, place=place_of(text), got=got, expected=expected, remedy=remedy)


def _with_id(rows: list[Any], index: int, value: Any) -> Any:
    if index < len(rows) and isinstance(value, dict) and isinstance(rows[index], dict) and "id" in rows[index]:
        return {"id": rows[index]["id"], **value}
    return value
