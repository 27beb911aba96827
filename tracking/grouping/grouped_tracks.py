"""Fill in groups and events of person tracks, for a tracker that reports none or only some of them.

`with_groups` is the entry for runs and scores; `derive` does the work. Both are causal, apart from the last frame:
- People are linked by the belief or the baseline rule (`grouping_choice`). Linked people form groups (`group_labels`).
- Membership events follow from changes of the groups (`group_events`).
- Crossings and queues are measured by `sim.truth.crossing_events` and `sim.truth.queue_detection`.

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
from typing import Any

import numpy as np

from sim.truth.crossing_events import SAME_BEFORE, crossings
from sim.truth.group_hulls import box_groups, groups_over_time
from sim.truth.merge_split_rules import frames_of
from sim.truth.queue_detection import ADVANCE_TIME, BRIDGE_TIME, queues
from sim.truth.velocities import chords
from sim.types import EVENT_KINDS, Array, GroupEvent, Groups, Ints, Tracks
from tracking.grouping.belief import Belief
from tracking.grouping.group_events import TrackedMotion, events_of_labels
from tracking.grouping.group_labels import label_people
from tracking.grouping.grouping_choice import Grouping, default_grouping, find_groups
from tracking.grouping.person_motion import steady_places
from tracking.grouping.tracks_table import TracksTable, tabulate

# Kinds of events in which the membership of groups changes.
MEMBERSHIP_KINDS = frozenset(EVENT_KINDS) - {"cross", "queue"}
PORTION = 5_000  # Frames worked on together: bounds memory.


def with_groups(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None, *, objective: bool = False
) -> tuple[Tracks, ...]:
    """Returns the tracks of a sequence, one `Tracks` per frame, with groups, events and velocities filled in.

    px_per_m: image scale of tracks in the image; if it is nan for these, only velocities are filled in. rule: how
    people are grouped; None takes the default grouping. objective: as of `derive`.
    """
    if all(t.derived for t in tracks):
        return tuple(tracks)
    tracks = with_velocities(tracks, fps)
    if tracks[0].plane == "image" and not math.isfinite(px_per_m):
        return tuple(tracks)
    return tuple(derive(tracks, fps, px_per_m, rule, objective=objective))


def with_velocities(tracks: Sequence[Tracks], fps: float) -> Sequence[Tracks]:
    """Returns the tracks with each unknown (nan) velocity replaced by the mean velocity over the last 0.5 s."""
    if not any(np.isnan(t.vel).any() for t in tracks):
        return tracks
    count = [len(t.id) for t in tracks]
    frame, id = np.repeat([t.index for t in tracks], count), np.concatenate([t.id for t in tracks])
    pos, vel = np.concatenate([t.pos for t in tracks]), np.concatenate([t.vel for t in tracks])
    vel = np.where(np.isnan(vel).any(axis=1)[:, None], chords(frame, id, pos, fps), vel)
    parts = np.split(vel, np.cumsum(count)[:-1])
    return [t.replace(vel=part) if len(part) else t for t, part in zip(tracks, parts, strict=True)]


def names_groups(tracks: Sequence[Tracks]) -> bool:
    """Returns True if the tracker reports groups itself, that is, in the first frame with people or groups."""
    first = next((t for t in tracks if len(t.id) or t.groups is not None), None)
    return first is not None and _has_groups(first)


def late_groups(tracks: Sequence[Tracks]) -> int | None:
    """Returns the first frame with groups if the tracker reported none at first (`names_groups` is False), else None.
    Such late groups are replaced by derived ones."""
    return None if names_groups(tracks) else next((t.index for t in tracks if _has_groups(t)), None)


def _has_groups(tracks: Tracks) -> bool:
    return tracks.unit == "group" or tracks.groups is not None or bool((tracks.group >= 0).any())


def groups_alone(tracks: Sequence[Tracks]) -> bool:
    """Returns True if people are in groups in some frame, but no two of them in the same group in any."""
    grouped = [t.group[t.group >= 0] for t in tracks if t.unit == "person" and t.groups is None]
    return any(map(len, grouped)) and all(len(group) == len({*group.tolist()}) for group in grouped)


def without_groups(tracks: Sequence[Tracks]) -> list[Tracks]:
    """Returns the tracks with groups and events removed, and no kind of event as the tracker's own; `Tracks` of whole
    groups are returned unchanged."""
    none: dict[str, Any] = {"groups": None, "events": (), "own_events": (), "derived": False}
    return [t if t.unit == "group" else t.replace(group=np.full(len(t.id), -1), **none) for t in tracks]


def derive(
    tracks: Iterable[Tracks], fps: float, px_per_m: float = 1.0, rule: Grouping | None = None, *,
    objective: bool = False,
) -> list[Tracks]:  # fmt: skip
    """Returns the tracks with `group`, `groups` and `events` filled in where the tracker left them empty.

    tracks: of a whole sequence, in order, one per frame from frame 1. If the tracker names groups in its first frame
    with people, its groups are kept; otherwise the grouping forms all groups, and any that the tracker reports later
    are removed. Events of a kind are derived for the frames before the tracker reports this kind itself.
    objective: True leaves out crossings, queues and hulls, which the objective does not need.
    """
    given = list(tracks)
    if not given or any(t.unit == "group" for t in given):
        return given
    table, labels, events = labels_and_events(given, fps, px_per_m, rule, objective=objective)
    return filled(given, labels, events, table.scale, objective=objective)


def labels_and_events(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None, *, objective: bool = False,
    places: Array | None = None,
) -> tuple[TracksTable, list[Ints], list[tuple[GroupEvent, ...]]]:  # fmt: skip
    """Returns the table of people, and for each `Tracks` the group ids (N,) of its rows and the events to add.

    The arguments are as in `derive`. places: as of `tabulate`; the events then lie there.
    """
    rule, named, own = rule or default_grouping(), names_groups(tracks), _own_events(tracks)
    if not named:
        # groups that appear later would change frames that are reported already
        tracks = [t.replace(group=np.full(len(t.id), -1), groups=None) if _has_groups(t) else t for t in tracks]
    table, events = tabulate(tracks, fps, px_per_m, places), list[GroupEvent]()
    changes = not named or own.get("merge", math.inf) > 1
    # what a tracker reports itself, and the objective leaves out, needs no places
    steady = _steady(table, fps) if isinstance(rule, Belief) and (changes or not objective) else table
    if changes:
        group, events = _grouped(table, steady, named, fps, rule)
        table, steady = replace(table, group=group), replace(steady, group=group)
    events += [] if objective else _crossings_and_queues(steady, fps)
    events = [e for e in events if (e.emitted or e.start) < own.get(e.kind, math.inf)]
    return table, *_of_frames(tracks, table, events)


def _own_events(tracks: Sequence[Tracks]) -> dict[str, int]:
    """Returns by kind the frame from which on events are the tracker's own."""
    found = dict.fromkeys(tracks[0].own_events, 1)
    for t in tracks:
        for event in t.events:
            found.setdefault(event.kind, t.index)
    membership = [frame for kind, frame in found.items() if kind in MEMBERSHIP_KINDS]
    return {**found, **(dict.fromkeys(MEMBERSHIP_KINDS, min(membership)) if membership else {})}


