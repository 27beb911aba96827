"""Loads scenarios: `load` one by name or file, `resolve` a file, scenario or suite into its entries."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading import overrides, suites, toml_files
from scenarios.loading.geometry_check import check
from scenarios.loading.toml_files import dump, names, suite_names
from scenarios.loading.validation import validate
from scenarios.schema.observation import ObservationSpec
from scenarios.schema.scenario import Scenario

__all__ = ["Entry", "dump", "load", "load_observation", "names", "resolve", "suite_names"]


@dataclass(frozen=True)
class Entry:
    """One sequence to make.

    name: unique; scenario: what to simulate; repeat: number of the copy from 1 where a suite's entry has `repeat`, else
    0; file: the scenario's file, and the entry in a suite, for messages.
    """

    name: str
    scenario: Scenario
    repeat: int = 0
    file: str = field(default="", compare=False)


def load(name_or_path: str | Path, set: Iterable[str] = ()) -> Scenario:
    """Returns the scenario of a catalogue name or a *.toml file.

    `extends` is applied first, then each `key=value` of `set` in turn. Raises InputError for everything that can be
    found wrong without simulating: an unknown name, a wrong key or value, a place in a wall, an order for a group that
    does not exist.
    """
    path = toml_files.find(name_or_path)
    return _build(path, tuple(set))


def load_observation(path: str | Path | None = None, set: Iterable[str] = ()) -> ObservationSpec:
    """Returns camera, sensor, light and picture of a TOML file, with each `key=value` of `set` applied.

    path: None for all defaults. Raises InputError if the file cannot be read or a key or value is wrong.
    """
    if path is not None and not Path(path).is_file():
        raise InputError(
            file=path, got="no such file", expected="a TOML file with [camera]", remedy="check --camera"
        )  # fmt: skip
    file = Path(path) if path is not None else ""
    table, places = overrides.apply_settings({} if path is None else toml_files.parse(Path(path)), tuple(set), file)
    return validate(table, file, places, model=ObservationSpec)


def resolve(name: str, set: Iterable[str] = ()) -> list[Entry]:
    """Returns the entries of a *.toml file (scenario or suite) or of a name in the catalogue.

    A name that is both a scenario's and a suite's means the scenario; `suite:NAME` means the suite. A scenario gives
    one entry. `set` is applied to each entry, after the entry's own settings. Raises InputError as `load` does.
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
    """Loads all entries of a suite file. Copies of an entry share one load; each scenario gets its entry's name."""
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
    """Loads the scenario of an entry; errors name the suite and the entry."""
    try:
        return _build(toml_files.find(entry.scenario, beside=path.parent), entry.settings + settings)
    except InputError as error:
        where = f"{path}: entry {entry.name}" + (f": {error.file}" if error.file else "")
        raise InputError(**{**error.as_dict(), "file": where}) from None


def _build(path: Path, settings: tuple[str, ...]) -> Scenario:
    """Reads, validates and checks the scenario of a file."""
    table, places = overrides.apply_settings(toml_files.read(path), settings, path)
    scenario = validate(table, path, places, model=Scenario)
    check(scenario, path)
    return scenario
