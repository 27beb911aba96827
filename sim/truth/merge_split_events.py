"""Makes the merge, split, form, dissolve, enter and leave events of a crowd, and the group id of each person.

It takes positions, velocities and intent (the group that the script means a person to belong to). Steps:
sim.truth.group_membership says who is together in each frame, sim.truth.identity which group keeps its id and what kind
of event a change is. Crossings and queues: sim.truth.crossing_events, sim.truth.queue_detection.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.truth.group_membership import partitions
from sim.truth.identity import GroupChange, Identities
from sim.truth.merge_split_rules import HOLD_TIME, frames_of, mean_of_present
from sim.truth.proximity import strangers
from sim.types import Array, Bools, GroupEvent, Ints, Near


@dataclass(frozen=True, slots=True, eq=False)
class GroupsAndEvents:
    """What is measured of the groups in a motion of T frames and P people.

    - group (T, P): id of each person's group, from 1; -1 for a person who is alone or absent.
    - events: merge, split, form, dissolve, enter and leave, in order of the frame in which the group changed; () if
      none.
    - near: pairs of people who satisfy the merge rule (less than 1.5 m apart, velocities differing by less than 0.5
      m/s, for 2 s) but are strangers (hard negatives).
    """

    group: Ints
    events: tuple[GroupEvent, ...]
    near: Near


def groups_and_events(pos: Array, vel: Array, present: Bools, intent: Ints, fps: float) -> GroupsAndEvents:
    """Returns the group ids, the events (all kinds but cross and queue) and the near strangers of a motion.

    pos, vel (T, P, 2): m, m/s. present (T, P): flags. intent (T, P): index of the group a person is meant to belong to.
    pos and vel are nan, intent is -1 where a person is absent. fps: frames per s. The id of a person is the column + 1;
    frames of events count from 1. Without frames there are no events.

    A merge, split, form or dissolve event starts in the first frame in which its rule holds, and ends when the rule has
    held for HOLD_TIME (2 s). Rules: together if less than 1.5 m apart with velocities differing by less than 0.5 m/s;
    apart if beyond 2.5 m, or 1.5 m with a difference above 0.7 m/s. An enter event lies in the group's first frame, a
    leave event in the last frame before the change. Groups that are there in frame 1 have no enter event.
    """
    group = np.full(present.shape, -1, np.int64)
    identities, events = Identities(), []
    hold = frames_of(HOLD_TIME, fps)
    steps = [*partitions(pos, vel, present, intent, fps), (len(present), [])]
    for (t, parts), (until, _) in pairwise(steps):
        here = frozenset(np.flatnonzero(present[t]).tolist())
        changes = identities.step(t, here, parts)
        for g, people in identities.groups.items():
            group[t:until, sorted(people)] = g
        events += [_event(c, t, hold, pos) for c in changes if t > 0]
    return GroupsAndEvents(group, tuple(events), strangers(pos, vel, present, intent, group, fps))


def _event(change: GroupChange, t: int, hold: int, pos: Array) -> GroupEvent:
    """Returns the event of a change in frame t, which counts from 0; `members` of the change are columns (person id -
    1).

    Frames of the event count from 1. A leave is in the last frame before t, all other kinds start in t. hold: length in
    frames of all kinds but enter and leave (one frame). pos (T, P, 2): m, nan while absent. The event's position is the
    mean of its people who are present in its first frame; nan if none is.
    """
    start = t if change.kind == "leave" else t + 1
    end = start if change.kind in ("enter", "leave") else start + hold - 1
    x, y = mean_of_present(pos[start - 1 : start, list(change.members)])[0]
    people = tuple(p + 1 for p in change.members)
    return GroupEvent(change.kind, start, end, None, change.before, change.after, people, (float(x), float(y)))
