"""From names and files to scenarios: `load` one, or `resolve` a file, scenario or suite into its entries."""

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
    """One sequence to make: its unique name, what to simulate, and the number of a suite's `repeat` (0: none).

    file: where the scenario stands, for messages.
    """

    name: str
    scenario: Scenario
    repeat: int = 0
    file: str = field(default="", compare=False)


def load(name_or_path: str | Path, set: Iterable[str] = ()) -> Scenario:
    """The scenario of a catalogue name or a *.toml file, `extends` resolved and every `key=value` of `set` applied.

    InputError (file, place, got, expected, remedy) where anything is wrong that can be seen without simulating.
    """
    path = toml_files.find(name_or_path)
    return _build(path, tuple(set))


def load_observation(path: str | Path | None = None, set: Iterable[str] = ()) -> ObservationSpec:
    """The view of a file (None: all defaults) with every `key=value` of `set` applied; InputError otherwise."""
    if path is not None and not Path(path).is_file():
        raise InputError(
            file=path, got="no such file", expected="a TOML file with [camera]", remedy="check --camera"
        )  # fmt: skip
    file = Path(path) if path is not None else ""
    table, places = overrides.apply({} if path is None else toml_files.parse(Path(path)), tuple(set), file)
    return validate(table, file, places, model=ObservationSpec)


def resolve(name: str, set: Iterable[str] = ()) -> list[Entry]:
    """The entries of a *.toml file (scenario or suite), a scenario's name or a suite's; `suite:NAME` forces the suite.

    `set` is applied to every entry, after the entry's own settings.
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
            got=repr(name), expected="a scenario, a suite or a *.toml file", remedy=toml_files.nearest(name, known)
        )
    scenario = load(name, settings)
    return [Entry(scenario.name, scenario, file=str(toml_files.find(name)))]


def _entries(path: Path, settings: tuple[str, ...]) -> list[Entry]:
    """Every entry loaded; a repeat shares one load, and each scenario bears its entry's name."""
    loaded: dict[tuple[str, tuple[str, ...]], Scenario] = {}
    entries = []
    for line in suites.lines(path):
        key = (line.scenario, line.settings)
        if key not in loaded:
            loaded[key] = _load_line(line, path, settings)
        scenario = loaded[key].model_copy(update={"name": line.name})
        entries.append(Entry(line.name, scenario, line.repeat, f"{path}: entry {line.name}"))
    return entries


def _load_line(line: suites.SuiteLine, path: Path, settings: tuple[str, ...]) -> Scenario:
    try:
        return _build(toml_files.find(line.scenario, beside=path.parent), line.settings + settings)
    except InputError as error:
        where = f"{path}: entry {line.name}" + (f": {error.file}" if error.file else "")
        raise InputError(**{**error.as_dict(), "file": where}) from None


def _build(path: Path, settings: tuple[str, ...]) -> Scenario:
    table, places = overrides.apply(toml_files.read(path), settings, path)
    scenario = validate(table, path, places, model=Scenario)
    check(scenario, path)
    return scenario
