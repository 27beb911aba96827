"""What can be taken out of a scenario, in pieces, and the scenario that is left.

The kinds of pieces, in the order in which they are tried (`STAGES` of `tracking.stress.minimize`):

    script        a group, or an order of the script
    seconds       the last second of the duration
    beginning     the first second of it: fixed groups start where they are a second later
    obstacles     a door, wall, pillar, flight of stairs or service point
    difficulties  a key of sensor, light, picture, crowd or camera: set to its easiest value, else to its default
    people        a person of a group (of a drawn size first those above the least), a copy of a group with `repeat`
    details       a stop, a point of a way, a sub-group, a part of a split, a group of a merge or queue, a hidden time

Keys that name a removed group or order are removed, too.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.checks import check
from scenarios.loading.toml_files import Table, dump
from scenarios.loading.validation import validate
from scenarios.reading import parse_toml
from scenarios.schema.groups import GroupSpec, SubGroupSpec
from scenarios.schema.scenario import Scenario, expand
from scenarios.schema.values import Distribution, Value, bounds
from sim.types import Array
from tracking.running.truth_detections import PERFECT_SENSOR, SEES_ALL

if TYPE_CHECKING:
    from sim.crowd.population import EnteringGroup

GONE: Any = object()
EASIEST: Table = {
    "sensor": PERFECT_SENSOR | SEES_ALL,
    "crowd": {"sway": 0.0, "velocity_noise": [0.0, 0.0], "place_noise": [0.0, 0.0]},
}
EASED = ("sensor", "light", "picture", "crowd", "camera")
LAYOUT = ("turn_deg", "lead", "mirror")
SIZES = ("fps", "image", "kind")  # of the camera: no default is easier than another value
OBSTACLES = ("doors", "walls", "pillars", "stairs", "service")  # doors before the walls that they lie in
DECIMALS = 2  # of places, times and speeds that are no longer drawn

Path = tuple[str | int, ...]  # of a value in the table of a scenario
Pattern = tuple[str | tuple[str, ...], ...]  # Paths: EACH stands for all elements of a list, a tuple for several keys.
EACH = "*"
DETAILS: tuple[Pattern, ...] = (
    ("sensor", "hide", EACH), ("light", "switch", EACH), ("group", EACH, ("stops", "via", "groups"), EACH),
    ("event", EACH, "parts", EACH, "size"),  # before the part itself
    ("event", EACH, ("parts", "via", "groups"), EACH),
)  # fmt: skip
TIMES: tuple[Pattern, ...] = (
    ("group", EACH, "enter"), ("group", EACH, "stops", EACH, "until", EACH), ("event", EACH, "when", "time"),
    ("sensor", "hide", EACH, ("start", "end")), ("light", "switch", EACH, "at"),
)  # fmt: skip


@dataclass(frozen=True)
class Piece:
    """One possible reduction of a scenario: `path`, the keys that lead to a value in its table (() the whole table),
    and `change`, a function from this value to the reduced one."""

    path: Path
    change: Callable[[Any], Any]

    def words(self, table: Any) -> str:
        """Returns the path as text; also " = value", the value in a scenario's table, if that is no table or list."""
        value = reduce(operator.getitem, self.path, table)
        key = ".".join(map(str, self.path))
        return key if isinstance(value, dict | list) else f"{key} = {value}"


def table_of(scenario: Scenario) -> Table:
    """Returns a scenario as a plain table (nested dicts and lists) with all its keys."""
    return parse_toml(dump(scenario))


def without(scenario: Scenario, pieces: Iterable[Piece]) -> Scenario | None:
    """Returns the scenario with these reductions applied, and everything removed that names a removed group or order;
    None if the result is no valid scenario."""
    table = table_of(scenario)
    for piece in pieces:
        table = _changed(table, piece.path, piece.change)
    table = _compact(table)
    _drop_dangling(table)
    return _valid(table)


def _changed(table: Any, path: Path, change: Callable[[Any], Any]) -> Any:
    """Returns the table with the value at `path` changed in place."""
    if not path:
        return change(table)
    table[path[0]] = _changed(table[path[0]], path[1:], change)
    return table


def _paths(value: Any, pattern: Pattern) -> Iterator[Path]:
    if not pattern:
        yield ()
        return
    first, rest = pattern[0], pattern[1:]
    named = (first,) if isinstance(first, str) else first
    for key in range(len(value)) if first == EACH else [key for key in named if key in value]:
        yield from ((key, *path) for path in _paths(value[key], rest))


