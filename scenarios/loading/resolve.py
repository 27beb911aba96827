"""Loads scenarios: `load` returns the checked scenario of a catalogue name or a TOML file.

`resolve` returns the entries of a scenario or a suite; each entry is one sequence to make for every seed. A suite,
suites/*.toml, is an ordered list of scenarios with settings:

    about = "what this suite is for"
    entry = [ { name = "cross-dense", scenario = "cross", set = ["group.a.size=5"], repeat = 3 }, … ]

The profile of a detector, made by `flockscope fit sensor`, is a file with a [sensor] table alone;
`sensor_settings(path)` returns its keys as settings, for every function that takes settings of a scenario.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.errors import InputError
from scenarios.limits import REPEATS
from scenarios.loading import toml_files
from scenarios.loading.checks import check
from scenarios.loading.draws import check_draws, take_out
from scenarios.loading.toml_files import CATALOGUE, SUITES, Setting, did_you_mean, dump, names, suite_names
from scenarios.loading.validation import validate
from scenarios.schema.scenario import ObservationSpec, Scenario
from scenarios.schema.sensor import Sensor
from scenarios.schema.values import Model, Name, problem


class SensorFile(Model):
    """The content of a detector profile's file: `schema` (1, may be absent) and the required table `[sensor]`."""

    schema_: Literal[1] = Field(1, alias="schema")
    sensor: Sensor


def sensor_settings(path: str | Path) -> tuple[str, ...]:
    """Returns the profile of a detector as settings of a scenario.

    Args:
        path: A TOML file with a [sensor] table.

    Returns:
        A setting "sensor.key=value" for each key given in the file.

    Raises:
        InputError: The file cannot be read, has no [sensor] table, or has a wrong key or value.
    """
    table = toml_files.parse(Path(path), "check the path, or make one with `flockscope fit sensor`")
    validate(table, Path(path), model=SensorFile)
    return tuple(f"sensor.{key}={toml_files.toml_value(v)}" for key, v in table["sensor"].items())


def dump_sensor(sensor: Sensor, about: str = "") -> str:
    """Returns the text of a detector profile's file with all keys of `sensor`. about: comment lines at the top."""
    table = sensor.model_dump(mode="python", exclude_none=True)
    lines = [f"# {line}".rstrip() for line in about.splitlines()]
    rows = [f"{key} = {toml_files.toml_value(v)}" for key, v in table.items() if key != "hide" or v]
    return "\n".join([*lines, "schema = 1", "", "[sensor]", *rows, ""])


__all__ = ["Entry", "dump", "load", "load_observation", "names", "resolve", "sensor_settings", "suite_names"]


@dataclass(frozen=True)
class Entry:
    """One sequence to make for every seed."""

    name: str  # unique among the entries of a suite
    scenario: Scenario  # what to simulate, checked
    repeat: int = 0  # number of the copy, from 1, where a suite's entry has `repeat`, else 0
    # the scenario's file, or the suite's file and the entry, for messages; not compared
    file: str = field(default="", compare=False)


def load(name_or_path: str | Path, set: Iterable[str | Setting] = ()) -> Scenario:
    """Loads and checks a scenario.

    Args:
        name_or_path: A name of the catalogue, or a TOML file, sought in the working folder and then in the catalogue.
        set: Settings "key=value" or `Setting`, applied in turn after `extends`.

    Returns:
        The scenario with all defaults.

    Raises:
        InputError: Everything that can be found wrong without simulating: an unknown name, an unreadable file, a wrong
            key or value, a place in a wall, an order for a group that does not exist.
    """
    return _build(toml_files.find(name_or_path), tuple(set))


def load_observation(path: str | Path | None = None, set: Iterable[str] = ()) -> ObservationSpec:
    """Returns camera, sensor, light and picture of a TOML file; path None: all defaults. set: settings "key=value"."""
    table = {} if path is None else toml_files.parse(Path(path), "check --camera: a TOML file with [camera]")
    table, places = toml_files.apply_settings(table, tuple(set), path or "")
    return validate(table, path or "", places, model=ObservationSpec)


class SuiteEntry(Model):
    """One entry of a suite whose scenario is not loaded yet."""

    name: Name = ""  # of the sequence, unique; absent: the scenario's or suite's name
    scenario: str = ""  # catalogue name or *.toml file
    suite: str = ""  # in place of `scenario`: the entries of another suite, each with a name "<name>-<its name>"
    settings: tuple[str, ...] = Field((), alias="set")  # `key=value` texts
    # n makes the entries name-1 … name-n, whose numbers are one more key of their random streams; 0: one without number
    repeat: Annotated[int, Field(ge=1, le=REPEATS)] = 0

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if bool(self.scenario) == bool(self.suite):
            got = "scenario and suite" if self.scenario else "neither scenario nor suite"
            raise problem(got, "exactly one of scenario, suite", "keep one" if self.scenario else "add one")
        if self.suite and self.repeat:
            raise problem("repeat beside suite", "repeat in the suite's own entries", "remove it")
        return self

    def expanded(self, beside: Path, chain: tuple[Path, ...] = ()) -> list[SuiteEntry]:
        """Returns the entries for which this entry of a file stands: name-1 … name-n for `repeat` n, else one.

        For a suite these are its entries, with its name before theirs. beside: folder of the file. chain: suites that
        this one is part of.
        """
        if self.suite:
            file = suite_file(f"suite:{self.suite}", beside)
            assert file is not None
            name = self.name or file.stem
            return [
                each.model_copy(
                    update={
                        "name": f"{name}-{each.name}", "settings": each.settings + self.settings,
                        "scenario": str(toml_files.find(each.scenario, beside=file.parent).resolve()),
                    }
                )
                for each in read_suite(file, chain).entry
            ]  # fmt: skip
        name = self.name or Path(self.scenario).stem
        copies = [(f"{name}-{k}", k) for k in range(1, self.repeat + 1)] or [(name, 0)]
        return [self.model_copy(update={"name": each, "repeat": k}) for each, k in copies]


