"""Fill in groups and events of person tracks, for a tracker that reports none or only some of them.

`GroupsSoFar` does the work, frame by frame: it does not matter how many frames are added at once, so that a live run is
equal to that of a recording. `with_groups` and `derive` add all frames of a sequence.
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
last frame (`GroupsSoFar.rest`), so that this frame is not causal.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sim.truth.crossing_events import SAME_BEFORE, CrossingFinder
from sim.truth.group_hulls import box_groups, groups_over_time
from sim.truth.merge_split_rules import frames_of
from sim.truth.queue_detection import ADVANCE_TIME, BRIDGE_TIME, QueueFinder
from sim.truth.velocities import RecentChords
from sim.types import EVENT_KINDS, Array, Bools, GroupEvent, Groups, Ints, Tracks
from tracking.grouping.belief_groups import FoundGroups
from tracking.grouping.group_events import REMEMBERED, LabelEvents, TrackedMotion
from tracking.grouping.group_labels import GroupLabels
from tracking.grouping.grouping_choice import Grouping, default_grouping, group_finder
from tracking.grouping.motion_history import MotionHistory, PeopleRows
from tracking.grouping.person_motion import SteadyPlaces
from tracking.grouping.tracks_table import people_rows

# Kinds of events in which the membership of groups changes.
MEMBERSHIP_KINDS = frozenset(EVENT_KINDS) - {"cross", "queue"}
# Places (R, 2), m, of all rows of some tracks.
Places = Callable[[Sequence[Tracks]], Array]
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
    if tracks[0].plane == "image" and not math.isfinite(px_per_m):
        return tuple(with_velocities(tracks, fps))
    return tuple(derive(tracks, fps, px_per_m, rule, objective=objective))


class Velocities:
    """Replaces unknown (nan) velocities of tracks by the mean velocities over the last 0.5 s. State: recent, where
    people were."""

    def __init__(self, fps: float) -> None:
        self.fps, self.recent = fps, dict[int, RecentChords]()

    def add(self, tracks: Sequence[Tracks]) -> list[Tracks]:
        """Returns tracks of the next frames with velocities."""
        dims = {t.pos.shape[1] for t in tracks if len(t.id)}
        if not dims:
            return list(tracks)
        (d,) = dims
        recent = self.recent.setdefault(d, RecentChords(self.fps, d))
        some = [t for t in tracks if len(t.id)]
        count = [len(t.id) for t in some]
        frame, id = np.repeat([t.index for t in some], count), np.concatenate([t.id for t in some])
        found = recent.add(frame, id, np.concatenate([t.pos for t in some]))
        vel = np.concatenate([t.vel for t in some])
        unknown = np.isnan(vel).any(axis=1)
        if not unknown.any():
            return list(tracks)
        parts = iter(np.split(np.where(unknown[:, None], found, vel), np.cumsum(count)[:-1]))
        return [t.replace(vel=next(parts)) if len(t.id) else t for t in tracks]


def with_velocities(tracks: Sequence[Tracks], fps: float) -> list[Tracks]:
    """Returns the tracks of a sequence with `Velocities`."""
    return Velocities(fps).add(tracks)


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

    tracks: of a whole sequence, in order, one per frame from frame 1. The other arguments are as of `GroupsSoFar`.
    Unknown velocities are filled in, too.
    """
    given = list(tracks)
    if not given or any(t.unit == "group" for t in given):
        return given
    groups = GroupsSoFar(fps, px_per_m, rule, objective=objective)
    return groups.ended(groups.add(given))