def _each(patterns: Iterable[Pattern], scenario: Scenario) -> list[Piece]:
    """Returns the values that some patterns name."""
    table = table_of(scenario)
    return [_set(GONE, *path) for pattern in patterns for path in _paths(table, pattern)]


def _valid(table: Table) -> Scenario | None:
    try:
        found = validate(table, model=Scenario)
        check(found)
    except InputError:
        return None
    return found


def _compact(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _compact(inner) for key, inner in value.items() if inner is not GONE}
    return [_compact(inner) for inner in value if inner is not GONE] if isinstance(value, list) else value


def _drop_dangling(table: Table) -> None:
    """Removes groups and orders that begin after the end, and what names a group or an order that is gone."""
    end = table["duration"]
    table["group"] = [group for group in table["group"] if not _begins_after(group["enter"], end)]
    alive = [name for group in table["group"] for name in _names(group)]
    known, kept = [*alive], list[Table]()
    for event in table.get("event", []):
        when, made = event["when"], _made(event)
        after, near = when.get("after"), when.get("reach", {}).get("group")
        fires = after in [None, *(one["id"] for one in kept)] and near in [None, *alive]
        if fires and not _begins_after(when.get("time"), end) and _takes(event, alive, made):
            kept.append(event)
            known += made
    table["event"] = kept
    hides = table["sensor"].get("hide", [])
    table["sensor"]["hide"] = [hide for hide in hides if hide.get("group") in [*known, None]]


def _begins_after(time: Any, end: float) -> bool:
    return isinstance(time, int | float) and time >= end


def _names(group: Table) -> list[str]:
    return [group["id"]] if group["repeat"] == 1 else [f"{group['id']}-{k + 1}" for k in range(group["repeat"])]


def _made(event: Table) -> list[str]:
    """Returns the groups that an order makes of its groups, none if they stay."""
    return [event["into"]] if "into" in event else [part["id"] for part in event.get("parts", [])]


def _takes(event: Table, alive: list[str], made: list[str]) -> bool:
    """Returns True if an order has groups; leaves out those that are gone, and changes the list of existing groups."""
    given = event.get("groups", [event.get("group")])
    groups = [pattern for pattern in given if set(expand(pattern, alive)) & {*alive}]
    if len(groups) < (2 if "into" in event else 1):
        return False
    event |= {"groups": groups} if "groups" in event else {}
    for name in groups if made else ():
        alive.remove(name)
    alive += made
    return True


def seconds(scenario: Scenario) -> list[Piece]:
    """Returns one piece for each second that can be cut off at the end; at least a part of a second is left."""
    return [Piece(("duration",), lambda now: round(now - 1.0, 6))] * (math.ceil(scenario.duration) - 1)


def beginning(scenario: Scenario) -> list[Piece]:
    """Returns one piece for each second that can be cut off at the start; none if some group is drawn at random."""
    fixed = all(g.speed is not None and g.repeat == 1 and _numbers(g.enter, *g.start, *g.goal) for g in scenario.group)
    return [Piece((), _second_later)] * (math.ceil(scenario.duration) - 1) if fixed else []


def _numbers(*values: Any) -> bool:
    return all(isinstance(value, int | float) for value in values)


def _second_later(table: Table) -> Table:
    """Returns a scene that begins a second later."""

    def earlier(time: Any) -> Any:
        return min(time, max(round(time - 1.0, DECIMALS), 0.0)) if _numbers(time) else time

    table["duration"] = round(table["duration"] - 1.0, 6)
    for group in table["group"]:
        if group["enter"] <= 0:
            _walk(group)
    for path in [path for pattern in TIMES for path in _paths(table, pattern)]:
        _changed(table, path, earlier)
    return table


def _walk(group: Table) -> None:
    """Moves a group's start by its way of a second, straight on to the next point or to the goal."""
    stops, via = group.get("stops", []), group.get("via", [])
    end = stops[0]["at"] if stops else via[0] if via else group["goal"]
    if not _numbers(*end, group["speed"], *group["start"]):
        return
    way = np.subtract(end, group["start"])
    share = min(1.0, group["speed"] / max(math.hypot(*way), 1e-9))
    group["start"] = [round(float(v), DECIMALS) for v in group["start"] + share * way]
    if share == 1.0 and not stops and via:
        del via[0]


def script(scenario: Scenario) -> list[Piece]:
    """Returns one piece for the removal of each order of the script, last order first, then of each group."""
    return [*reversed(_each([("event", EACH)], scenario)), *_each([("group", EACH)], scenario)]


