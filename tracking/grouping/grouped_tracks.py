"""Fill in groups and events of person tracks, for a tracker that reports none or only some of them.

`with_groups` is the entry for runs and scores; `derive` does the work. Both are causal, apart from the last frame:
- People are linked by the belief or the baseline rule (tracking.grouping.grouping_choice). Linked people form groups
  with ids (tracking.grouping.group_labels).
- Merge, split, form, dissolve, enter and leave events follow from changes of the groups
  (tracking.grouping.merge_split_events).
- Crossings and queues are measured by sim.truth.crossing_events and sim.truth.queue_detection.

What the tracker reports itself is decided once, so that no later frame changes an earlier one:
- Groups: by the first frame in which there are people (`names_groups`).
- Events: by the kinds that the tracker declares (`Tracks.own_events`); of kinds that are not declared, from the frame
  on in which it first reports one.

An event is reported (`emitted`) in the frame in which it is known, and its `start` is the onset: a merge is known once
the link holds, a crossing 2 s after its end, a queue 4.5 s after its end (3 s in which people may advance, and 1.5 s
for which a line may be lost). Crossings and queues that are not known by the end of the recording are reported in its
last frame, so that this frame is not causal.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from sim.io.formats.velocity import chords
from sim.truth.crossing_events import SAME_BEFORE, crossings
from sim.truth.group_hulls import box_groups, groups_over_time
from sim.truth.merge_split_rules import frames_of
from sim.truth.queue_detection import ADVANCE_TIME, BRIDGE_TIME, queues
from sim.types import EVENT_KINDS, Array, Bools, GroupEvent, Groups, Ints, Tracks
from tracking.grouping.group_labels import label_people
from tracking.grouping.grouping_choice import Grouping, default_grouping, links_of
from tracking.grouping.merge_split_events import TrackedMotion, events_of_labels
from tracking.grouping.tracks_table import TracksTable, boxes_of_rows, tabulate

MEMBERSHIP_KINDS = frozenset(EVENT_KINDS) - {"cross", "queue"}
"""Kinds of events in which the membership of groups changes."""


def with_groups(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None
) -> tuple[Tracks, ...]:
    """Return the tracks of a sequence with groups and events filled in by `derive`; in order, one `Tracks` per frame.

    tracks: one tracker's, one `Tracks` per frame, from frame 1. fps: frames per second. px_per_m: scale, px per m, if
    they are in the image. rule: None stands for the default grouping.

    Unknown velocities (nan) are replaced by chords of the positions, `with_velocities`. The tracks are returned
    unchanged if there are none or if all are marked as derived. Only velocities are filled in if one has unit "group",
    and for tracks in the image if px_per_m is nan or infinite. Raises InputError if they are in the image and px_per_m
    is 0 or below.
    """
    if all(t.derived for t in tracks):
        return tuple(tracks)
    tracks = with_velocities(tracks, fps)
    if tracks[0].plane == "image" and not math.isfinite(px_per_m):
        return tuple(tracks)
    return tuple(derive(tracks, fps, px_per_m, rule))


def with_velocities(tracks: Sequence[Tracks], fps: float) -> Sequence[Tracks]:
    """Return the tracks with unknown velocities (a row of `vel` with nan) replaced by chords of the positions over the
    last 0.5 s, as tracks in a text get them.

    tracks: one `Tracks` per frame. fps: frames per second. A velocity stays nan in an id's first frame, and where the
    id was not seen within that time before. Tracks without nan are returned as they are.
    """
    if not any(np.isnan(t.vel).any() for t in tracks):
        return tracks
    count = [len(t.id) for t in tracks]
    frame, id = np.repeat([t.index for t in tracks], count), np.concatenate([t.id for t in tracks])
    pos, vel = np.concatenate([t.pos for t in tracks]), np.concatenate([t.vel for t in tracks])
    vel = np.where(np.isnan(vel).any(axis=1)[:, None], chords(frame, id, pos, fps), vel)
    parts = np.split(vel, np.cumsum(count)[:-1])
    return [t.replace(vel=part) for t, part in zip(tracks, parts, strict=True)]


def names_groups(tracks: Sequence[Tracks]) -> bool:
    """Return True if the tracker reports groups itself: decided by the first frame that has people or groups.

    It does if the unit is "group", a `group` is above -1, or `groups` is not None (even without a group) in this frame.
    False for no tracks.
    """
    first = next((t for t in tracks if len(t.id) or t.groups is not None), None)
    return first is not None and _has_groups(first)


def late_groups(tracks: Sequence[Tracks]) -> int | None:
    """Return the first frame with groups of a tracker that does not report groups in its first answer; else None.

    Such groups are replaced by derived ones.
    """
    return None if names_groups(tracks) else next((t.index for t in tracks if _has_groups(t)), None)


def _has_groups(tracks: Tracks) -> bool:
    return tracks.unit == "group" or tracks.groups is not None or bool((tracks.group >= 0).any())


def without_groups(tracks: Sequence[Tracks]) -> list[Tracks]:
    """Return the tracks of people without the groups and events that are in them, one `Tracks` per frame, in order.

    Tracks of whole groups are returned as they are.
    """
    return [
        t if t.unit == "group" else t.replace(group=np.full(len(t.id), -1), groups=None, events=(), derived=False)
        for t in tracks
    ]


def derive(tracks: Iterable[Tracks], fps: float, px_per_m: float = 1.0, rule: Grouping | None = None) -> list[Tracks]:
    """Return the tracks with `group`, `groups` and `events` filled in where the tracker left them empty.

    tracks: one tracker's, of a whole sequence, in order, one per frame from frame 1; the result has as many, marked as
    derived. fps: frames per second. px_per_m: px per m, used only if the tracks are in the image. rule: None stands for
    the default grouping.
    - A tracker that names groups (`names_groups`), in `group` or in the members of its `groups`, keeps them. Else the
      grouping forms groups, and groups that the tracker reports later are left out.
    - Membership events (all kinds but cross and queue) are derived up to the frame from which on they are the
      tracker's own: frame 1 if it declares one of these kinds, else the first frame in which it reports one.
    - Crossings and queues are derived likewise, each kind for itself.

    No tracks, and sequences with a frame of unit "group", are returned as they are. Raises InputError if the tracks are
    in the image and px_per_m is not a number above 0.
    """
    given = list(tracks)
    if not given or any(t.unit == "group" for t in given):
        return given
    rule, named, own = rule or default_grouping(), names_groups(given), _own_events(given)
    if not named:
        given = [t.replace(group=np.full(len(t.id), -1), groups=None) if _has_groups(t) else t for t in given]
    table, events = tabulate(given, fps, px_per_m, rule.smooth), list[GroupEvent]()
    if not named or own.get("merge", math.inf) > 1:
        table, events = _grouped(table, named, fps, rule)
    events += _crossings_and_queues(table, fps)
    return _filled(given, table, [e for e in events if (e.emitted or e.start) < own.get(e.kind, math.inf)])


def _own_events(tracks: Sequence[Tracks]) -> dict[str, int]:
    """Returns the frame from which on the events of a kind are the tracker's own, by kind; kinds that it never reports
    are left out. All membership kinds have the first frame of any of them."""
    found = dict.fromkeys(tracks[0].own_events, 1)
    for t in tracks:
        for event in t.events:
            found.setdefault(event.kind, t.index)
    membership = [frame for kind, frame in found.items() if kind in MEMBERSHIP_KINDS]
    return {**found, **(dict.fromkeys(MEMBERSHIP_KINDS, min(membership)) if membership else {})}


def _grouped(table: TracksTable, named: bool, fps: float, rule: Grouping) -> tuple[TracksTable, list[GroupEvent]]:
    """Returns the table with group ids filled in, and the membership events (people are columns + 1, frames count from
    1).

    named: the tracker reports groups itself. Its groups are kept. As long as they equal those of the grouping, its
    events are used, as their onsets are dated back. From the first frame with another group on, the events follow from
    the changes of the tracker's labels. fps: frames per second.
    """
    if named and (table.group < 0).all():
        return table, []
    links = links_of(table, fps, rule)
    motion = TrackedMotion(table.positions(), table.velocities(), fps)
    group, events = label_people(table.frame, table.column, motion, links, rule)
    if not named:
        return replace(table, group=group), events
    other = table.frame[group != table.group]
    equal = int(other[0]) if len(other) else table.length
    changes = events_of_labels(table.labels(), table.positions()) if len(other) else []
    early = [e for e in events if (e.emitted or e.start) <= equal]
    return table, early + [e for e in changes if (e.emitted or e.start) > equal]


def _crossings_and_queues(table: TracksTable, fps: float) -> list[GroupEvent]:
    """Returns the crossings, then the queues, of the whole recording; `emitted` is the frame (from 1) in which each is
    known.

    A crossing is known 2 s after its end, a queue once its people can no longer be advancing and its line no longer be
    lost for a while. An event that is not known by the end is emitted in the last frame. Members are columns + 1,
    positions are in m. table: all tracks; fps: frames per second.
    """
    pos, vel, label = table.positions(), table.velocities(), table.labels()
    present: Bools = np.isfinite(pos[..., 0])
    crossed = crossings(pos, vel, present, label, fps)
    queued = queues(pos, vel, present, label, fps)
    after_cross, after_queue = frames_of(SAME_BEFORE, fps), frames_of(ADVANCE_TIME, fps) + frames_of(BRIDGE_TIME, fps)
    return [replace(e, emitted=min(e.end + after_cross, table.length)) for e in crossed] + [
        replace(e, emitted=min(e.end + after_queue, table.length)) for e in queued
    ]


def _filled(given: Sequence[Tracks], table: TracksTable, events: Sequence[GroupEvent]) -> list[Tracks]:
    """Returns the tracks with the table's group ids, groups where `groups` is None, and these events after their own.

    events: members are columns + 1 and positions are in m; in the result both are the tracks' own ids and unit. An
    event is added to the frame in which it is emitted (or, without one, starts); those of a frame are sorted by start,
    end, kind, members. given: one `Tracks` per frame, in order. The result is marked as derived.
    """
    groups = _groups_of_frames(given, table)
    cuts = np.searchsorted(table.frame, np.arange(table.length + 1))
    by_frame: dict[int, list[GroupEvent]] = {}
    for event in events:
        by_frame.setdefault(event.emitted or event.start, []).append(_with_track_ids(event, table))
    out = []
    for t in given:
        r = slice(int(cuts[t.index - 1]), int(cuts[t.index]))
        label = table.group[r][np.searchsorted(table.id[r], t.id)]
        new = tuple(sorted(by_frame.pop(t.index, ()), key=lambda e: (e.start, e.end, e.kind, e.members, e.after)))
        own = groups[t.index - 1] if t.groups is None else t.groups
        out.append(t.replace(group=label, groups=own, events=(*t.events, *new), derived=True))
    return out


def _with_track_ids(event: GroupEvent, table: TracksTable) -> GroupEvent:
    """Returns a copy of the event with track ids as members instead of columns + 1, and with its position in the
    tracks' unit (m or px) instead of m."""
    x, y = (v * table.scale for v in event.pos)
    return replace(event, members=tuple(int(table.ids[p - 1]) for p in event.members), pos=(x, y))


def _groups_of_frames(given: Sequence[Tracks], table: TracksTable) -> list[Groups]:
    """Returns a list of the Groups of every frame 1, 2, … of the sequence, in the tracks' unit (m or px); empty Groups
    for a frame without any.

    Hulls go round footprints (16-gons on a circle of 0.25 m round each position), or round boxes in frames in which
    all tracks have boxes and lie in the image. given: the tracks, at least one `Tracks` (else IndexError); table: the
    same as rows.
    """
    pos, vel, box = table.pos * table.scale, table.vel * table.scale, boxes_of_rows(given)
    boxed = np.isfinite(box[:, 0])

    def rows(kept: Bools) -> tuple[Ints, Ints, Ints, Array, Array]:
        return table.frame[kept], table.id[kept], table.group[kept], pos[kept], vel[kept]

    around = groups_over_time(*rows(~boxed), 0, table.length, table.scale)
    if not boxed.any():
        return around
    in_boxes = box_groups(*rows(boxed), box[boxed], 0, table.length)
    return [a if len(a.id) else b for a, b in zip(around, in_boxes, strict=True)]
