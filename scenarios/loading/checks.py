"""Checks a scenario before it is simulated: its size, places inside the world and clear of walls, and the script.

The ranges of single values stand in scenarios.schema. Each order of the script must concern groups that exist at that
point of it, in sizes that fit, within the duration. The first thing that cannot work raises InputError.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count, pairwise
from pathlib import Path
from typing import NoReturn

from scenarios.errors import InputError, counted
from scenarios.limits import CELLS, FRAMES, PEOPLE
from scenarios.loading.toml_files import did_you_mean
from scenarios.schema.geometry import clearance, door_fits, queue_places
from scenarios.schema.groups import GroupSpec, group_names, part_names, parts_of
from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, ScriptOrder, SplitOrder, SplitPart, expand
from scenarios.schema.values import SURE, Distribution, Point, Value, bounds, fixed, share_within

BODY = 0.2  # m: least distance from a person's middle to a wall or pillar (the radius of a body in the physics)


def check(scenario: Scenario, file: str | Path = "") -> None:
    """Raises InputError, naming `file`, for the first thing in the scenario that cannot work."""
    try:
        for part in (_check_world, _check_groups, _check_amounts, _check_points, _check_script):
            part(scenario)
    except InputError as error:
        raise error.replaced(file=file) from None


def _check_amounts(scenario: Scenario) -> None:
    frames, people = scenario.duration * scenario.camera.fps, most_people(scenario)
    if frames > FRAMES:
        fail("duration", f"{frames:,.0f} frames", f"at most {FRAMES:,}", "shorten it, or lower camera.fps")
    if people > PEOPLE:
        fail("group", f"up to {people:,.0f} people", f"at most {PEOPLE:,}", "make groups smaller or fewer")
    if people * frames > CELLS:
        got = f"{frames:,.0f} frames with up to {people:,.0f} people"
        fail("duration", got, f"at most {CELLS:,} frames times people", "shorten it, or take fewer people")


def most_people(scenario: Scenario) -> float:
    """Returns how many people there can be, by sizes (powers of 2) that 999 of 1000 draws do not exceed."""
    return sum(group.repeat * sum(_most(part.size) for part in parts_of(group)) for group in scenario.group)


def _most(size: Value) -> float:
    if not isinstance(size, Distribution):
        return max(1.0, float(round(size)))
    return next(2.0**k for k in count() if share_within(size, -math.inf, 2.0**k) >= SURE)


def _check_world(scenario: Scenario) -> None:
    world = scenario.world
    for k, wall in enumerate(world.walls):
        if wall[:2] == wall[2:]:
            fail(f"world.walls.{k}", "a wall of no length", "two different ends", "move one end")
    for k, door in enumerate(world.doors):
        if not any(door_fits(door, wall) for wall in world.walls):
            got = f"a door {door.width:g} m wide at {list(door.at)}, which lies on no wall"
            remedy = "move it onto a wall, or make it narrower"
            fail(f"world.doors.{k}", got, "an opening that lies on one wall", remedy)
        times = [t for span in door.open or () for t in span]
        if any(a >= b for a, b in pairwise(times)):
            got, expected = f"{[list(span) for span in door.open or ()]}", "times that ascend: [[from, to], …]"
            fail(f"world.doors.{k}.open", got, expected, "sort them, and join what overlaps")
    for k, stairs in enumerate(world.stairs):
        if stairs.foot == stairs.head:
            fail(f"world.stairs.{k}", "foot and head at one place", "two different places", "move one of them")
    for k, box in enumerate(world.boxes or ()):
        tilt = math.radians(box.tilt_deg)
        top = box.at[2] + (abs(math.sin(tilt)) * box.size[1] + math.cos(tilt) * box.size[2]) / 2
        if top <= 0:
            got = f"a box whose top is {-top:g} m below the ground"
            fail(f"world.boxes.{k}.at.2", got, "a part of it above the ground", "raise its middle")


def _check_groups(scenario: Scenario) -> None:
    seen: set[str] = set()
    for group in scenario.group:
        for name in _all_names(group):
            if name in seen:
                fail(f"group.{group.id}", f"a second group named {name!r}", "unique ids", "rename one")
            seen.add(name)
        earliest = bounds(group.enter)[0]
        got = f"{earliest:g} s at the earliest"
        if earliest >= scenario.duration:
            fail(f"group.{group.id}.enter", got, f"before the end, {scenario.duration:g} s", "enter earlier")
        if math.isfinite(earliest) and earliest < -scenario.warmup:
            expected = f"not before the warm-up, {-scenario.warmup:g} s"
            fail(f"group.{group.id}.enter", got, expected, "enter later, or make `warmup` longer")


def _all_names(group: GroupSpec) -> list[str]:
    return [n for name in group_names(group) for n in (name, *(f"{name}.{part}" for part in part_names(group)))]


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
    """Yields (key, point in m) of each start, stop, via, goal, `reach` trigger and of the first places in queues."""
    for group in scenario.group:
        yield f"group.{group.id}.start", group.start
        yield from ((f"group.{group.id}.stops.{k}.at", stop.at) for k, stop in enumerate(group.stops))
        yield from _way(f"group.{group.id}", group)
    for event in scenario.event:
        key = f"event.{event.id}"
        if event.when.reach is not None and event.when.reach.at is not None:
            yield f"{key}.when.reach.at", event.when.reach.at
        if isinstance(event, SplitOrder):
            for part in event.parts:
                yield from _way(f"{key}.parts.{part.id}", part)
            continue
        if isinstance(event, QueueOrder):
            yield from ((f"{key}.at", slot) for slot in queue_places(event, QUEUE_PEOPLE))
            yield from ((f"{key}.counters.{k}", point) for k, point in enumerate(event.counters or ()))
        yield from _way(key, event)


def _way(key: str, row: GroupSpec | SplitPart | MergeOrder | QueueOrder) -> Iterator[tuple[str, Point]]:
    if row.goal is not None and not isinstance(row.goal, str):
        yield f"{key}.goal", row.goal
    if not isinstance(row, QueueOrder):
        yield from ((f"{key}.via.{k}", point) for k, point in enumerate(row.via))


Sizes = dict[str, tuple[float, float]]  # least and greatest number of people of each existing group
COUNTER_GAP = 0.8  # m, at least, between counters, and between a counter and the head of a queue
QUEUE_PEOPLE = 3  # least number of people in a queue; sim.truth.queue_detection has the same number


def fail(place: str, got: str, expected: str, remedy: str) -> NoReturn:
    """Raises, in every case, an InputError with these parts; `check` adds the file."""
    raise InputError(place=place, got=got, expected=expected, remedy=remedy)


def _check_script(scenario: Scenario) -> None:
    # Each merge and split ends its groups and makes new ones, whose possible sizes follow.
    alive: Sizes = {}
    for group in scenario.group:
        alive.update(dict.fromkeys(group_names(group), group.size_bounds()))
    gone: dict[str, str] = {}
    orders: list[str] = []
    for event in scenario.event:
        key = f"event.{event.id}"
        if event.id in orders:
            fail(key, f"a second order named {event.id!r}", "unique ids", "rename one")
        _check_when(event, key, orders, alive, gone, scenario.duration)
        if isinstance(event, MergeOrder):
            _merge(event, key, alive, gone)
        elif isinstance(event, SplitOrder):
            _split(event, key, alive, gone)
        else:
            _queue(event, key, alive, gone)
        orders.append(event.id)
    for k, hide in enumerate(scenario.sensor.hide):
        if hide.group is not None:
            parts = [name for group in scenario.group for name in _all_names(group)]
            _named(hide.group, f"sensor.hide.{k}.group", [*alive, *gone, *parts], "a group of the script")
        if hide.end <= hide.start:
            fail(f"sensor.hide.{k}", f"{hide.start:g} to {hide.end:g} s", "an end after its start", "swap them")


def _named(name: str, place: str, known: list[str], expected: str) -> None:
    if name not in known:
        fail(place, repr(name), expected, did_you_mean(name, known))


def _check_when(
    event: ScriptOrder, key: str, orders: list[str], alive: Sizes, gone: dict[str, str], duration: float
) -> None:
    when = event.when
    if when.after is not None:
        _named(when.after, f"{key}.when.after", orders, "the id of an order before this one")
    if when.reach is not None:
        _exists(when.reach.group, f"{key}.when.reach.group", alive, gone)
    delay = bounds(when.delay)[0]
    first = delay + (0.0 if when.time is None else bounds(when.time)[0])
    if delay < 0 or first < 0:
        fail(f"{key}.when", f"{min(delay, first):g} s", "a time from 0 on", "raise it, or add a clip")
    if first >= duration:
        fail(f"{key}.when", f"{first:g} s at the earliest", f"before the end, {duration:g} s", "fire it earlier")


def _exists(name: str, place: str, alive: Sizes, gone: dict[str, str]) -> None:
    if name in gone:
        expected = "a group that still exists: " + ", ".join(alive)
        fail(place, f"{name!r}, which ended with {gone[name]!r}", expected, "name another group, or move the order up")
    _named(name, place, list(alive), "a group that exists at this point of the script")


def _add_group(name: str, size: tuple[float, float], place: str, alive: Sizes, gone: dict[str, str]) -> None:
    if name in alive or name in gone:
        fail(place, f"{name!r}, which is another group's name", "a new name", "rename it")
    alive[name] = size


def _merge(event: MergeOrder, key: str, alive: Sizes, gone: dict[str, str]) -> None:
    for k, name in enumerate(event.groups):
        _exists(name, f"{key}.groups.{k}", alive, gone)
        if name in event.groups[:k]:
            fail(f"{key}.groups.{k}", f"{name!r} twice", "different groups", "remove one")
    sizes = [alive.pop(name) for name in event.groups]
    gone.update(dict.fromkeys(event.groups, event.id))
    _add_group(event.into, (sum(low for low, _ in sizes), sum(high for _, high in sizes)), f"{key}.into", alive, gone)


def _split(event: SplitOrder, key: str, alive: Sizes, gone: dict[str, str]) -> None:
    _exists(event.group, f"{key}.group", alive, gone)
    low, high = alive.pop(event.group)
    gone[event.group] = event.id
    given = [part.size for part in event.parts if part.size is not None]
    open_parts = len(event.parts) - len(given)
    has = counted(int(low), "person", "people") if low == high else f"{low:g} to {high:g} people"
    # Sizes must fit every possible size of the group.
    if sum(given) + open_parts > low or (not open_parts and not low == high == sum(given)):
        got = f"parts of {' + '.join(map(str, given + ['1 or more'] * open_parts))}"
        fail(f"{key}.parts", got, f"parts of {event.group!r}, which has {has}", "remove a size, or change one")
    rest = max(high - sum(given) - open_parts + 1, 1)
    for part in event.parts:
        size = (1.0, rest) if part.size is None else (float(part.size), float(part.size))
        _add_group(part.id, size, f"{key}.parts.{part.id}", alive, gone)


def _queue(event: QueueOrder, key: str, alive: Sizes, gone: dict[str, str]) -> None:
    queued: list[str] = []
    for k, pattern in enumerate(event.groups):
        found, place = expand(pattern, list(alive)), f"{key}.groups.{k}"
        if not found:
            fail(place, repr(pattern), "a name or pattern of an existing group", "groups: " + ", ".join(alive))
        for name in found:
            _exists(name, place, alive, gone)
        queued += [name for name in found if name not in queued]
    for k, point in enumerate(event.counters or ()):
        for other in (event.at, *(event.counters or ())[:k]):
            if (gap := math.dist(point, other)) < COUNTER_GAP:
                what = "the head of the queue" if other == event.at else f"the counter {list(other)}"
                got = f"{list(point)}, {gap:.2f} m from {what}"
                fail(f"{key}.counters.{k}", got, f"{COUNTER_GAP} m of room to stand", "move it away")
    people = sum(alive[name][1] for name in queued)
    if people < QUEUE_PEOPLE:
        got = f"{counted(int(people), 'person', 'people')} in {', '.join(queued)}"
        fail(f"{key}.groups", got, f"at least {QUEUE_PEOPLE} in a queue", "queue more groups, or larger ones")
