"""Checks a scenario before it is simulated: doors, sizes, times, hidden groups, places inside the world and clear of
walls.

`check` also runs the checks of the script (scenarios.loading.script_check).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from scenarios.errors import InputError
from scenarios.loading.script_check import QUEUE_PEOPLE, check_script, fail
from scenarios.loading.toml_files import did_you_mean
from scenarios.loading.value_check import check_values
from scenarios.schema.geometry import clearance, door_fits, queue_places
from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, SplitOrder, group_names
from scenarios.schema.values import Point, bounds, fixed

BODY = 0.2  # m: least distance from a person's middle to a wall or pillar (the radius of a body in the physics)


def check(scenario: Scenario, file: str | Path = "") -> None:
    """Raises InputError, naming `file`, for the first thing in the scenario that cannot work."""
    try:
        _check_world(scenario)
        _check_groups(scenario)
        check_values(scenario)
        _check_sensor(scenario)
        _check_points(scenario)
        check_script(scenario)
    except InputError as error:
        raise InputError(**{**error.as_dict(), "file": str(file)}) from None


def _check_world(scenario: Scenario) -> None:
    world = scenario.world
    for k, wall in enumerate(world.walls):
        if wall[:2] == wall[2:]:
            fail(f"world.walls.{k}", "a wall of no length", "two different ends", "move one end")
    for k, door in enumerate(world.doors):
        if not any(door_fits(door, wall) for wall in world.walls):
            got = f"a door {door.width:g} m wide at {list(door.at)}, which lies on no wall"
            fail(
                f"world.doors.{k}", got, "an opening that lies on one wall", "move it onto a wall, or make it narrower"
            )
    for k, stairs in enumerate(world.stairs):
        if stairs.foot == stairs.head:
            fail(f"world.stairs.{k}", "foot and head at one place", "two different places", "move one of them")


def _check_groups(scenario: Scenario) -> None:
    seen: set[str] = set()
    for group in scenario.group:
        for name in group_names(group):
            if name in seen:
                fail(f"group.{group.id}", f"a second group named {name!r}", "unique ids", "rename one")
            seen.add(name)
        low = bounds(group.size)[0]
        if low < 0.5:
            got = f"a size that can be {'any number' if math.isinf(low) else f'{low:g}'}"
            fail(f"group.{group.id}.size", got, "at least 1 person", "raise it, or add clip = [1, 6]")
        earliest = bounds(group.enter)[0]
        got = f"{earliest:g} s at the earliest"
        if earliest >= scenario.duration:
            fail(f"group.{group.id}.enter", got, f"before the end, {scenario.duration:g} s", "enter earlier")
        if math.isfinite(earliest) and earliest < -scenario.warmup:
            expected = f"not before the warm-up, {-scenario.warmup:g} s"
            fail(f"group.{group.id}.enter", got, expected, "enter later, or make `warmup` longer")


def _check_sensor(scenario: Scenario) -> None:
    known = [name for group in scenario.group for name in group_names(group)] + [
        name
        for event in scenario.event
        for name in ((event.into,) if isinstance(event, MergeOrder) else ())
        + (tuple(part.id for part in event.parts) if isinstance(event, SplitOrder) else ())
    ]
    for k, hide in enumerate(scenario.sensor.hide):
        if hide.group is not None and hide.group not in known:
            fail(f"sensor.hide.{k}.group", repr(hide.group), "a group of the script", did_you_mean(hide.group, known))
        if hide.end <= hide.start:
            fail(f"sensor.hide.{k}", f"{hide.start:g} to {hide.end:g} s", "an end after its start", "swap them")


def _check_points(scenario: Scenario) -> None:
    # A script that may be turned is anywhere; only a simulation tells whether it fits.
    if bounds(scenario.turn_deg) != (0.0, 0.0):
        return
    width, depth = scenario.world.size
    for place, point in points(scenario):
        for axis, value, size in zip("xy", point, (width, depth), strict=True):
            low, high = bounds(value)
            if (math.isfinite(low) and low < 0) or (math.isfinite(high) and high > size):
                got = f"{axis} = {low:g}" if low == high else f"{axis} from {low:g} to {high:g}"
                fail(place, got, f"inside the world, {axis} from 0 to {size:g} m", "move it, or enlarge world.size")
        at = fixed(point)
        for x, y in [] if at is None else [at, (width - at[0], at[1])][: 1 + scenario.mirror]:
            gap, what = clearance((x, y), scenario.world)
            if gap < BODY:
                got = f"[{x:.4g}, {y:.4g}], {max(gap, 0):.2f} m from {what}"
                fail(place, got, f"{BODY} m of room for a body", "move it away")


def points(scenario: Scenario) -> Iterator[tuple[str, Point]]:
    """Yields (key, point in m) for every place where people start, pass, are sent, or trigger an order."""
    for group in scenario.group:
        yield f"group.{group.id}.start", group.start
        yield f"group.{group.id}.goal", group.goal
        yield from ((f"group.{group.id}.stops.{k}.at", stop.at) for k, stop in enumerate(group.stops))
        yield from ((f"group.{group.id}.via.{k}", point) for k, point in enumerate(group.via))
    for event in scenario.event:
        key = f"event.{event.id}"
        if event.when.reach is not None and event.when.reach.at is not None:
            yield f"{key}.when.reach.at", event.when.reach.at
        if isinstance(event, SplitOrder):
            for part in event.parts:
                yield f"{key}.parts.{part.id}.goal", part.goal
                yield from ((f"{key}.parts.{part.id}.via.{k}", point) for k, point in enumerate(part.via))
            continue
        if isinstance(event, QueueOrder):
            yield from ((f"{key}.at", slot) for slot in queue_places(event, QUEUE_PEOPLE))
        else:
            yield from ((f"{key}.via.{k}", point) for k, point in enumerate(event.via))
        if event.goal is not None and not isinstance(event.goal, str):
            yield f"{key}.goal", event.goal
