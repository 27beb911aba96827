"""Suites: ordered lists of scenarios with settings, `suites/*.toml`.

    about = "what this suite is for"
    entry = [ { name = "cross-dense", scenario = "cross", set = ["group.a.size=5"], repeat = 3 }, … ]

name: unique, the scenario's or its file's where absent; set: as `--set` takes it; repeat = n expands to name-1 …
name-n, each with its number as a further random key (0 where there is no repeat).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.loading.toml_files import SUITES, Table, nearest, parse, suite_names

NAME = r"[A-Za-z][A-Za-z0-9_.-]*"
KEYS = {"name": str, "scenario": str, "set": list, "repeat": int}

EXPECTED = {
    "set": 'a list of "key=value"',
    "repeat": "a number from 1",
    "name": "a name: a letter, then letters, digits, '_', '.' or '-'",
}


@dataclass(frozen=True)
class SuiteLine:
    """One expanded entry, not loaded yet."""

    name: str
    scenario: str
    settings: tuple[str, ...]
    repeat: int


def find_suite(name: str) -> Path:
    """The file of a suite: a *.toml path or a name of the catalogue."""
    if name.endswith(".toml") and Path(name).is_file():
        return Path(name)
    if name in suite_names():
        return SUITES / f"{name}.toml"
    raise InputError(got=repr(name), expected="a suite's name or file", remedy=nearest(name, suite_names()))


def lines(path: Path) -> list[SuiteLine]:
    """The expanded entries of a suite file, in its order."""
    table = parse(path)
    for key in table.keys() - {"about", "entry"}:
        raise InputError(
            file=path, place=key, got="unknown key", expected="about or entry", remedy=nearest(key, ["about", "entry"])
        )
    entries = table.get("entry")
    if not isinstance(entries, list) or not entries:
        raise InputError(file=path, place="entry", got="no entry", expected="at least one", remedy="add one")
    expanded = [line for k, entry in enumerate(entries) for line in _expand(entry, f"entry.{k}", path)]
    seen: set[str] = set()
    for line in expanded:
        if line.name in seen:
            raise InputError(
                file=path,
                place="entry",
                got=f"two entries named {line.name!r}",
                expected="unique names",
                remedy="rename one",
            )
        seen.add(line.name)
    return expanded


def about(path: Path) -> str:
    """What the suite says about itself."""
    return str(parse(path).get("about", ""))


def _expand(entry: Any, place: str, path: Path) -> Iterator[SuiteLine]:
    _check(entry, place, path)
    name = entry.get("name", Path(entry["scenario"]).stem)
    settings = tuple(entry.get("set", ()))
    if "repeat" not in entry:
        yield SuiteLine(name, entry["scenario"], settings, 0)
    for k in range(1, entry.get("repeat", 0) + 1):
        yield SuiteLine(f"{name}-{k}", entry["scenario"], settings, k)


def _check(entry: Table, place: str, path: Path) -> None:
    if not isinstance(entry, dict):
        raise InputError(file=path, place=place, got=repr(entry), expected="a table", remedy="write { scenario = … }")
    for key, value in entry.items():
        if key not in KEYS:
            raise InputError(
                file=path,
                place=f"{place}.{key}",
                got="unknown key",
                expected="a known key",
                remedy=nearest(key, list(KEYS)),
            )
        good = isinstance(value, KEYS[key]) and not isinstance(value, bool)
        good = good and (key != "set" or all(isinstance(text, str) for text in value))
        good = good and (key != "name" or re.fullmatch(NAME, value) is not None)
        if not good or (key == "repeat" and value < 1):
            expected = EXPECTED.get(key, "a string")
            raise InputError(
                file=path, place=f"{place}.{key}", got=repr(value), expected=expected, remedy="correct the value"
            )
    if "scenario" not in entry:
        raise InputError(file=path, place=place, got="no scenario", expected="a scenario's name", remedy="add it")
