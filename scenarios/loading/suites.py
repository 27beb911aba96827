"""Reads suites: ordered lists of scenarios with settings, `suites/*.toml`.

    about = "what this suite is for"
    entry = [ { name = "cross-dense", scenario = "cross", set = ["group.a.size=5"], repeat = 3 }, … ]

name: unique; absent: the scenario's name. scenario: a catalogue name or a *.toml file. set: settings as for `--set`.
repeat = n makes the entries name-1 … name-n, whose numbers are one more key of their random streams.
"""

from __future__ import annotations

import os.path
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from scenarios.limits import REPEATS
from scenarios.loading.toml_files import SUITES, Table, did_you_mean, parse, suite_names

NAME = r"[A-Za-z][A-Za-z0-9_.-]*"
KEYS = {"name": str, "scenario": str, "set": list, "repeat": int}

EXPECTED = {
    "set": 'a list of "key=value"',
    "repeat": f"a number from 1 to {REPEATS}",
    "name": "a name: a letter, then letters, digits, '_', '.' or '-'",
}


@dataclass(frozen=True)
class SuiteEntry:
    """One entry of a suite whose scenario is not loaded yet."""

    name: str  # of the sequence, with -1, -2, … where the entry has `repeat`
    scenario: str  # catalogue name or *.toml file
    settings: tuple[str, ...]  # `key=value` texts
    repeat: int  # number of the copy from 1, 0 where the entry has no `repeat`


def find_suite(name: str) -> Path:
    """Returns the file of a suite, by name in the catalogue or path."""
    if name.endswith(".toml") and os.path.exists(name):
        return Path(name)
    if name in suite_names():
        return SUITES / f"{name}.toml"
    raise InputError(got=repr(name), expected="a suite's name or file", remedy=did_you_mean(name, suite_names()))


def read_entries(path: Path) -> list[SuiteEntry]:
    """Returns the entries of a suite file, in order, with an entry of `repeat = n` expanded to name-1 … name-n."""
    table = parse(path)
    for key in table.keys() - {"about", "entry"}:
        raise InputError(
            file=path,
            place=key,
            got="unknown key",
            expected="about or entry",
            remedy=did_you_mean(key, ["about", "entry"]),
        )
    entries = table.get("entry")
    if not isinstance(entries, list) or not entries:
        raise InputError(file=path, place="entry", got="no entry", expected="at least one", remedy="add one")
    expanded = [made for k, entry in enumerate(entries) for made in _expand(entry, f"entry.{k}", path)]
    seen: set[str] = set()
    for made in expanded:
        if made.name in seen:
            raise InputError(
                file=path,
                place="entry",
                got=f"two entries named {made.name!r}",
                expected="unique names",
                remedy="rename one",
            )
        seen.add(made.name)
    return expanded


def about(path: Path) -> str:
    """Returns what a suite is for; "" if its file does not say."""
    return str(parse(path).get("about", ""))


def _expand(entry: Any, place: str, path: Path) -> Iterator[SuiteEntry]:
    _check(entry, place, path)
    name = entry.get("name", Path(entry["scenario"]).stem)
    settings = tuple(entry.get("set", ()))
    if "repeat" not in entry:
        yield SuiteEntry(name, entry["scenario"], settings, 0)
    for k in range(1, entry.get("repeat", 0) + 1):
        yield SuiteEntry(f"{name}-{k}", entry["scenario"], settings, k)


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
                remedy=did_you_mean(key, list(KEYS)),
            )
        good = isinstance(value, KEYS[key]) and not isinstance(value, bool)
        good = good and (key != "set" or all(isinstance(text, str) for text in value))
        good = good and (key != "name" or re.fullmatch(NAME, value) is not None)
        if not good or (key == "repeat" and not 1 <= value <= REPEATS):
            expected = EXPECTED.get(key, "a string")
            raise InputError(
                file=path, place=f"{place}.{key}", got=repr(value), expected=expected, remedy="correct the value"
            )
    if "scenario" not in entry:
        raise InputError(file=path, place=place, got="no scenario", expected="a scenario's name", remedy="add it")
