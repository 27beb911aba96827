"""Checks the Tracks that a tracker's `step` returns: types, shapes, ids, groups, events; the first fault in words.

`check_tracks` is the entry. The private functions each check one part and yield its faults.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any

import numpy as np

from scenarios.errors import WorkError
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


def check_tracks(tracks: Any, index: int, tracker: str, history: ReportHistory | None = None) -> Tracks:
    """Returns a copy of the tracks of frame `index` with optional fields filled in."""
    if isinstance(tracks, Tracks):
        tracks = _filled(tracks)
    fault = next(filter(None, _faults(tracks, index, ReportHistory() if history is None else history)), None)
    if fault:
        got, expected = fault
        remedy = "correct the tracker's step()"
        raise WorkError(file=tracker, place=f"frame {index}", got=got, expected=expected, remedy=remedy)
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
    yield from _row_faults(tracks)
    history.ids.update(tracks.id.tolist())
    people = history.ids if tracks.unit == "person" else frozenset[int]()
    if tracks.groups is not None:
        yield from _group_faults(tracks.groups, tracks.pos.shape[1], people)
    yield not isinstance(tracks.events, tuple) and (
        f"events of type {type(tracks.events).__name__}", "a tuple of sim.types.GroupEvent"
    )  # fmt: skip
    for event in tracks.events:
        yield from _event_faults(event, index, people)
    other = next((e.kind for e in tracks.events if own and e.kind not in own), None)
    yield other and (f"an event of kind {other!r}", f"one of own_events, {', '.join(own)}")


def _row_faults(tracks: Tracks) -> Iterator[Any]:
    yield np.ndim(tracks.id) != 1 and (f"id of shape {np.shape(tracks.id)}", "(N,)")
    n, d = len(tracks.id), 3 if tracks.plane == "space" else 2
    shapes = {"group": (n,), "pos": (n, d), "vel": (n, d), "cov": (n, 2 * d, 2 * d), "score": (n,)}
    for name, shape in (shapes if tracks.box is None else {**shapes, "box": (n, 4)}).items():
        a = getattr(tracks, name)
        number = isinstance(a, np.ndarray) and a.dtype.kind in "iuf"
        yield not number and (f"{name} of type {getattr(a, 'dtype', type(a).__name__)}", "an array of numbers")
        yield a.shape != shape and (f"{name} of shape {a.shape}", str(shape))
        words = "finite numbers" + (", or nan for unknown" if name == "vel" else "")
        yield not finite(a) and (name != "vel" or np.isinf(a).any()) and (f"NaN or infinity in {name}", words)
    types = [getattr(a, "dtype", type(a).__name__) for a in (tracks.id, tracks.group)]
    whole = isinstance(tracks.id, np.ndarray) and all(kind == np.int64 for kind in types)
    yield not whole and (f"ids of type {types[0]}, groups of type {types[1]}", "int64")
    seen = tracks.seen
    flags = isinstance(seen, np.ndarray) and seen.dtype == bool and seen.shape == (n,)
    kind = f"shape {seen.shape}, {seen.dtype}" if isinstance(seen, np.ndarray) else f"type {type(seen).__name__}"
    yield not flags and (f"seen of {kind}", f"({n},), bool")
    same = tracks.unit != "group" or np.array_equal(tracks.id, tracks.group)
    yield not same and ("group that is not id", "group equal to id where the unit is group")
    least = int(tracks.group.min(initial=0))
    yield least < -1 and (f"group {least}", "non-negative groups, -1 alone")
    yield from _id_faults(tracks.id, "id")


def finite(a: Any) -> bool:
    """Returns True if all numbers of the array are finite; True for an empty array."""
    # The sum of squares is cheap and finite for ordinary numbers; only if it overflows is each number looked at.
    return isfinite(np.vdot(a, a)) or bool(np.isfinite(a).all())


def _id_faults(id: Any, name: str) -> Iterator[Any]:
    yield len(id) and id.min() < 0 and (f"{name} {id.min()}", f"non-negative {name}s")
    yield len(set(id.tolist())) != len(id) and (f"the same {name} twice", f"unique {name}s in a frame")


def _group_faults(groups: Any, d: int, people: Iterable[int]) -> Iterator[Any]:
    yield not isinstance(groups, Groups) and (f"groups of type {type(groups).__name__}", "sim.types.Groups or None")
    good = isinstance(groups.id, np.ndarray) and groups.id.ndim == 1 and groups.id.dtype == np.int64
    yield not good and (
        f"groups.id of type {getattr(groups.id, 'dtype', type(groups.id).__name__)}", "(G,) int64"
    )  # fmt: skip
    n = len(groups.id)
    for name, shape in (("pos", (n, d)), ("vel", (n, d)), ("extent", (n, 2, 2)), ("size", (n,))):
        a = getattr(groups, name)  # without groups any number of columns passes: Groups.none() has 2
        good = isinstance(a, np.ndarray) and (a.shape == shape if n else a.shape[:1] == (0,))
        yield not good and (f"groups.{name} of shape {np.shape(a)}", str(shape))
        yield name == "pos" and not finite(a) and ("NaN or infinity in groups.pos", "finite numbers")
    yield from _id_faults(groups.id, "group id")
    for name in ("members", "hull"):
        items = getattr(groups, name)
        got = f"{len(items)} groups.{name}" if isinstance(items, tuple) else f"groups.{name} {type(items).__name__}"
        good = isinstance(items, tuple) and len(items) in (0, n)
        yield not good and (got, f"a tuple of {n}, or an empty one")
    for ids in groups.members:
        good = isinstance(ids, np.ndarray) and ids.ndim == 1 and (not len(ids) or ids.dtype.kind == "i")
        yield not good and ("groups.members that are no ids", "(k,) int64 each")
        yield _member_fault(ids.tolist(), people, "groups.members")
    for hull in groups.hull:
        good = isinstance(hull, np.ndarray) and hull.ndim == 2 and hull.shape[1] == 2 and hull.dtype.kind in "if"
        yield not good and (f"groups.hull of shape {np.shape(hull)}", "(V, 2) each")
        yield not finite(hull) and ("NaN or infinity in groups.hull", "finite numbers")


def _member_fault(members: Iterable[Any], people: Iterable[int], name: str) -> Fault | None:
    strange = [m for m in members if not (_whole(m) and m in people)]
    return (f"{strange[0]!r} in {name}", "ids that the tracker has reported") if strange else None


def _event_faults(event: Any, index: int, people: Iterable[int]) -> Iterator[Any]:
    yield not isinstance(event, GroupEvent) and (f"an event of type {type(event).__name__}", "sim.types.GroupEvent")
    kind = event.kind
    yield kind not in EVENT_KINDS and (f"an event of kind {kind!r}", "one of " + ", ".join(EVENT_KINDS))
    for name in ("start", "end", "emitted"):
        yield not _whole(getattr(event, name)) and (f"{kind}: {name} {getattr(event, name)!r}", "a whole number")
    yield event.emitted != index and (f"{kind}: emitted {event.emitted}", f"{index}, the present frame, or None")
    yield not 1 <= event.start <= index and (f"{kind}: start {event.start}", f"a frame from 1 to {index}")
    yield event.end < event.start and (f"{kind}: end {event.end}", f"{event.start} or later: its start")
    for name in ("before", "after"):
        groups = getattr(event, name)
        good = isinstance(groups, tuple) and all(_whole(g) and g >= -1 for g in groups)
        yield not good and (f"{kind}: {name} {groups!r}", "a tuple of group ids, -1 for a person alone")
    yield not isinstance(event.members, tuple) and (f"{kind}: members {event.members!r}", "a tuple of ids")
    number = (int, float, np.integer, np.floating)
    good = np.shape(event.pos) == (2,) and all(isinstance(v, number) for v in event.pos)
    yield not good and (f"{kind}: pos {event.pos!r}", "x, y")
    yield _member_fault(event.members, people, f"the members of a {kind}")


def _whole(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)