class GroupsSoFar:
    """Fills in groups and events of tracks, frame by frame.

    If the tracker names groups in its first frame with people, its groups are kept; otherwise the grouping forms all
    groups, and any that the tracker reports later are removed. Events of a kind are derived for the frames before the
    tracker reports this kind itself. Whoever was not seen for 60 to 120 s is forgotten.

    px_per_m: scale of tracks in the image. rule: how people are grouped; None takes the default grouping. objective:
    True leaves out crossings, queues and hulls, which the objective does not need. places: where people are on the
    ground; None: where the tracks say.

    State: end, number of frames; named, whether the tracker names groups, None if that is not known yet; own, the frame
    from which events of a kind are the tracker's; ids, people, and last, the last frame of each; same, whether the
    groups that the tracker names have been those of the grouping so far; the rest as named.
    """

    def __init__(
        self, fps: float, px_per_m: float = 1.0, rule: Grouping | None = None, *, objective: bool = False,
        places: Places | None = None,
    ) -> None:  # fmt: skip
        self.fps, self.px_per_m, self.objective, self.places = fps, px_per_m, objective, places
        self.rule = rule or default_grouping()
        self.end, self.own, self.same, self.scale, self.added = 0, dict[str, int](), True, 1.0, 0
        self.named: bool | None = None
        self.begun = False
        self.ids, self.last = np.zeros((2, 0), np.int64)
        self.finder, self.labels = group_finder(self.rule, fps), GroupLabels(fps, self.rule)
        self.steady, self.changes = SteadyPlaces(fps), LabelEvents()
        self.crossings, self.queues = CrossingFinder(fps), QueueFinder(fps)
        self.history = MotionHistory()
        self.velocities = Velocities(fps)
        self.place_velocities, self.steady_velocities = RecentChords(fps), RecentChords(fps)
        self.block = frames_of(REMEMBERED, fps)

    def add(self, tracks: Sequence[Tracks]) -> list[Tracks]:
        """Returns tracks of the next frames, in order, with groups and events."""
        out, low = list[Tracks](), 0
        while low < len(tracks):
            # people are forgotten at certain frames, however many are added at once
            high = min(len(tracks), low + self.block - self.end % self.block)
            out += self._block(tracks[low:high])
            low = high
            if self.end % self.block == 0:
                self._forget(self.end - self.block)
        return out

    def rest(self) -> tuple[GroupEvent, ...]:
        """Returns the crossings and queues that are reported in the last frame because the recording ends there."""
        if self.objective or not self.end:
            return ()
        found = [*self.crossings.rest(self.history), *self.queues.rest()]
        found = [replace(e, emitted=self.end, pos=self._scaled(e.pos)) for e in found]
        return tuple(e for e in found if self.end < self.own.get(e.kind, math.inf))

    def ended(self, tracks: list[Tracks]) -> list[Tracks]:
        """Returns tracks of which the last are those of the last frame, with all events that end there."""
        more = self.rest()
        if not more:
            return tracks
        last = tracks[-1]
        more = more if self.places is None else moved_events(more, last.id, last.pos)
        own = len(last.events) - self.added
        events = *last.events[:own], *_in_order([*last.events[own:], *more])
        return [*tracks[:-1], last.replace(events=events)]

    def _block(self, tracks: Sequence[Tracks]) -> list[Tracks]:
        tracks = self.velocities.add([self._as_named(t) for t in tracks])
        self.end = tracks[-1].index
        self.scale = self.px_per_m if tracks[0].plane == "image" and self.places is None else 1.0
        rows = people_rows(tracks, self.scale, None if self.places is None else self.places(tracks))
        if self.places is not None:
            rows = replace(rows, vel=self.place_velocities.add(rows.frame, rows.id, rows.pos))
        column = self._columns(rows)
        events = list[GroupEvent]()
        changes = not self.named or self.own.get("merge", math.inf) > 1
        if changes or not self.objective:
            steady, found = self._found(rows, column)
            self.history.add(steady, self.end)
            group = rows.group
            if changes:
                group, events = self._labelled(rows, steady, column, found)
            self.history.label(group)
            rows, steady = replace(rows, group=group), replace(steady, group=group)
            events += [] if self.objective else self._crossings_and_queues(steady)
        events = [e for e in events if (e.emitted or e.start) < self.own.get(e.kind, math.inf)]
        events = [replace(e, pos=self._scaled(e.pos)) for e in events]
        return self._filled(tracks, rows, events)

    def _as_named(self, t: Tracks) -> Tracks:
        """Returns the tracks of the next frame, without groups that the tracker names later than its first people."""
        if not self.begun:
            self.begun, self.own = True, dict.fromkeys(t.own_events, 1)
        for event in t.events:
            self.own.setdefault(event.kind, t.index)
        membership = [frame for kind, frame in self.own.items() if kind in MEMBERSHIP_KINDS]
        self.own |= dict.fromkeys(MEMBERSHIP_KINDS, min(membership)) if membership else {}
        if self.named is None and (len(t.id) or t.groups is not None):
            self.named = _has_groups(t)
        late = not self.named and _has_groups(t)
        return t.replace(group=np.full(len(t.id), -1), groups=None) if late else t

    def _columns(self, rows: PeopleRows) -> Ints:
        """Returns the person of each row, (R,), as a row of `ids`; adds those who are new."""
        new = np.setdiff1d(rows.id, self.ids)
        if len(new):
            every = np.union1d(self.ids, new)
            place = np.searchsorted(self.ids, every)
            self._take_people(np.where(np.append(self.ids, -1)[place] == every, place, -1), every)
        column = np.searchsorted(self.ids, rows.id)
        np.maximum.at(self.last, column, rows.frame)
        return column

    def _take_people(self, rows: Ints, ids: Ints) -> None:
        self.ids, self.last = ids, np.append(self.last, -1)[rows]
        self.finder.take_people(rows)
        self.steady.take(rows)

    def _forget(self, before: int) -> None:
        """Forgets whoever was not seen since a frame."""
        kept = np.flatnonzero(self.last >= before)
        self._take_people(kept, self.ids[kept])
        self.finder.forget(before)
        people = {*self.ids.tolist()}
        self.labels.forget(people)
        self.queues.forget(before)
        self.crossings.forget({*self.labels.shown})
        self.history.forget(min(before, self.crossings.first), people)

    def _found(self, rows: PeopleRows, column: Ints) -> tuple[PeopleRows, FoundGroups]:
        """Returns the rows at the places that are most likely where positions err (only so does a person who stands
        still not come and go), and the groups that the grouping finds."""
        found = self.finder.add(rows, column, self.end)
        if found.steps is None:
            return rows, found
        pos, seen = rows.pos.copy(), rows.seen
        steps = found.steps.seen, found.steps.motion.noise
        pos[seen] = self.steady.add(rows.frame[seen], column[seen], rows.pos[seen], *steps)
        moved = (pos != rows.pos).any(axis=1)
        vel = self.steady_velocities.add(rows.frame, rows.id, pos)
        return replace(rows, pos=pos, vel=np.where(moved[:, None], vel, rows.vel)), found

    def _labelled(
        self, rows: PeopleRows, steady: PeopleRows, column: Ints, found: FoundGroups
    ) -> tuple[Ints, list[GroupEvent]]:
        """Returns the group ids of the rows, and the membership events by the motion of steady places."""
        motion = TrackedMotion(self.history, self.fps)
        group, events = self.labels.add(rows.frame, column, self.ids, motion, found, self.end)
        if not self.named:
            return group, events
        # As long as a tracker's groups equal those of the grouping, the grouping's events are used: their onsets are
        # dated back.
        other = rows.frame[group != rows.group]
        there = np.isfinite(steady.pos).all(axis=1)
        named = steady.frame[there], steady.id[there], rows.group[there]
        changes = self.changes.add(*named, self.history, self.end)
        if not self.same:
            return rows.group, changes
        self.same = not len(other)
        equal = int(other[0]) if len(other) else self.end
        early = [e for e in events if (e.emitted or e.start) <= equal]
        return rows.group, early + [e for e in changes if (e.emitted or e.start) > equal]

    def _crossings_and_queues(self, rows: PeopleRows) -> list[GroupEvent]:
        after = _known_after(self.fps)
        met = self.crossings.add(rows.frame, rows.id, rows.pos, rows.group, self.history, self.end)
        lined = self.queues.add(rows.frame, rows.id, rows.pos, rows.vel, rows.group, self.end)
        return [replace(e, emitted=e.end + after[e.kind]) for e in (*met, *lined)]

    def _filled(self, tracks: Sequence[Tracks], rows: PeopleRows, events: Sequence[GroupEvent]) -> list[Tracks]:
        cuts = np.searchsorted(rows.frame, [t.index - 1 for t in tracks] + [tracks[-1].index])
        by_frame: dict[int, list[GroupEvent]] = {}
        for event in events:
            by_frame.setdefault(event.emitted or event.start, []).append(event)
        labels = []
        for k, t in enumerate(tracks):
            r = slice(int(cuts[k]), int(cuts[k + 1]))
            labels.append(rows.group[r][np.searchsorted(rows.id[r], t.id)])
        every = groups_in_frames(tracks, self.scale, labels, shapes=not self.objective)
        out = []
        for t, own, groups in zip(tracks, labels, every, strict=True):
            new: Sequence[GroupEvent] = _in_order(by_frame.pop(t.index, ()))
            if self.places is not None:
                new = moved_events(new, t.id, t.pos)
            named = t.groups if self.named else None
            out.append(t.replace(group=own, events=(*t.events, *new), groups=named or groups, derived=True))
            self.added = len(new)
        return out

    def _scaled(self, pos: tuple[float, float]) -> tuple[float, float]:
        return pos[0] * self.scale, pos[1] * self.scale


def _in_order(events: Iterable[GroupEvent]) -> list[GroupEvent]:
    return sorted(events, key=lambda e: (e.start, e.end, e.kind, e.members, e.after))


def moved_events(events: Sequence[GroupEvent], id: Ints, pos: Array) -> tuple[GroupEvent, ...]:
    """Returns the events with each `pos` replaced by the mean position of its members in one frame, nan if none is. id
    (N,), pos (N, 2): ids and positions of the people in that frame."""
    return tuple(replace(e, pos=_centre(pos, np.isin(id, e.members))) for e in events)


def _centre(pos: Array, rows: Bools) -> tuple[float, float]:
    x, y = pos[rows].mean(axis=0) if rows.any() else (float("nan"), float("nan"))
    return float(x), float(y)


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
