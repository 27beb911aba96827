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
    """What is measured of the groups in a motion of T frames and P people."""

    group: Ints  # (T, P) id of each person's group, from 1; -1 for a person who is alone or absent
    # merge, split, form, dissolve, enter and leave, in order of the frame in which the group changed; () if none
    events: tuple[GroupEvent, ...]
    # pairs of people who satisfy the merge rule (less than 1.5 m apart, velocities differing by less than 0.5 m/s, for
    # 2 s) but are strangers (hard negatives)
    near: Near


def groups_and_events(pos: Array, vel: Array, present: Bools, intent: Ints, fps: float) -> GroupsAndEvents:
    """Returns the group ids, the events (all kinds but cross and queue) and the near strangers of a motion.

    pos, vel (T, P, 2): m, m/s, nan while absent. present (T, P). intent (T, P): the group a person is meant to belong
    to, -1 while absent. Frames of events count from 1, a person's id is the column + 1. A merge, split, form or
    dissolve starts in the first frame in which its rule holds, and ends when it has held for HOLD_TIME. An enter lies
    in the group's first frame, a leave in the last frame before the change.
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
    start = t if change.kind == "leave" else t + 1
    end = start if change.kind in ("enter", "leave") else start + hold - 1
    x, y = mean_of_present(pos[start - 1 : start, list(change.members)])[0]
    people = tuple(p + 1 for p in change.members)
    return GroupEvent(change.kind, start, end, None, change.before, change.after, people, (float(x), float(y)))
