"""Values of a scenario that are drawn once for each seed in places where its tables take a fixed value.

Such a place holds a distribution, or a link to a named draw of the top-level table `draw`:

    draw = { night = { choice = [0, 1] } }
    camera = { tilt_deg = { uniform = [30, 60] }, image = { choice = [[640, 480], [320, 240]] } }
    light = { shadow = { link = "night", values = [0.3, 0.0] } }

`take_out` replaces each by one of its values, so that a Scenario can be made of the table; `check_draws` tries the
others. `sim.draws.drawn` draws the values of a seed.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import ValidationError

from scenarios.errors import InputError
from scenarios.loading.checks import check

# isort: off
# fmt: off
from scenarios.loading.toml_files import (
    DISTRIBUTION_KEYS, KeyPath, Setting, Table, apply_settings, did_you_mean, listed,
)
# fmt: on
# isort: on
from scenarios.loading.validation import path_of, validate
from scenarios.schema.scenario import Scenario
from scenarios.schema.values import Distribution, Model, Name, bounds

# pydantic's errors for a table in place of a fixed value, and for a number that is no integer
FIXED = {"float_type", "int_type", "tuple_type", "literal_error", "bool_type", "string_type", "no_goal"}
NO_INTEGER = {"int_type", "int_from_float"}
TAIL = 3.3  # standard deviations, or means of a skewed distribution: how far from the middle values are tried


class DrawTable(Model):
    """The table `draw` alone."""

    draw: dict[Name, Distribution]


def take_out(table: Table, file: object, places: dict[KeyPath, str]) -> tuple[Table, Table]:
    """Returns the table with one possible value in place of each draw, and the draws by key ("camera.tilt_deg").

    Raises InputError for a wrong link. file, places: for messages, as of `validate`.
    """
    if "draws" in table:
        remedy = "write each draw in the place of its value"
        raise InputError(file=file, place="draws", got="unknown key 'draws'", expected="a known key", remedy=remedy)
    named = validate({"draw": table.get("draw", {})}, file, places, model=DrawTable).draw
    table = copy.deepcopy(table)
    draws = dict(_links(table))
    for path, link in draws.items():
        _check_link(link, named, _key(path, table), file)
        _set(table, path, link_value(link, extremes(named[link["link"]])[0]))
    while misplaced := list(_misplaced(table, draws)):
        for path in misplaced:
            value = _at(table, path)
            if path not in draws:
                draws[path] = value
                try:
                    _set(table, path, _candidates(value)[0])
                except InputError as error:
                    raise error.replaced(file=file, place=f"{_key(path, table)}.{error.place}") from None
            else:
                _set(table, path, round(value))
    return table, {_key(path, table): value for path, value in draws.items()}


def _links(value: Any, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Table]]:
    if isinstance(value, dict) and "link" in value and value.keys() <= {"link", "values"}:
        yield path, value
        return
    for key, inner in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield from () if path == () and key == "draw" else _links(inner, (*path, key))


def _check_link(link: Table, named: Mapping[str, Distribution], key: str, file: object) -> None:
    name, values = link["link"], link.get("values")
    if name not in named:
        remedy = did_you_mean(str(name), named, "add it to the table `draw`")
        raise InputError(file=file, place=key, got=f"a link to {name!r}", expected="a name in `draw`", remedy=remedy)
    low, high = (round(x) for x in (min(extremes(named[name])), max(extremes(named[name]))))
    if "values" in link and not (isinstance(values, list) and low >= 0 and high < len(values)):
        got = f"{len(values)} values for {low} to {high}" if isinstance(values, list) else f"values = {values!r}"
        expected = f"a list with a value for each number from 0 that {name} can be"
        raise InputError(file=file, place=key, got=got, expected=expected, remedy="correct the list, or the draw")


def _misplaced(table: Table, draws: Mapping[KeyPath, Table]) -> Iterator[KeyPath]:
    """Yields the paths of distributions in places of fixed values, and of drawn numbers in places of integers."""
    try:
        Scenario.model_validate(_tupled(table), strict=True)
    except ValidationError as error:
        for each in error.errors(include_url=False):
            path = path_of(each["loc"])
            value, kind = _at(table, path), each["type"]
            whole = kind in NO_INTEGER and isinstance(value, float) and path in draws and _is_rounded(draws[path])
            if whole or (kind in FIXED and isinstance(value, dict) and value and value.keys() <= DISTRIBUTION_KEYS):
                yield path


def _tupled(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _tupled(inner) for key, inner in value.items()}
    return tuple(map(_tupled, value)) if isinstance(value, list) else value


def _at(here: Any, path: KeyPath) -> Any:
    for step in path:
        there = step in here if isinstance(here, dict) else isinstance(here, list) and step in range(len(here))
        here = here[step] if there else None
    return here


def _set(table: Table, path: KeyPath, value: Any) -> None:
    _at(table, path[:-1])[path[-1]] = value


def _key(path: KeyPath, table: Table) -> str:
    """Returns a path as a dotted key; rows appear by their id."""
    rows = [_at(table, path[: k + 1]) for k in range(len(path))]
    steps = zip(path, rows, strict=True)
    return ".".join(str(row["id"]) if isinstance(row, dict) and "id" in row else str(step) for step, row in steps)


def _is_rounded(value: Table) -> bool:
    return "choice" not in value and "values" not in value


def extremes(value: Distribution) -> list[float]:
    """Returns all values of a choice, else a least and a greatest value, beyond which hardly any draw lies."""
    low, high = bounds(value)
    if value.choice is not None:
        return [x for x in value.choice if low <= x <= high]
    middle, spread = value.normal or 2 * (value.exponential or value.poisson or 0.0,)
    ends = middle - TAIL * spread, middle + TAIL * spread
    return [x if math.isfinite(x) else end for x, end in zip((low, high), ends, strict=True)]


def _candidates(value: Table) -> list[Any]:
    if value.keys() == {"choice"} and isinstance(value["choice"], list) and value["choice"]:
        return list(value["choice"])
    return extremes(validate(value, model=Distribution))


def link_value(link: Table, x: float) -> Any:
    """Returns what a link stands for if the draw that it names is x."""
    return link["values"][round(x)] if "values" in link else x


def check_draws(scenario: Scenario, file: object) -> None:
    """Raises InputError if a value that can be drawn makes the scenario impossible."""
    draws = scenario.draws or {}
    links = {key: value for key, value in draws.items() if "link" in value}
    for name, value in (scenario.draw or {}).items():
        for x in extremes(value):
            with_values(scenario, {k: link_value(v, x) for k, v in links.items() if v["link"] == name}, file)
    for key in draws.keys() - links.keys():
        for candidate in _candidates(draws[key]):
            with_values(scenario, {key: candidate}, file)


def with_values(scenario: Scenario, values: Table, file: object) -> Scenario:
    """Returns the scenario with these values by key in place of its draws; InputError if that is impossible."""
    draws = scenario.draws or {}
    before = listed(scenario.model_dump(by_alias=True, exclude_none=True, exclude={"draw", "draws"}))
    table, paths = apply_settings(before, [Setting(key, value) for key, value in values.items()])
    for (key, value), path in zip(values.items(), paths, strict=True):
        if isinstance(_at(before, path), int) and isinstance(value, float) and _is_rounded(draws[key]):
            _set(table, path, round(value))
    found = validate(table, file, model=Scenario)
    check(found, str(file))
    return found