def _steady(table: TracksTable, fps: float) -> TracksTable:
    """Returns the table with the places and velocities that are most likely where positions err (`steady_places`): only
    so does a person who stands still not come and go."""
    rows = table.seen if table.seen is not None else np.ones(len(table.frame), bool)
    pos = table.pos.copy()
    pos[rows] = steady_places(table.frame[rows], table.column[rows], table.pos[rows], table.length, fps)
    moved = (pos != table.pos).any(axis=1)
    vel = np.where(moved[:, None], chords(table.frame, table.id, pos, fps), table.vel)
    return replace(table, pos=pos, vel=vel)


def _grouped(
    table: TracksTable, steady: TracksTable, named: bool, fps: float, rule: Grouping
) -> tuple[Ints, list[GroupEvent]]:
    """Returns the group ids of the table's rows, and the membership events by the motion of steady places."""
    if named and (table.group < 0).all():
        return table.group, []
    found = find_groups(table, fps, rule)
    motion = TrackedMotion(steady.motion(), fps, steady.measured_motion())
    group, events = label_people(table.frame, table.column, motion, found, rule)
    if not named:
        return group, events
    # As long as a tracker's groups equal those of the grouping, the grouping's events are used: their onsets are dated
    # back.
    other = table.frame[group != table.group]
    equal = int(other[0]) if len(other) else table.length
    changes = events_of_labels(motion.rows) if len(other) else []
    early = [e for e in events if (e.emitted or e.start) <= equal]
    return table.group, early + [e for e in changes if (e.emitted or e.start) > equal]


def _crossings_and_queues(table: TracksTable, fps: float) -> list[GroupEvent]:
    motion = table.motion()
    after = _known_after(fps)
    found = [*crossings(motion, fps), *queues(motion, fps)]
    return [replace(e, emitted=min(e.end + after[e.kind], table.length)) for e in found]


