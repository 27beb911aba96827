"""Makes the merge, split, form, dissolve, enter and leave events of a crowd, and the group id of each person."""

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
    """group (T, P): id from 1, -1 alone or absent. events: all kinds but cross and queue. near: strangers."""

    group: Ints
    events: tuple[GroupEvent, ...]
    near: Near


def groups_and_events(pos: Array, vel: Array, present: Bools, intent: Ints, fps: float) -> GroupsAndEvents:
    """Truth of groups; pos, vel (T, P, 2) nan where absent, intent (T, P) -1 where absent. Person id is column + 1.

    An event starts at its onset and ends when its rule has come true. Groups that are there in frame 1 do not enter.
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
    """The event of a change at t (from 0), where its people are; who left was last there one frame before."""
    start = t if change.kind == "leave" else t + 1
    end = start if change.kind in ("enter", "leave") else start + hold - 1
    x, y = mean_of_present(pos[start - 1 : start, list(change.members)])[0]
    people = tuple(p + 1 for p in change.members)
    return GroupEvent(change.kind, start, end, None, change.before, change.after, people, (float(x), float(y)))
