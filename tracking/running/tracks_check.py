"""Checks the Tracks that a tracker's `step` returns: types, shapes, ids, groups, events; the first fault in words.

`check_tracks` is the entry. The private functions each check one part and return a `Fault`, or None if there is none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
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
    history = ReportHistory() if history is None else history
    fault = _fault(tracks, index, history)
    if fault:
        got, expected = fault
        remedy = "correct the tracker's step()"
        raise WorkError(file=tracker, place=f"frame {index}", got=got, expected=expected, remedy=remedy)
    return tracks.copy()  # type: ignore[no-any-return]


def _filled(tracks: Tracks) -> Tracks:
    if not np.size(tracks.score) and np.ndim(tracks.id) == 1:
        tracks = tracks.replace(score=np.ones(len(tracks.id)))
    if isinstance(tracks.events, tuple) and any(map(_has_open_frames, tracks.events)):
        tracks = tracks.replace(events=tuple(_with_frames(e, tracks.index) for e in tracks.events))
    return tracks


def _has_open_frames(event: Any) -> bool:
    return isinstance(event, GroupEvent) and (event.emitted is None or event.end is None)


def _with_frames(event: Any, index: int) -> Any:
    if not _has_open_frames(event):
        return event
    emitted = index if event.emitted is None else event.emitted
    end = index if event.end is None else event.end
    return GroupEvent(event.kind, event.start, end, emitted, event.before, event.after, event.members, event.pos)


def _fault(tracks: Any, index: int, history: ReportHistory) -> Fault | None:
    if not isinstance(tracks, Tracks):
        return type(tracks).__name__, "sim.types.Tracks"
    if tracks.index != index:
        return f"index {tracks.index}", f"index {index}"
    if tracks.plane not in ("ground", "space", "image") or tracks.unit not in ("person", "group"):
        return f"plane {tracks.plane!r}, unit {tracks.unit!r}", "plane ground, space or image; unit person or group"
    if history.plane_and_unit is None:
        history.plane_and_unit, history.own_events = (tracks.plane, tracks.unit), tracks.own_events
    first, own = history.plane_and_unit, history.own_events
    if (tracks.plane, tracks.unit) != first:
        return f"plane {tracks.plane!r}, unit {tracks.unit!r}", f"plane {first[0]!r}, unit {first[1]!r} as before"
    if tracks.own_events != own or not isinstance(own, tuple) or not set(own) <= set(EVENT_KINDS):
        return (
            f"own_events {tracks.own_events!r}",
            f"a tuple of kinds of events ({', '.join(EVENT_KINDS)}), always the same",
        )
    fault = _rows_fault(tracks) or _id_fault(tracks)
    if fault:
        return fault
    history.ids.update(tracks.id.tolist())
    people = history.ids if tracks.unit == "person" else frozenset[int]()
    if tracks.groups is not None:
        fault = _groups_fault(tracks.groups, tracks.pos.shape[1], people)
    return fault or _events_fault(tracks.events, index, people) or _undeclared(tracks.events, own)


def _undeclared(events: Iterable[GroupEvent], own: tuple[str, ...]) -> Fault | None:
    kind = next((e.kind for e in events if own and e.kind not in own), None)
    return None if kind is None else (f"an event of kind {kind!r}", f"one of own_events, {', '.join(own)}")


def _rows_fault(tracks: Tracks) -> Fault | None:
    if np.ndim(tracks.id) != 1:
        return f"id of shape {np.shape(tracks.id)}", "(N,)"
    n, d = len(tracks.id), 3 if tracks.plane == "space" else 2
    shapes: dict[str, tuple[Any, tuple[int, ...]]] = {
        "group": (tracks.group, (n,)),
        "pos": (tracks.pos, (n, d)),
        "vel": (tracks.vel, (n, d)),
        "cov": (tracks.cov, (n, 2 * d, 2 * d)),
        "score": (tracks.score, (n,)),
    }
    if tracks.box is not None:
        shapes["box"] = (tracks.box, (n, 4))
    return _arrays_fault(shapes)


def _arrays_fault(shapes: dict[str, tuple[Any, tuple[int, ...]]]) -> Fault | None:
    for name, (a, shape) in shapes.items():
        if not isinstance(a, np.ndarray) or a.dtype.kind not in "iuf":
            return f"{name} of type {getattr(a, 'dtype', type(a).__name__)}", "an array of numbers"
        if a.shape != shape:
            return f"{name} of shape {a.shape}", str(shape)
        if not finite(a) and (name != "vel" or np.isinf(a).any()):
            return f"NaN or infinity in {name}", "finite numbers" + (", or nan for unknown" if name == "vel" else "")
    return None


def finite(a: Any) -> bool:
    """Returns True if all numbers of the array are finite; True for an empty array."""
    # The sum of squares is cheap and finite for ordinary numbers; only if it overflows is each number looked at.
    return isfinite(np.vdot(a, a)) or bool(np.isfinite(a).all())


def _id_fault(tracks: Tracks) -> Fault | None:
    if not isinstance(tracks.id, np.ndarray) or tracks.id.dtype != np.int64 or tracks.group.dtype != np.int64:
        kinds = (getattr(a, "dtype", type(a).__name__) for a in (tracks.id, tracks.group))
        return "ids of type {}, groups of type {}".format(*kinds), "int64"
    if tracks.unit == "group" and not np.array_equal(tracks.id, tracks.group):
        return "group that is not id", "group equal to id where the unit is group"
    if len(tracks.id) and tracks.group.min() < -1:
        return f"group {tracks.group.min()}", "non-negative groups, -1 alone"
    return _ids_fault(tracks.id, "id")


def _ids_fault(id: Any, name: str) -> Fault | None:
    if len(id) and id.min() < 0:
        return f"{name} {id.min()}", f"non-negative {name}s"
    if len(set(id.tolist())) != len(id):
        return f"the same {name} twice", f"unique {name}s in a frame"
    return None


def _groups_fault(groups: Any, d: int, people: Iterable[int]) -> Fault | None:
    if not isinstance(groups, Groups):
        return f"groups of type {type(groups).__name__}", "sim.types.Groups or None"
    if not isinstance(groups.id, np.ndarray) or groups.id.ndim != 1 or groups.id.dtype != np.int64:
        return f"groups.id of type {getattr(groups.id, 'dtype', type(groups.id).__name__)}", "(G,) int64"
    n = len(groups.id)
    for name, shape in (("pos", (n, d)), ("vel", (n, d)), ("extent", (n, 2, 2)), ("size", (n,))):
        a, flat = getattr(groups, name), (n, 2)  # without groups any number of columns passes: Groups.none() has 2
        if not isinstance(a, np.ndarray) or (a.shape != shape and (n or a.shape[:1] != flat[:1])):
            return f"groups.{name} of shape {np.shape(a)}", str(shape)
        if name == "pos" and not finite(a):
            return "NaN or infinity in groups.pos", "finite numbers"
    return _ids_fault(groups.id, "group id") or _ragged_fault(groups, n, people)


def _ragged_fault(groups: Groups, n: int, people: Iterable[int]) -> Fault | None:
    for name in ("members", "hull"):
        items = getattr(groups, name)
        if not isinstance(items, tuple) or len(items) not in (0, n):
            got = f"{len(items)} groups.{name}" if isinstance(items, tuple) else f"groups.{name} {type(items).__name__}"
            return got, f"a tuple of {n}, or an empty one"
    for ids in groups.members:
        if not isinstance(ids, np.ndarray) or ids.ndim != 1 or (len(ids) and ids.dtype.kind != "i"):
            return "groups.members that are no ids", "(k,) int64 each"
        if fault := _members_fault(ids.tolist(), people, "groups.members"):
            return fault
    for hull in groups.hull:
        if not isinstance(hull, np.ndarray) or hull.ndim != 2 or hull.shape[1] != 2 or hull.dtype.kind not in "if":
            return f"groups.hull of shape {np.shape(hull)}", "(V, 2) each"
        if not finite(hull):
            return "NaN or infinity in groups.hull", "finite numbers"
    return None


def _members_fault(members: Iterable[Any], people: Iterable[int], name: str) -> Fault | None:
    for m in members:
        if not isinstance(m, int | np.integer) or isinstance(m, bool) or m not in people:  # type: ignore[operator]
            return f"{m!r} in {name}", "ids that the tracker has reported"
    return None


def _events_fault(events: Any, index: int, people: Iterable[int]) -> Fault | None:
    if not isinstance(events, tuple):
        return f"events of type {type(events).__name__}", "a tuple of sim.types.GroupEvent"
    for event in events:
        if fault := _event_fault(event, index, people):
            return fault
    return None


def _event_fault(event: Any, index: int, people: Iterable[int]) -> Fault | None:
    if not isinstance(event, GroupEvent):
        return f"an event of type {type(event).__name__}", "sim.types.GroupEvent"
    if event.kind not in EVENT_KINDS:
        return f"an event of kind {event.kind!r}", "one of " + ", ".join(EVENT_KINDS)
    for name in ("start", "end", "emitted"):
        if not _whole(getattr(event, name)):
            return f"{event.kind}: {name} {getattr(event, name)!r}", "a whole number"
    if event.emitted != index:
        return f"{event.kind}: emitted {event.emitted}", f"{index}, the present frame, or None"
    if not 1 <= event.start <= index:
        return f"{event.kind}: start {event.start}", f"a frame from 1 to {index}"
    if event.end < event.start:
        return f"{event.kind}: end {event.end}", f"{event.start} or later: its start"
    for name in ("before", "after"):
        groups = getattr(event, name)
        if not isinstance(groups, tuple) or not all(_whole(g) and g >= -1 for g in groups):
            return f"{event.kind}: {name} {groups!r}", "a tuple of group ids, -1 for a person alone"
    if not isinstance(event.members, tuple):
        return f"{event.kind}: members {event.members!r}", "a tuple of ids"
    if np.shape(event.pos) != (2,) or not _numbers(event.pos):
        return f"{event.kind}: pos {event.pos!r}", "x, y"
    return _members_fault(event.members, people, f"the members of a {event.kind}")


def _whole(value: Any) -> bool:
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _numbers(values: Any) -> bool:
    return all(isinstance(v, int | float | np.integer | np.floating) for v in values)
