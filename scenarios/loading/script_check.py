"""Checks the script of a scenario before it is simulated; the first order that cannot work raises InputError.

Each order must concern groups that exist at that point of the script, in sizes that fit, within the duration.
"""

from __future__ import annotations

from typing import NoReturn

from scenarios.errors import InputError
from scenarios.loading.toml_files import did_you_mean
from scenarios.schema.scenario import MergeOrder, QueueOrder, Scenario, ScriptOrder, SplitOrder, expand, group_names
from scenarios.schema.values import bounds

SizeRange = tuple[float, float]
QUEUE_PEOPLE = 3  # least number of people in a queue; sim.truth.queue_detection has the same number


def fail(place: str, got: str, expected: str, remedy: str) -> NoReturn:
    """Always raises an InputError with these texts; `check` adds the file."""
    raise InputError(place=place, got=got, expected=expected, remedy=remedy)


def check_script(scenario: Scenario) -> None:
    """Raises InputError, without a file, for the first order of the script that cannot work."""
    # Each merge and split ends its groups and makes new ones, whose possible sizes follow.
    alive = {name: _people(bounds(group.size)) for group in scenario.group for name in group_names(group)}
    gone: dict[str, str] = {}
    orders: list[str] = []
    for event in scenario.event:
        key = f"event.{event.id}"
        if event.id in orders:
            fail(key, f"a second order named {event.id!r}", "unique ids", "rename one")
        _check_when(event, key, orders, alive, gone, scenario.duration)
        _apply(event, key, alive, gone)
        orders.append(event.id)


def _people(size: SizeRange) -> SizeRange:
    """Returns the least and greatest number of people for the bounds of a group's `size`."""
    return max(1.0, float(round(size[0]))), size[1]


def _check_when(
    event: ScriptOrder, key: str, orders: list[str], alive: dict[str, SizeRange], gone: dict[str, str], duration: float
) -> None:
    when = event.when
    if when.after is not None and when.after not in orders:
        fail(
            f"{key}.when.after",
            repr(when.after),
            "the id of an order before this one",
            did_you_mean(when.after, orders),
        )
    if when.reach is not None:
        _exists(when.reach.group, f"{key}.when.reach.group", alive, gone)
    delay = bounds(when.delay)[0]
    first = delay + (0.0 if when.time is None else bounds(when.time)[0])
    if delay < 0 or first < 0:
        fail(f"{key}.when", f"{min(delay, first):g} s", "a time from 0 on", "raise it, or add a clip")
    if first >= duration:
        fail(f"{key}.when", f"{first:g} s at the earliest", f"before the end, {duration:g} s", "fire it earlier")


def _exists(name: str, place: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    if name in gone:
        expected = "a group that still exists: " + ", ".join(alive)
        fail(place, f"{name!r}, which ended with {gone[name]!r}", expected, "name another group, or move the order up")
    if name not in alive:
        fail(place, repr(name), "a group that exists at this point of the script", did_you_mean(name, list(alive)))


def _add_group(name: str, size: SizeRange, place: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    if name in alive or name in gone:
        fail(place, f"{name!r}, which is another group's name", "a new name", "rename it")
    alive[name] = size


def _apply(event: ScriptOrder, key: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    if isinstance(event, MergeOrder):
        _merge(event, key, alive, gone)
    elif isinstance(event, SplitOrder):
        _split(event, key, alive, gone)
    else:
        _queue(event, key, alive, gone)


def _merge(event: MergeOrder, key: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    for k, name in enumerate(event.groups):
        _exists(name, f"{key}.groups.{k}", alive, gone)
        if name in event.groups[:k]:
            fail(f"{key}.groups.{k}", f"{name!r} twice", "different groups", "remove one")
    sizes = [alive.pop(name) for name in event.groups]
    gone.update(dict.fromkeys(event.groups, event.id))
    _add_group(event.into, (sum(low for low, _ in sizes), sum(high for _, high in sizes)), f"{key}.into", alive, gone)


def _split(event: SplitOrder, key: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    _exists(event.group, f"{key}.group", alive, gone)
    low, high = alive.pop(event.group)
    gone[event.group] = event.id
    given = [part.size for part in event.parts if part.size is not None]
    open_parts = len(event.parts) - len(given)
    has = f"{low:g} people" if low == high else f"{low:g} to {high:g} people"
    # Sizes must fit every possible size of the group.
    if sum(given) + open_parts > low or (not open_parts and not low == high == sum(given)):
        got = f"parts of {' + '.join(map(str, given + ['1 or more'] * open_parts))}"
        fail(f"{key}.parts", got, f"parts of {event.group!r}, which has {has}", "remove a size, or change one")
    rest = max(high - sum(given) - open_parts + 1, 1)
    for part in event.parts:
        size = (1.0, rest) if part.size is None else (float(part.size), float(part.size))
        _add_group(part.id, size, f"{key}.parts.{part.id}", alive, gone)


def _queue(event: QueueOrder, key: str, alive: dict[str, SizeRange], gone: dict[str, str]) -> None:
    queued: list[str] = []
    for k, pattern in enumerate(event.groups):
        found = expand(pattern, list(alive))
        if not found:
            fail(
                f"{key}.groups.{k}",
                repr(pattern),
                "a name or pattern of an existing group",
                "groups: " + ", ".join(alive),
            )
        for name in found:
            _exists(name, f"{key}.groups.{k}", alive, gone)
        queued += [name for name in found if name not in queued]
    people = sum(alive[name][1] for name in queued)
    if people < QUEUE_PEOPLE:
        got = f"{people:g} people in {', '.join(queued)}"
        fail(f"{key}.groups", got, f"at least {QUEUE_PEOPLE} in a queue", "queue more groups, or larger ones")
