"""Checks the Tracks that a tracker's `step` returns: types, shapes, ids, groups, events; the first fault in words.

`check_tracks` is the entry. The private functions each check one part and yield its faults.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np

from scenarios.errors import WorkError
from scenarios.limits import COORDINATE, FRAMES, INTEGER, is_whole
from sim.types import EVENT_KINDS, GroupEvent, Groups, Tracks

Fault = tuple[str, str]  # What the tracker returned, and what was expected instead.


@dataclass
class ReportHistory:
    """What a tracker has reported in a sequence so far."""

    plane_and_unit: tuple[str, str] | None = None  # of its first tracks
    own_events: tuple[str, ...] = ()  # of its first tracks
    ids: set[int] = field(default_factory=set)  # all track ids, of people or of groups

    def clear(self) -> None:
        """Forgets everything, in place, for the start of another sequence."""
        self.plane_and_unit, self.own_events = None, ()
        self.ids.clear()


def check_tracks(tracks: Any, index: int, tracker: str, sequence: str, history: ReportHistory | None = None) -> Tracks:
    """Returns a copy of the tracks of frame `index`, checked, with optional fields filled in.

    tracker, sequence: their names, for messages. history: what it reported in earlier frames, which is updated; None
    means nothing. Raises WorkError, with the first fault, if the tracks are wrong.
    """
    if isinstance(tracks, Tracks):
        tracks = _filled(tracks)
    fault = next(filter(None, _faults(tracks, index, ReportHistory() if history is None else history)), None)
    if fault:
        got, expected = fault
        remedy = "correct the tracker's step()"
        raise WorkError(file=tracker, place=f"{sequence}, frame {index}", got=got, expected=expected, remedy=remedy)
    return tracks.copy()  # type: ignore[no-any-return]


def _filled(tracks: Tracks) -> Tracks:
    if not np.size(tracks.score) and np.ndim(tracks.id) == 1:
        tracks = tracks.replace(score=np.ones(len(tracks.id)))
    if not np.size(tracks.seen) and np.ndim(tracks.id) == 1:
        tracks = tracks.replace(seen=tracks.measured)
    if isinstance(tracks.events, tuple) and tracks.events:
        tracks = tracks.replace(events=tuple(_with_frames(e, tracks.index) for e in tracks.events))
    return tracks


def _with_frames(event: Any, index: int) -> Any:
    if not isinstance(event, GroupEvent) or (event.emitted is not None and event.end is not None):
        return event
    emitted = index if event.emitted is None else event.emitted
    return replace(event, emitted=emitted, end=index if event.end is None else event.end)


def _faults(tracks: Any, index: int, history: ReportHistory) -> Iterator[Any]:
    """Yields of each check a false value or its fault; a check may rely on those before it."""
    yield not isinstance(tracks, Tracks) and (type(tracks).__name__, "sim.types.Tracks")
    yield tracks.index != index and (f"index {tracks.index}", f"index {index}")
    kind, known = f"plane {tracks.plane!r}, unit {tracks.unit!r}", tracks.plane in ("ground", "space", "image")
    expected = "plane ground, space or image; unit person or group"
    yield not (known and tracks.unit in ("person", "group")) and (kind, expected)
    if history.plane_and_unit is None:
        history.plane_and_unit, history.own_events = (tracks.plane, tracks.unit), tracks.own_events
    first, own = history.plane_and_unit, history.own_events
    yield (tracks.plane, tracks.unit) != first and (kind, f"plane {first[0]!r}, unit {first[1]!r} as before")
    kinds = f"a tuple of kinds of events ({', '.join(EVENT_KINDS)}), always the same"
    good = tracks.own_events == own and isinstance(own, tuple) and set(own) <= set(EVENT_KINDS)
    yield not good and (f"own_events {tracks.own_events!r}", kinds)
    n, d = np.size(tracks.id), 3 if tracks.plane == "space" else 2
    # Boxes before positions, which `Tracks.of_boxes` takes from them.
    rows = {"id": ("i", n)} | ({} if tracks.box is None else {"box": ("f", n, 4)}) | {"pos": ("f", n, d)}
    rows |= {"group": ("i", n), "seen": ("b", n), "score": ("f", n)}
    yield from _array_faults(tracks, "", rows | {"vel": ("f", n, d), "cov": ("f", n, 2 * d, 2 * d)}, ("vel",))
    same = tracks.unit != "group" or np.array_equal(tracks.id, tracks.group)
    yield not same and ("group that is not id", "group equal to id where the unit is group")
    yield bool((tracks.group < -1).any()) and (f"group {tracks.group.min()}", "non-negative groups, -1 alone")
    yield _id_fault(tracks.id, "id")
    history.ids.update(tracks.id.tolist())
    people = history.ids if tracks.unit == "person" else frozenset[int]()
    if tracks.groups is not None:
        yield from _group_faults(tracks.groups, d, people)
    blind = tracks.unit == "group" and n and not (tracks.groups and tracks.groups.hull)
    yield blind and ("rows of unit 'group' without hulls", "groups: sim.types.Groups with a hull for each group")
    good = isinstance(tracks.events, tuple) and all(isinstance(e, GroupEvent) for e in tracks.events)
    yield not good and (f"events {tracks.events!r}", "a tuple of sim.types.GroupEvent")
    for event in tracks.events:
        yield from _event_faults(event, index, people)
        yield own and event.kind not in own and (f"an event of kind {event.kind!r}", f"one of own_events, {own}")


NUMBERS = {"i": "whole numbers", "f": "floats", "b": "bool"}  # By kind of dtype.


def _array_faults(
    owner: Any, prefix: str, arrays: Mapping[str, tuple[Any, ...]], unknown: tuple[str, ...] = ()
) -> Iterator[Any]:
    """Yields the faults of array fields; arrays: by name kind of dtype and shape; unknown: names of those that may be
    nan."""
    for name, (kind, *shape) in arrays.items():
        a = getattr(owner, name)
        good = type(a) in ARRAYS and a.dtype.kind == kind and a.shape == (*shape,)
        got = a.dtype if type(a) in ARRAYS else type(a).__name__
        yield not good and (f"{prefix}{name} of shape {np.shape(a)}, {got}", f"{(*shape,)}, {NUMBERS[kind]}")
        if kind != "f" or _small(a):
            continue
        yield name not in unknown and not finite(a) and (f"NaN or infinity in {prefix}{name}", "finite numbers")
        yield name != "cov" and not _in_bounds(a) and (f"{_greatest(a)} in {prefix}{name}", BOUNDS)


ARRAYS = (np.ndarray, np.memmap)  # Of other classes, such as np.matrix, operators mean something else.
BOUNDS = f"numbers from {-COORDINATE:g} to {COORDINATE:g}"  # as files have them


def finite(a: Any) -> bool:
    """Returns True if all numbers of the array are finite; True for an empty array."""
    # The sum of squares is cheap and finite for ordinary numbers; only if it overflows is each number looked at.
    return isfinite(np.vdot(a, a)) or bool(np.isfinite(a).all())


def _small(a: Any) -> bool:
    # So are ordinary numbers, and then neither NaN, nor infinite, nor out of bounds.
    return bool(np.vdot(a, a) <= COORDINATE**2)


def _in_bounds(a: Any) -> bool:
    return not bool((np.abs(a) > COORDINATE).any())


def _greatest(a: Any) -> str:
    return f"{a.flat[np.nanargmax(np.abs(a))]:g}"


def _id_fault(id: Any, name: str) -> Fault | None:
    if len(id) and id.min() < 0:
        return f"{name} {id.min()}", f"non-negative {name}s"
    return (f"the same {name} twice", f"unique {name}s in a frame") if len(set(id.tolist())) != len(id) else None


def _group_faults(groups: Any, d: int, people: Iterable[int]) -> Iterator[Any]:
    yield not isinstance(groups, Groups) and (f"groups of type {type(groups).__name__}", "sim.types.Groups or None")
    n = np.size(groups.id)
    arrays = {"id": ("i", n), "pos": ("f", n, d), "vel": ("f", n, d), "extent": ("f", n, 2, 2), "size": ("f", n)}
    # without groups any number of columns passes: Groups.none() has 2
    yield from _array_faults(groups, "groups.", arrays if n else {"id": ("i", 0)}, ("vel", "extent", "size"))
    yield _id_fault(groups.id, "group id")
    yield bool((groups.size < 0).any()) and (f"groups.size {groups.size.min()}", "sizes from 0, or nan for unknown")
    for name in ("members", "hull"):
        items = getattr(groups, name)
        good = isinstance(items, tuple) and len(items) in (0, n) and all(type(a) in ARRAYS for a in items)
        got = len(items) if isinstance(items, tuple) else type(items).__name__
        yield not good and (f"{got} groups.{name}", f"a tuple of {n} arrays, or an empty one")
    for ids in groups.members:
        good = ids.ndim == 1 and (not len(ids) or ids.dtype.kind == "i")
        yield not good and ("groups.members that are no ids", "(k,) whole numbers")
        yield _member_fault(ids.tolist(), people, "groups.members")
    for hull in groups.hull:
        good = hull.ndim == 2 and hull.shape[1] == 2 and hull.dtype.kind in "if" and finite(hull)
        yield not good and (f"groups.hull of shape {hull.shape}, or NaN in it", "(V, 2) finite numbers each")
        yield not _in_bounds(hull) and (f"{_greatest(hull)} in groups.hull", BOUNDS)


def _member_fault(members: Iterable[Any], people: Iterable[int], name: str) -> Fault | None:
    strange = [m for m in members if not (is_whole(m) and m in people)]
    return (f"{strange[0]!r} in {name}", "ids that the tracker has reported") if strange else None


def _event_faults(event: GroupEvent, index: int, people: Iterable[int]) -> Iterator[Any]:
    kind, start = event.kind, event.start
    yield kind not in EVENT_KINDS and (f"an event of kind {kind!r}", "one of " + ", ".join(EVENT_KINDS))
    checks = {
        "start": (is_whole(start) and 1 <= start <= index, f"a whole number from 1 to {index}"),
        "end": (
            is_whole(event.end) and is_whole(start) and start <= event.end <= FRAMES,
            f"a whole number from {start} to {FRAMES}",
        ),
        "emitted": (is_whole(event.emitted) and event.emitted == index, f"{index}, the present frame, or None"),
        "before": (_are_groups(event.before), "a tuple of group ids, -1 for a person alone"),
        "after": (_are_groups(event.after), "a tuple of group ids, -1 for a person alone"),
        "members": (isinstance(event.members, tuple), "a tuple of ids"),
        "pos": (np.shape(event.pos) == (2,) and all(map(_coordinate, event.pos)), f"x, y: {BOUNDS}, or nan"),
    }
    for name, (good, expected) in checks.items():
        yield not good and (f"{kind}: {name} {getattr(event, name)!r}", expected)
    yield _member_fault(event.members, people, f"the members of a {kind}")


def _are_groups(ids: Any) -> bool:
    return isinstance(ids, tuple) and all(is_whole(g) and -1 <= g <= INTEGER for g in ids)


def _coordinate(value: Any) -> bool:
    number = isinstance(value, float | int | np.floating | np.integer) and not isinstance(value, bool)
    return number and not abs(value) > COORDINATE