def _known_after(fps: float) -> dict[str, int]:
    # A crossing is known once both groups are the same as before for a while, a queue once its people can no longer be
    # advancing and its line no longer be lost.
    return {"cross": frames_of(SAME_BEFORE, fps), "queue": frames_of(ADVANCE_TIME, fps) + frames_of(BRIDGE_TIME, fps)}


def events_at_end(reported: Sequence[Tracks], filled: Sequence[Tracks], fps: float) -> int:
    """Returns how many derived crossings and queues stand in the last frame only because the recording ends there.
    reported: the tracks of the tracker; filled: the same with groups and events."""
    if not reported:
        return 0
    after, last, own = _known_after(fps), filled[-1], len(reported[-1].events)
    return sum(e.kind in after and e.end + after[e.kind] > last.index for e in last.events[own:])


def filled(
    tracks: Sequence[Tracks], labels: Sequence[Ints], events: Sequence[tuple[GroupEvent, ...]], px_per_m: float = 1.0,
    *, objective: bool = False,
) -> list[Tracks]:  # fmt: skip
    """Returns the tracks with these group ids and further events, and with groups that follow from the ids unless the
    tracker names groups. labels, events: of each `Tracks`. px_per_m, objective: as of `derive`."""
    named, every = names_groups(tracks), groups_in_frames(tracks, px_per_m, labels, shapes=not objective)
    return [
        t.replace(group=own, events=(*t.events, *new), groups=(t.groups if named else None) or groups, derived=True)
        for t, own, new, groups in zip(tracks, labels, events, every, strict=True)
    ]


def _of_frames(
    tracks: Sequence[Tracks], table: TracksTable, events: Sequence[GroupEvent]
) -> tuple[list[Ints], list[tuple[GroupEvent, ...]]]:
    cuts = np.searchsorted(table.frame, np.arange(table.length + 1)).tolist()
    by_frame: dict[int, list[GroupEvent]] = {}
    for event in events:
        by_frame.setdefault(event.emitted or event.start, []).append(_with_track_ids(event, table))
    labels = []
    for t in tracks:
        r = slice(cuts[t.index - 1], cuts[t.index])
        labels.append(table.group[r][np.searchsorted(table.id[r], t.id)])
    every = (by_frame.pop(t.index, ()) for t in tracks)
    return labels, [tuple(sorted(new, key=lambda e: (e.start, e.end, e.kind, e.members, e.after))) for new in every]


def _with_track_ids(event: GroupEvent, table: TracksTable) -> GroupEvent:
    x, y = (v * table.scale for v in event.pos)
    return replace(event, members=tuple(int(table.ids[p - 1]) for p in event.members), pos=(x, y))


def groups_in_frames(
    tracks: Sequence[Tracks], px_per_m: float = 1.0, labels: Sequence[Ints] | None = None, *, shapes: bool = True
) -> list[Groups]:
    """Returns the groups of each frame that follow from the group ids, one `Groups` per `Tracks`. Hulls enclose the
    boxes of people in the image, else their footprints; px_per_m scales footprints in the image. labels: group ids (N,)
    of each `Tracks`, None: its `group`. shapes: False leaves the hulls out."""
    labels = [t.group for t in tracks] if labels is None else labels
    portions = (slice(low, low + PORTION) for low in range(0, len(tracks), PORTION))
    return [g for portion in portions for g in _groups_of_portion(tracks[portion], labels[portion], px_per_m, shapes)]


def _groups_of_portion(tracks: Sequence[Tracks], labels: Sequence[Ints], px_per_m: float, shapes: bool) -> list[Groups]:
    frame = np.repeat(np.arange(len(tracks)), [len(t.id) for t in tracks])
    id, group = np.concatenate([t.id for t in tracks]), np.concatenate(labels)
    # of people in space x and y, as frames without groups have two coordinates, too
    pos, vel = np.concatenate([t.pos[:, :2] for t in tracks]), np.concatenate([t.vel[:, :2] for t in tracks])
    box = np.concatenate([
        np.full((len(t.id), 4), np.nan) if t.box is None or t.plane != "image" else t.box for t in tracks
    ])  # fmt: skip
    there, boxed = np.isfinite(pos).all(axis=1), np.isfinite(box[:, 0])
    a, b, length = there & ~boxed, there & boxed, len(tracks)
    around = groups_over_time(frame[a], id[a], group[a], pos[a], vel[a], 0, length, px_per_m, shapes=shapes)
    if not b.any():
        return around
    in_boxes = box_groups(frame[b], id[b], group[b], pos[b], vel[b], box[b], 0, length, shapes=shapes)
    return [one if len(one.id) else other for one, other in zip(around, in_boxes, strict=True)]
