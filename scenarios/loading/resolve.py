"""Loads scenarios: `load` returns the checked scenario of a catalogue name or a TOML file.

`resolve` returns the entries of a scenario or a suite (a list of scenarios); each entry is one sequence to make for
every seed.
"""

from __future__ import annotations

import os.path
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading import overrides, suites, toml_files
from scenarios.loading.geometry_check import check
from scenarios.loading.toml_files import dump, names, suite_names
from scenarios.loading.validation import validate
from scenarios.loading.value_check import check_observation
from scenarios.schema.observation import ObservationSpec
from scenarios.schema.scenario import Scenario

__all__ = ["Entry", "dump", "load", "load_observation", "names", "resolve", "suite_names"]


@dataclass(frozen=True)
class Entry:
    """One sequence to make for every seed.

    - name: unique among the entries of a suite. scenario: what to simulate, checked.
    - repeat: number of the copy, from 1, where a suite's entry has `repeat`, else 0.
    - file: the scenario's file, or the suite's file and the entry, for messages; not compared.
    """

    name: str
    scenario: Scenario
    repeat: int = 0
    file: str = field(default="", compare=False)


def load(name_or_path: str | Path, set: Iterable[str] = ()) -> Scenario:
    """Returns the checked scenario of a catalogue name or a *.toml file (relative to the working folder, else the
    catalogue).

    `extends` is applied first, then each `key=value` of `set` in turn. Raises InputError for everything that can be
    found wrong without simulating: an unknown name, an unreadable file, a wrong key or value, a malformed setting, a
    place in a wall, an order for a group that does not exist.
    """
    path = toml_files.find(name_or_path)
    return _build(path, tuple(set))


def load_observation(path: str | Path | None = None, set: Iterable[str] = ()) -> ObservationSpec:
    """Returns camera, sensor, light and picture of a TOML file, with each `key=value` of `set` applied in turn.

    path None: all defaults. `extends` is not supported: it is an unknown key. Raises InputError if the file does not
    exist, is not TOML, or a key, value or setting is wrong.
    """
    if path is not None and not os.path.exists(path):
        raise InputError(
            file=path, got="no such file", expected="a TOML file with [camera]", remedy="check --camera"
        )  # fmt: skip
    file = Path(path) if path is not None else ""
    table, places = overrides.apply_settings({} if path is None else toml_files.parse(Path(path)), tuple(set), file)
    spec = validate(table, file, places, model=ObservationSpec)
    try:
        check_observation(spec)
    except InputError as error:
        raise InputError(**{**error.as_dict(), "file": str(file)}) from None
    return spec


def resolve(name: str, set: Iterable[str] = ()) -> list[Entry]:
    """Returns the entries, in order, of a *.toml file (scenario or suite) or of a name in the catalogue.

    A name that is both a scenario's and a suite's means the scenario; `suite:NAME` means the suite. A scenario gives
    one entry. Each `key=value` of `set` is applied to each entry, after the entry's own settings. Raises InputError for
    an unknown name, a wrong suite file, and everything that `load` finds wrong in a scenario.
    """
    settings = tuple(set)
    if name.startswith("suite:"):
        return _entries(suites.find_suite(name.removeprefix("suite:")), settings)
    if name.endswith(".toml"):
        path = toml_files.find(name)
        if "entry" in toml_files.parse(path):
            return _entries(path, settings)
    elif name not in names():
        if name in suite_names():
            return _entries(suites.find_suite(name), settings)
        known = names() + suite_names()
        raise InputError(
            got=repr(name), expected="a scenario, a suite or a *.toml file", remedy=toml_files.did_you_mean(name, known)
        )
    scenario = load(name, settings)
    return [Entry(scenario.name, scenario, file=str(toml_files.find(name)))]


def _entries(path: Path, settings: tuple[str, ...]) -> list[Entry]:
    """Returns all entries of a suite file, in order, loaded; settings are applied after each entry's own.

    Copies of an entry are loaded once. Each scenario gets its entry's name. Raises InputError if the suite or a
    scenario is wrong.
    """
    loaded: dict[tuple[str, tuple[str, ...]], Scenario] = {}
    entries = []
    for entry in suites.read_entries(path):
        key = (entry.scenario, entry.settings)
        if key not in loaded:
            loaded[key] = _load_entry(entry, path, settings)
        scenario = loaded[key].model_copy(update={"name": entry.name})
        entries.append(Entry(entry.name, scenario, entry.repeat, f"{path}: entry {entry.name}"))
    return entries


def _load_entry(entry: suites.SuiteEntry, path: Path, settings: tuple[str, ...]) -> Scenario:
    """Returns the scenario of an entry of the suite file `path`, with the entry's settings, then `settings`.

    A scenario file is sought beside the suite first, then in the catalogue. Raises InputError, naming the suite and the
    entry, if there is no such scenario, it is wrong, or it cannot work.
    """
    try:
        return _build(toml_files.find(entry.scenario, beside=path.parent), entry.settings + settings)
    except InputError as error:
        where = f"{path}: entry {entry.name}" + (f": {error.file}" if error.file else "")
        raise InputError(**{**error.as_dict(), "file": where}) from None


def _build(path: Path, settings: tuple[str, ...]) -> Scenario:
    """Returns the scenario of a file, with `extends` and then each `key=value` setting applied.

    Raises InputError, naming the file, if it is unreadable, if a key, value or setting is wrong, or if the scenario
    cannot work.
    """
    table, places = overrides.apply_settings(toml_files.read(path), settings, path)
    scenario = validate(table, path, places, model=Scenario)
    check(scenario, path)
    return scenario