class Suite(Model):
    """The content of a suite file."""

    about: str = ""  # what it is for
    entry: Annotated[tuple[SuiteEntry, ...], Field(min_length=1)]


def read_suite(path: Path, chain: tuple[Path, ...] = ()) -> Suite:
    """Returns the content of a suite file with each entry expanded; raises InputError if two get the same name.

    chain: suites that this one is part of.
    """
    if path.resolve() in chain:
        got, expected = " → ".join(p.name for p in (*chain, path)), "suites that do not contain each other in a circle"
        raise InputError(file=path, place="entry", got=got, expected=expected, remedy="remove one `suite`")
    suite = validate(toml_files.parse(path), path, model=Suite)
    entries = tuple(each for row in suite.entry for each in row.expanded(path.parent, (*chain, path.resolve())))
    counts = Counter(entry.name for entry in entries)
    twice = next((name for name, count in counts.items() if count > 1), None)
    if twice is not None:
        got, expected = f"two entries named {twice!r}", "unique names"
        raise InputError(file=path, place="entry", got=got, expected=expected, remedy="give one a `name`")
    return suite.model_copy(update={"entry": entries})


def resolve(name: str, set: Iterable[str | Setting] = ()) -> list[Entry]:
    """Returns the entries of a name in the catalogue, a *.toml file (scenario or suite), or `suite:NAME`.

    set: settings, as of `load`, applied to each entry after the settings that the suite gives it.
    """
    settings, suite = tuple(set), suite_file(name)
    if suite is not None:
        return _entries(suite, settings)
    scenario = load(name, settings)
    return [Entry(scenario.name, scenario, file=str(toml_files.find(name)))]


def rows(name: str) -> list[SuiteEntry]:
    """Returns one SuiteEntry for each scenario for which a name, as `resolve` takes it, stands; copies count once.

    `scenario` of each can be given to `load` from any working folder.
    """
    suite = suite_file(name)
    if suite is None:
        return [SuiteEntry(name=load(name).name, scenario=name)]
    found: dict[tuple[str, tuple[str, ...]], SuiteEntry] = {}
    for entry in read_suite(suite).entry:
        file = toml_files.find(entry.scenario, beside=suite.parent)
        place = file.relative_to(CATALOGUE) if file.is_relative_to(CATALOGUE) else file
        changes = {
            "scenario": place.stem if str(place) == f"{place.stem}.toml" else str(place),
            "name": entry.name.removesuffix(f"-{entry.repeat}"), "repeat": 0,
        }  # fmt: skip
        found.setdefault((entry.scenario, entry.settings), entry.model_copy(update=changes))
    return list(found.values())


def is_catalogued(name: str) -> bool:
    """Returns True if a name is to be given to `resolve`: *.toml, suite:NAME, or a name of the catalogue."""
    return name.endswith(".toml") or name.startswith("suite:") or name in (*names(), *suite_names())


def suite_file(name: str, beside: Path | None = None) -> Path | None:
    """Returns the file of the suite that a name means, None if it means a scenario; InputError for an unknown name.

    beside: folder in which a path is sought first; None: the working folder.
    """
    wanted = name.removeprefix("suite:")
    if wanted.endswith(".toml"):
        path = toml_files.find(wanted, beside)
        return path if wanted != name or "entry" in toml_files.parse(path) else None
    if wanted in suite_names() and (wanted != name or name not in names()):
        return SUITES / f"{wanted}.toml"
    if name in names():
        return None
    known, expected = suite_names(), "a suite's name or file"
    if wanted == name:
        known, expected = names() + known, "a scenario, a suite or a *.toml file"
    raise InputError(got=repr(wanted), expected=expected, remedy=did_you_mean(wanted, known))


def _entries(path: Path, settings: tuple[str | Setting, ...]) -> list[Entry]:
    loaded: dict[tuple[str, tuple[str, ...]], Scenario] = {}
    entries = []
    for entry in read_suite(path).entry:
        key = (entry.scenario, entry.settings)
        # Copies of an entry are loaded once.
        if key not in loaded:
            try:
                file = toml_files.find(entry.scenario, beside=path.parent)
                loaded[key] = _build(file, entry.settings + settings)
            except InputError as error:
                where = f"{path}: entry {entry.name}" + (f": {error.file}" if error.file else "")
                raise error.replaced(file=where) from None
        scenario = loaded[key].model_copy(update={"name": entry.name})
        entries.append(Entry(entry.name, scenario, entry.repeat, f"{path}: entry {entry.name}"))
    return entries


def _build(path: Path, settings: tuple[str | Setting, ...]) -> Scenario:
    table, places = toml_files.apply_settings(toml_files.read(path), settings, path)
    table, draws = take_out(table, path, places)
    scenario = validate(table, path, places, model=Scenario)
    check(scenario, path)
    if draws:
        scenario = scenario.model_copy(update={"draws": draws})
        check_draws(scenario, path)
    return scenario
