"""Groups and events for trackers that follow people: the baseline rule, causal, on anybody's tracks.

Linked people (tracking.grouping.link_rule) form groups, connected through others too; ids follow the identity rule
(sim.truth.identity).
Crossings and queues are measured by sim.truth.crossing_events and sim.truth.queue_detection.
An event is reported in the frame in which it is
known, `start` being
its onset: a merge once its link holds, a crossing 2 s after it, a queue when its people have waited 3 s (and 3 s more,
as advancing is told from leaving by what follows); a queue's `end`, and who joins it, is known later. The end of a
recording tells what is then known: in its last frame crossings and queues are reported without waiting for what might
have followed, so that this one frame is not causal beside a longer recording.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import InputError
from sim.truth.crossing_events import SAME_BEFORE, crossings
from sim.truth.group_hulls import box_groups, groups_over_time
from sim.truth.merge_split_rules import frames_of
from sim.truth.queue_detection import ADVANCE_TIME, QUEUE_TIME, queues
from sim.types import EVENT_KINDS, Array, Bools, GroupEvent, Groups, Ints, Tracks
from tracking.grouping.group_labels import label_changes, label_people
from tracking.grouping.link_rule import Grouping, find_links

__all__ = ["Grouping", "derive", "with_groups"]

MEMBERSHIP = frozenset(EVENT_KINDS) - {"cross", "queue"}
HALF = 0.5  # s: chord that stands for the velocities of a tracker that knows none


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """All tracks of a sequence as rows sorted by frame (from 0) and id; metres; group -1 alone."""

    frame: Ints
    id: Ints
    column: Ints
    ids: Ints
    pos: Array
    vel: Array
    group: Ints
    length: int
    scale: float

    def places(self) -> Array:
        """(T, P, 2) over frames and columns, nan absent."""
        return self._dense(self.pos)

    def velocities(self) -> Array:
        """(T, P, 2) like `places`."""
        return self._dense(self.vel)

    def labels(self) -> Ints:
        """(T, P): group, -1 alone or absent."""
        out = np.full((self.length, len(self.ids)), -1, np.int64)
        out[self.frame, self.column] = self.group
        return out

    def _dense(self, values: Array) -> Array:
        out = np.full((self.length, len(self.ids), 2), np.nan)
        out[self.frame, self.column] = values
        return out


def with_groups(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None
) -> tuple[Tracks, ...]:
    """The tracks `derive`d; px_per_m is needed for tracks in the image, which stay as they are without it (not one box
    was given: nobody can be grouped). Tracks that are marked as derived stay what they are."""
    if all(t.derived for t in tracks) or (tracks[0].plane == "image" and not math.isfinite(px_per_m)):
        return tuple(tracks)
    return tuple(derive(tracks, fps, px_per_m, rule))


def names_groups(tracks: Sequence[Tracks]) -> bool:
    """Does the tracker tell groups itself, of people or as wholes?"""
    return any(t.unit == "group" or t.groups is not None or bool((t.group >= 0).any()) for t in tracks)


def derive(tracks: Iterable[Tracks], fps: float, px_per_m: float = 1.0, rule: Grouping | None = None) -> list[Tracks]:
    """The tracks with `group`, `groups` and `events` filled in where a tracker left them empty, marked as derived.

    People get groups by the baseline rule unless the tracker named any, in `group` or in its groups' members. Events of
    membership are derived from these groups unless it reported any such; crossings and queues unless it reported any of
    that kind. Groups without people (unit "group") are left as they are.
    """
    given = list(tracks)
    if not given or any(t.unit == "group" for t in given):
        return given
    rule = rule or Grouping()
    rows = tabled(given, fps, px_per_m, rule)
    named = names_groups(given)
    said = {e.kind for t in given for e in t.events}
    events: list[GroupEvent] = []
    if not named or not said & MEMBERSHIP:
        rows, events = _membership(rows, named, fps, rule)
    events = [e for e in events if not said & MEMBERSHIP]
    return _filled(given, rows, events + [e for e in _encounters(rows, fps) if e.kind not in said])


def _membership(rows: Table, named: bool, fps: float, rule: Grouping) -> tuple[Table, list[GroupEvent]]:
    """The rows with their groups, and what happened to these.

    Groups that the tracker named are kept. Where they are those of the baseline rule (it may have been applied before),
    so are the events, onsets and all; of others the labels alone speak.
    """
    if named and (rows.group < 0).all():
        return rows, []
    links = find_links(rows.frame, rows.column, rows.pos, rows.vel, rows.length, fps, rule)
    group, events = label_people(rows.frame, rows.column, rows.places(), links, fps, rule)
    if named and not np.array_equal(group, rows.group):
        return rows, label_changes(rows.labels(), rows.places())
    return replace(rows, group=group), events


def _labels(given: Sequence[Tracks]) -> list[Ints]:
    """Groups of each frame's people: those they carry or, if nobody ever carries one, whose members they are."""
    if any((t.group >= 0).any() for t in given):
        return [t.group for t in given]
    found = []
    for t in given:
        members = () if t.groups is None else zip(t.groups.id.tolist(), t.groups.members, strict=False)
        of = {p: g for g, people in members for p in people.tolist()}
        found.append(np.array([of.get(p, -1) for p in t.id.tolist()], np.int64))
    return found


