"""Finds the ways of groups and the places of orders, as far as they are known before the simulation, for drawings.

A distribution is replaced by its mean and the range of its draws. Where groups meet, and where a group divides, is
taken to be half-way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scenarios.schema.geometry import queue_places
from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, ScriptOrder, SplitOrder, expand, group_names
from scenarios.schema.values import Distribution, Point, Value, bounds

XY = tuple[float, float]
SLOTS = 6  # greatest number of places of a queue that are drawn


@dataclass(frozen=True)
class GroupRoute:
    """The way of one entry of `group`, as far as it is known before the simulation."""

    id: str  # of the entry
    points: tuple[XY, ...]  # start, via points, goal: x, y in m; a distribution is replaced by its mean
    spread: tuple[XY, ...]  # half the range of each point in x and y, m; 0 for a fixed coordinate
    people: float  # mean number of people
    repeat: int  # number of such groups


@dataclass(frozen=True)
class Arrow:
    """A way that an order opens."""

    id: str
    points: tuple[XY, ...]


@dataclass(frozen=True)
class OrderMark:
    """An order of the script as drawn on the plan."""

    number: int  # of the order in the file, from 1
    event: ScriptOrder  # the order
    at: XY  # x, y of where it happens, m
    # before, after: names of its groups before and after it; the same for a queue
    before: tuple[str, ...]
    after: tuple[str, ...]
    arrows: tuple[Arrow, ...]  # the ways it opens; empty if groups stay or keep their goals
    slots: tuple[XY, ...] = ()  # x, y of the places of a queue, m; empty for other orders


def middle(value: Value) -> float:
    """Returns the mean of a value, moved into its `clip`."""
    if not isinstance(value, Distribution):
        return float(value)
    if value.normal is not None:
        mean = value.normal[0]
    elif value.uniform is not None:
        mean = (value.uniform[0] + value.uniform[1]) / 2
    elif value.choice is not None:
        mean = sum(value.choice) / len(value.choice)
    else:
        mean = value.exponential if value.exponential is not None else value.poisson or 0.0
    low, high = bounds(value)
    return min(max(mean, low), high)


def spread(value: Value) -> float:
    """Returns half the width of the range in which nearly all draws of a value lie; 0 for a number."""
    if not isinstance(value, Distribution):
        return 0.0
    low, high = bounds(value)
    wide = (high - low) / 2
    if value.normal is not None:
        return min(wide, 2 * value.normal[1])
    return wide if math.isfinite(wide) else 2 * middle(value)


def group_routes(scenario: Scenario) -> list[GroupRoute]:
    """Returns the ways of all entries of `group`, with means for points drawn from a distribution."""
    made = []
    for group in scenario.group:
        points = (group.start, *(stop.at for stop in group.stops), *group.via, group.goal)
        spreads = tuple((spread(x), spread(y)) for x, y in points)
        made.append(GroupRoute(group.id, tuple(map(_at, points)), spreads, middle(group.size), group.repeat))
    return made


def order_marks(scenario: Scenario) -> list[OrderMark]:
    """Returns the orders as drawn on the plan, numbered from 1."""
    places = {}
    for group in scenario.group:
        start, goal = _at(group.start), _at(group.goal)
        places.update(dict.fromkeys(group_names(group), (start, goal)))
    return [_mark(k + 1, event, places, scenario.world.size) for k, event in enumerate(scenario.event)]


def _at(point: Point) -> XY:
    return middle(point[0]), middle(point[1])


def _mean(points: list[XY]) -> XY:
    return sum(x for x, _ in points) / len(points), sum(y for _, y in points) / len(points)


def _mark(number: int, event: ScriptOrder, places: dict[str, tuple[XY, XY]], world: XY) -> OrderMark:
    if isinstance(event, MergeOrder):
        return _merge(number, event, places)
    if isinstance(event, SplitOrder):
        return _split(number, event, places)
    names = tuple(dict.fromkeys(name for pattern in event.groups for name in expand(pattern, list(places))))
    inside = tuple((x, y) for x, y in queue_places(event, SLOTS) if 0 <= x <= world[0] and 0 <= y <= world[1])
    return OrderMark(number, event, event.at, names, names, _served(event, names, places), inside)


def _merge(number: int, event: MergeOrder, places: dict[str, tuple[XY, XY]]) -> OrderMark:
    ways = [places.pop(name) for name in event.groups]
    meeting = _mean([_mean([start, goal]) for start, goal in ways])
    goal = meeting if isinstance(event.goal, str) else _at(event.goal)
    places[event.into] = (meeting, goal)
    arrow = Arrow(event.into, (meeting, *map(_at, event.via), goal))
    return OrderMark(number, event, meeting, event.groups, (event.into,), () if goal == meeting else (arrow,))


def _split(number: int, event: SplitOrder, places: dict[str, tuple[XY, XY]]) -> OrderMark:
    start, goal = places.pop(event.group)
    at = _mean([start, goal])
    arrows = [Arrow(part.id, (at, *map(_at, part.via), _at(part.goal))) for part in event.parts]
    places.update({arrow.id: (at, arrow.points[-1]) for arrow in arrows})
    return OrderMark(number, event, at, (event.group,), tuple(part.id for part in event.parts), tuple(arrows))


def _served(event: QueueOrder, names: tuple[str, ...], places: dict[str, tuple[XY, XY]]) -> tuple[Arrow, ...]:
    if event.goal is None:
        return ()
    goal = _at(event.goal)
    places.update(dict.fromkeys(names, (event.at, goal)))
    return (Arrow("served", (event.at, goal)),)