def obstacles(scenario: Scenario) -> list[Piece]:
    """Returns one piece for the removal of each door, wall, pillar, flight of stairs and service point."""
    return _each([("world", OBSTACLES, EACH)], scenario)


def difficulties(scenario: Scenario) -> list[Piece]:
    """Returns a piece for each key that can be set to its easiest value (its default if no value is known to be
    easiest), and does not have it."""
    found = [_set(GONE, key) for key in LAYOUT if getattr(scenario, key) != Scenario.model_fields[key].default]
    for name in EASED:
        part, easiest = getattr(scenario, name), EASIEST.get(name, {})
        easy = type(part).model_validate(easiest)
        for key in type(part).model_fields:
            if (name != "camera" or key not in SIZES) and getattr(part, key) != getattr(easy, key):
                found.append(_set(easiest.get(key, GONE), name, key))
    return found


def people(scenario: Scenario) -> list[Piece]:
    """Returns a piece for each person after the first of a group, and for each copy (`repeat`) after the first. A size
    that is drawn is first set to its least value."""
    pieces = []
    for k, group in enumerate(scenario.group):
        whole: list[tuple[Path, GroupSpec | SubGroupSpec]] = [(("group", k), group)]
        parts = whole[1:] + [(("group", k, "groups", j), part) for j, part in enumerate(group.groups)]
        for path, part in parts or whole:
            size = (*path, "size")
            if isinstance(part.size, Distribution):
                pieces.append(_set(_least(part.size), *size))
            else:
                pieces += [Piece(size, lambda now: round(now) - 1)] * (round(part.size) - 1)
        for path, part in parts + whole:
            pieces += [Piece((*path, "repeat"), lambda now: now - 1)] * (part.repeat - 1)
    return pieces


def _least(size: Value) -> int:
    low = bounds(size)[0]
    return max(1, round(low)) if math.isfinite(low) else 1


def details(scenario: Scenario) -> list[Piece]:
    """Returns one piece for the removal of each stop, point on a way, part of a split, and so on (`DETAILS`)."""
    return _each(DETAILS, scenario)


def _set(value: Any, *path: str | int) -> Piece:
    return Piece(path, lambda now: value)


def pinned(scenario: Scenario, seed: int, repeat: int = 0) -> Scenario | None:
    """Returns the scenario with the groups that a seed draws, each with fixed size, places, speed and times; None if
    the groups cannot be drawn.

    If a fixed group is removed later, all others stay where they are. Removing a drawn group would change the others.
    """
    from sim.crowd.navigation import scene_of
    from sim.crowd.population import draw_population, script_placement

    try:
        drawn = draw_population(scenario, scene_of(scenario.world), seed, repeat)
    except InputError:
        return None
    placed = script_placement(scenario, seed, repeat)
    mirrored = placed.flip < 0 and bool(scenario.event)  # the places of orders stay as they are

    def place(point: Array) -> list[float]:
        c, s = np.cos(placed.turn), np.sin(placed.turn)
        x, y = point - placed.middle
        back = np.array([(-1 if mirrored else 1) * (c * x + s * y), c * y - s * x])
        return [round(float(v), DECIMALS) for v in placed.middle + back]

    table = table_of(scenario)
    scatter = {name: group.get("scatter", 0.0) for group in table["group"] for name in _names(group)}
    table["lead"], table["mirror"] = 0.0, mirrored  # the drawn starts hold both
    table["turn_deg"] = round(float(np.rad2deg(placed.turn)), DECIMALS)
    table["group"] = [
        {
            "id": group.name, **_people_of([part for part in drawn if part.head == group.index]),
            "start": place(group.start), "goal": place(group.goal),
            "via": [place(point) for point in group.via], "speed": round(group.speed, DECIMALS),
            "enter": round(group.enter, DECIMALS), "at_goal": group.finish, "scatter": scatter[group.name],
            "stops": [
                {
                    "at": place(stop.at), "stay": round(stop.stay, DECIMALS), "until": list(stop.until),
                    **({} if stop.whole else {"members": len(stop.members)}),
                } for stop in group.stops
            ],
        } for group in drawn if group.head == group.index
    ]  # fmt: skip
    return _valid(table)


def _people_of(parts: list[EnteringGroup]) -> dict[str, Any]:
    """Returns the keys of a drawn group that say who its people are. parts: its sub-groups, or itself."""
    found = [{"size": len(part.members), "formation": "none" if part.flock else "rows"} for part in parts]
    if not parts[0].part:
        return found[0]
    names = [part.part.removeprefix(f"{part.name}.") for part in parts]
    return {"groups": [{"id": name} | own for name, own in zip(names, found, strict=True)]}