def tabled(given: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping) -> Table:
    """All tracks of a sequence as the rule sees them."""
    scale = px_per_m if given[0].plane == "image" else 1.0
    if not math.isfinite(scale) or scale <= 0:
        raise InputError(
            place="px_per_m", got=f"{scale}", expected="a number above 0", remedy="give --px-per-m: tracks are in px"
        )
    count = [len(t.id) for t in given]
    frame = np.repeat(np.array([t.index for t in given], np.int64) - 1, count)
    id, group = np.concatenate([t.id for t in given]), np.concatenate(_labels(given))
    pos, vel = (np.concatenate([getattr(t, name)[:, :2] for t in given]) / scale for name in ("pos", "vel"))
    order = np.lexsort((id, frame))
    frame, id, group, pos, vel = frame[order], id[order], group[order], pos[order], vel[order]
    ids, column = np.unique(id, return_inverse=True)
    length = int(max(t.index for t in given))
    unknown = np.isnan(vel[:, 0])
    if rule.smooth > 0 or unknown.any():
        chords = backward_velocity(frame, column, pos, fps, rule.smooth or HALF)
        vel = chords if rule.smooth > 0 else np.where(unknown[:, None], chords, vel)
    return Table(frame, id, column, ids, pos, vel, group, length, scale)


def backward_velocity(frame: Ints, column: Ints, pos: Array, fps: float, window: float) -> Array:
    """Velocity (R, 2) as the chord to the earliest row of the same person within the last `window` seconds; nan in a
    person's first row and after a longer gap."""
    order = np.lexsort((frame, column))
    f, span = frame[order], frames_of(window, fps)
    key = column[order] * (int(f.max(initial=0)) + span + 2) + f
    first = np.searchsorted(key, key - span)
    steps = f - f[first]
    out = np.empty_like(pos)
    chord = (pos[order] - pos[order][first]) * fps / np.maximum(steps, 1)[:, None]
    out[order] = np.where(steps[:, None] > 0, chord, np.nan)
    return out


def _encounters(rows: Table, fps: float) -> list[GroupEvent]:
    """Crossings and queues, and when they are known."""
    pos, vel, label = rows.places(), rows.velocities(), rows.labels()
    present: Bools = np.isfinite(pos[..., 0])
    crossed = crossings(pos, vel, present, label, fps)
    queued = queues(pos, vel, present, label, fps)
    late, waited = frames_of(SAME_BEFORE, fps), frames_of(QUEUE_TIME, fps) + frames_of(ADVANCE_TIME, fps)
    return [replace(e, emitted=min(e.end + late, rows.length)) for e in crossed] + [
        replace(e, emitted=min(e.start + waited - 1, rows.length)) for e in queued
    ]


def _filled(given: Sequence[Tracks], rows: Table, events: Sequence[GroupEvent]) -> list[Tracks]:
    """The tracks with these events (people being columns + 1, metres), labels, and groups in their own unit."""
    shapes = _shapes(given, rows)
    cuts = np.searchsorted(rows.frame, np.arange(rows.length + 1))
    told: dict[int, list[GroupEvent]] = {}
    for event in events:
        told.setdefault(event.emitted or event.start, []).append(_named(event, rows))
    out = []
    for t in given:
        r = slice(int(cuts[t.index - 1]), int(cuts[t.index]))
        label = rows.group[r][np.searchsorted(rows.id[r], t.id)]
        new = tuple(sorted(told.pop(t.index, ()), key=lambda e: (e.start, e.end, e.kind, e.members, e.after)))
        groups = shapes[t.index - 1] if t.groups is None else t.groups
        out.append(t.replace(group=label, groups=groups, events=(*t.events, *new), derived=True))
    return out


def _named(event: GroupEvent, rows: Table) -> GroupEvent:
    """An event with the tracks' own ids and unit."""
    x, y = (v * rows.scale for v in event.pos)
    return replace(event, members=tuple(int(rows.ids[p - 1]) for p in event.members), pos=(x, y))


def _shapes(given: Sequence[Tracks], rows: Table) -> list[Groups]:
    """Groups of every frame: hulls of footprints on the ground, of boxes in the image where there are any."""
    pos, vel, box = rows.pos * rows.scale, rows.vel * rows.scale, outlined_boxes(given)
    if box is not None:
        return box_groups(rows.frame, rows.id, rows.group, pos, vel, box, 0, rows.length)
    return groups_over_time(rows.frame, rows.id, rows.group, pos, vel, 0, rows.length, rows.scale)


def outlined_boxes(given: Sequence[Tracks]) -> Array | None:
    """The boxes of the rows where groups are drawn round boxes: in the image, where everybody has one."""
    if given[0].plane != "image" or any(t.box is None for t in given if len(t.id)):
        return None
    found = [t.box[np.argsort(t.id)] for t in given if t.box is not None and len(t.id)]
    return np.concatenate(found) if found else None
