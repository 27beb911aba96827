"""What can be taken out of a scenario, in pieces, and the scenario that is left.

The pieces, in the order in which `tracking.stress.minimize` tries them:

    script        a group, or an order of the script
    seconds       the last second of the duration
    beginning     the first second of it: fixed groups start where they are a second later
    obstacles     a door, wall, pillar, flight of stairs or service point
    difficulties  a key of sensor, light, picture, crowd or camera: set to its easiest value, else to its default
    defaults      a key that cannot have its easiest value: set to its default
    people        a person of a group (of a drawn size first those above the least), a copy of a group with `repeat`
    details       a stop or point on a group's way, a part of a split, a group of a merge or queue, a hidden time

What names a group or an order that is gone goes with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.loading.checks import check
from scenarios.loading.toml_files import Table, dump
from scenarios.loading.validation import validate
from scenarios.reading import parse_toml
from scenarios.schema.scenario import Scenario, expand
from scenarios.schema.values import Distribution, Value, bounds
from sim.types import Array
from tracking.running.detection_mode import PERFECT_SENSOR, SEES_ALL

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


@dataclass(frozen=True)
class Piece:
    """A value in the table of a scenario, () the whole table, and the function that takes something away from it."""

    path: tuple[str | int, ...]
    change: Callable[[Any], Any]

    def words(self, table: Table) -> str:
        """Returns the key, and the value that it has in a table if that is short."""
        value: Any = table
        for step in self.path:
            value = value[step]
        key = ".".join(map(str, self.path))
        return key if isinstance(value, dict | list) else f"{key} = {value}"


Stage = Callable[[Scenario], list[Piece]]


def table_of(scenario: Scenario) -> Table:
    """Returns all keys of a scenario as a plain table."""
    return parse_toml(dump(scenario))


def without(scenario: Scenario, pieces: Iterable[Piece]) -> Scenario | None:
    """Returns the scenario without some pieces, None if nothing valid is left."""
    table = table_of(scenario)
    for piece in pieces:
        if not piece.path:
            table = piece.change(table)
            continue
        *way, last = piece.path
        here: Any = table
        for step in way:
            here = here[step]
        here[last] = piece.change(here[last])
    table = _compact(table)
    _drop_dangling(table)
    return _valid(table)


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
    known, kept = [*alive], list[str]()
    events = []
    for event in table.get("event", []):
        when = event["when"]
        after, near = when.get("after"), when.get("reach", {}).get("group")
        fires = after in [None, *kept] and near in [None, *alive] and not _begins_after(when.get("time"), end)
        if fires and _takes(event, alive):
            kept.append(event["id"])
            events.append(event)
            known += [event["into"]] if "into" in event else [part["id"] for part in event.get("parts", [])]
    table["event"] = events
    hides = table["sensor"].get("hide", [])
    table["sensor"]["hide"] = [hide for hide in hides if hide.get("group") in [*known, None]]


def _begins_after(time: Any, end: float) -> bool:
    return isinstance(time, int | float) and time >= end


def _names(group: Table) -> list[str]:
    return [group["id"]] if group["repeat"] == 1 else [f"{group['id']}-{k + 1}" for k in range(group["repeat"])]


def _takes(event: Table, alive: list[str]) -> bool:
    """Returns True if an order has groups; leaves out those that are gone, and changes the list of existing groups."""
    if event["type"] == "split":
        if event["group"] not in alive:
            return False
        alive.remove(event["group"])
        alive += [part["id"] for part in event["parts"]]
        return True
    event["groups"] = [pattern for pattern in event["groups"] if set(expand(pattern, alive)) & {*alive}]
    if event["type"] == "queue":
        return bool(event["groups"])
    if len(event["groups"]) < 2:
        return False
    for name in event["groups"]:
        alive.remove(name)
    alive.append(event["into"])
    return True


def seconds(scenario: Scenario) -> list[Piece]:
    """Returns the seconds that can be taken from the end."""
    return [Piece(("duration",), lambda now: round(now - 1.0, 6))] * (math.ceil(scenario.duration) - 1)


def beginning(scenario: Scenario) -> list[Piece]:
    """Returns the seconds that can be taken from the start, none where groups are drawn."""
    fixed = all(g.speed is not None and g.repeat == 1 and _numbers(g.enter, *g.start, *g.goal) for g in scenario.group)
    return [Piece((), _second_later)] * (math.ceil(scenario.duration) - 1) if fixed else []


def _numbers(*values: Any) -> bool:
    return all(isinstance(value, int | float) for value in values)


def _second_later(table: Table) -> Table:
    """Returns a scene that begins a second later."""

    def earlier(time: Any) -> Any:
        return max(round(time - 1.0, DECIMALS), 0.0) if _numbers(time) else time

    table["duration"] = round(table["duration"] - 1.0, 6)
    for group in table["group"]:
        if group["enter"] <= 0:
            _walk(group)
        group["enter"] = min(group["enter"], earlier(group["enter"]))
        for stop in group.get("stops", []):
            stop["until"] = [earlier(time) for time in stop["until"]]
    for event in table.get("event", []):
        event["when"] |= {key: earlier(event["when"][key]) for key in event["when"].keys() & {"time"}}
    for hide in table["sensor"].get("hide", []):
        hide |= {key: earlier(hide[key]) for key in ("start", "end")}
    for switch in table["light"]["switch"]:
        switch["at"] = earlier(switch["at"])
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
    """Returns the orders, the last one first, and the groups."""
    orders = [_gone("event", k) for k in reversed(range(len(scenario.event)))]
    return orders + [_gone("group", k) for k in range(len(scenario.group))]


def obstacles(scenario: Scenario) -> list[Piece]:
    """Returns all immobile things."""
    return [_gone("world", key, k) for key in OBSTACLES for k in range(len(getattr(scenario.world, key)))]


def difficulties(scenario: Scenario) -> list[Piece]:
    """Returns the keys that do not have their easiest value, or their default if no other value is easier."""
    pieces = [_gone(key) for key in LAYOUT if getattr(scenario, key) != Scenario.model_fields[key].default]
    for name in EASED:
        part = getattr(scenario, name)
        easy = type(part).model_validate(EASIEST.get(name, {}))
        for key in _keys(name, part):
            if getattr(part, key) != getattr(easy, key):
                pieces.append(_set(EASIEST[name][key], name, key) if key in EASIEST.get(name, {}) else _gone(name, key))
    return pieces


def defaults(scenario: Scenario) -> list[Piece]:
    """Returns the keys with an easiest value that have neither this one nor their default."""
    pieces = []
    for name in EASIEST:
        part = getattr(scenario, name)
        easy, usual = type(part).model_validate(EASIEST[name]), type(part)()
        others = (k for k in EASIEST[name] if getattr(part, k) not in (getattr(easy, k), getattr(usual, k)))
        pieces += [_gone(name, key) for key in others]
    return pieces


def _keys(name: str, part: Any) -> list[str]:
    return [key for key in type(part).model_fields if name != "camera" or key not in SIZES]


def people(scenario: Scenario) -> list[Piece]:
    """Returns the people after the first of each group, and its copies after the first."""
    pieces = []
    for k, group in enumerate(scenario.group):
        drawn, least = isinstance(group.size, Distribution), _least(group.size)
        pieces += [Piece(("group", k, "size"), partial(_fewer, least))] * (least - 1 + drawn)
        pieces += [Piece(("group", k, "repeat"), lambda now: now - 1)] * (group.repeat - 1)
    return pieces


def _least(size: Value) -> int:
    low = bounds(size)[0]
    return max(1, round(low)) if math.isfinite(low) else 1


def _fewer(least: int, size: Any) -> int:
    return round(size) - 1 if _numbers(size) else least


def details(scenario: Scenario) -> list[Piece]:
    """Returns the parts of which a group, an order and the sensor can do without some."""
    pieces = [_gone("sensor", "hide", k) for k in range(len(scenario.sensor.hide))]
    pieces += [_gone("light", "switch", k) for k in range(len(scenario.light.switch))]
    for k, group in enumerate(scenario.group):
        pieces += [_gone("group", k, key, n) for key in ("stops", "via") for n in range(len(getattr(group, key)))]
    for k, event in enumerate(scenario.event):
        sized = (n for n, part in enumerate(getattr(event, "parts", ())) if part.size is not None)
        pieces += [_gone("event", k, "parts", n, "size") for n in sized]  # before the part itself
        for key in ("parts", "via", "groups"):
            pieces += [_gone("event", k, key, n) for n in range(len(getattr(event, key, ())))]
    return pieces


STAGES: tuple[Stage, ...] = (script, seconds, beginning, obstacles, difficulties, defaults, people, details)


def _gone(*path: str | int) -> Piece:
    return _set(GONE, *path)


def _set(value: Any, *path: str | int) -> Piece:
    return Piece(path, lambda now: value)


def pinned(scenario: Scenario, seed: int, repeat: int = 0) -> Scenario | None:
    """Returns the scenario with the groups that a seed draws, each with fixed size, places, speed and times.

    A group that is taken out of it leaves all others where they are; of a drawn one, the random numbers depend on its
    place in the list. None if the groups cannot be drawn.
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
            "id": group.name, "size": len(group.members), "start": place(group.start), "goal": place(group.goal),
            "via": [place(point) for point in group.via], "speed": round(group.speed, DECIMALS),
            "enter": round(group.enter, DECIMALS), "at_goal": group.finish, "scatter": scatter[group.name],
            "stops": [
                {
                    "at": place(stop.at), "stay": round(stop.stay, DECIMALS), "until": list(stop.until),
                    **({} if stop.whole else {"members": len(stop.members)}),
                } for stop in group.stops
            ],
        } for group in drawn
    ]  # fmt: skip
    return _valid(table)
