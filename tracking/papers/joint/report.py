"""What `joint` reports: the state estimate (sec. 4), groups and their ids, and events.

The estimate has means of the individuals and one partition for all particles. Events (ours) follow from groups that
change late: those of the belief about events, with its memory, in which a missed person stays where the person was.
Group ids follow the identity rule of the truth, frame by frame; the estimated groups take over the ids of these.

Onsets of events are dated back by the rules of the truth: a merge or split is reported when the groups change. Its
start is the frame in which the parts came together, or parted, in the past that is known then. Changes that only
correct the groups are no events.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from itertools import combinations

import numpy as np

from sim.truth.group_ids_and_changes import Members, PersonSet
from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Bools, GroupEvent, Groups, Ints
from tracking.grouping.belief import EVENTS, UNSEEN, default_belief
from tracking.grouping.belief_kernels import linked_groups
from tracking.grouping.group_events import SEARCHED, TrackedMotion, corrects, event_of_change
from tracking.grouping.group_labels import LinkedPeople, parts_of_change
from tracking.grouping.motion_history import MotionHistory, PeopleRows
from tracking.grouping.online_belief import PairBelief
from tracking.papers.joint import partition_labels_kernels


def moments(state: Array, weights: Array) -> tuple[Array, Array]:
    """Returns means (K, 4) and covariances (K, 4, 4) of states (N_x, K, 4); weights (N_x, K): sum 1 for each person."""
    mean = np.einsum("ik,ikd->kd", weights, state)
    away = state - mean
    return mean, np.einsum("ik,ikd,ike->kde", weights, away, away)


def histogram_partition(label: Ints, weights: Array) -> list[Ints]:
    """Returns the groups of two or more people by the histogram of Fig. 3: each person has the label of most weight."""
    votes = np.zeros((label.shape[2], label.shape[2]))
    partition_labels_kernels.head_votes(label, weights, votes)
    return groups_of(votes.argmax(axis=1))


def groups_of(label: Ints) -> list[Ints]:
    """Returns the rows of each label (K,) that two or more people carry."""
    found = (np.flatnonzero(label == g) for g in np.unique(label))
    return [rows for rows in found if len(rows) > 1]


# Kinds of events that the tracker reports itself.
OWN_EVENTS = ("merge", "split", "form", "dissolve", "enter", "leave")
CHORD = 0.5  # Time over which velocities are measured, s.


class ReportedEvents:
    """Makes events from changes of groups that change late. State: recent, ids (K,), positions (K, 2), m, and who was
    measured (K,) of the last frames; frames, the last of them, from 1; people, who is present since which frame (from
    0), and their groups; belief, about events, of measured people; evidence, by pair of ids in one group, the sum of
    its log-odds in that time; fps."""

    def __init__(self, fps: float) -> None:
        self.fps, self.frames = fps, 0
        self.recent: deque[tuple[Ints, Array, Bools]] = deque(maxlen=frames_of(SEARCHED, fps) + frames_of(CHORD, fps))
        self.evidence: dict[tuple[int, int], float] = {}
        self.people, self.belief = LinkedPeople(), PairBelief(fps, EVENTS)

    def add(self, index: int, id: Ints, pos: Array, seen: Bools) -> None:
        """Adds frame `index`, from 1: ids (K,), places (K, 2), m, and who was measured (K,) of the people tracked."""
        self.recent.append((id.copy(), pos.copy(), seen))
        self.belief.see(np.where(seen[:, None], pos, np.nan))
        self.people.present = {p: self.people.present.get(p, index - 1) for p in id.tolist()}
        self.frames = index

    def events(self, shown: Members, scale: float) -> tuple[GroupEvent, ...]:
        """Returns the events of the last frame added; their members are ids of people. shown: the groups reported in
        the frame before, whose ids new groups take over. To be called for each frame."""
        id, identities = self.recent[-1][0], self.people.identities
        old, log_odds, seen = identities.groups, self.belief.log_odds, self.belief.seen()
        # new people are judged by their first frame
        known = (seen[:, None] & seen) | (log_odds != UNSEEN)
        lasting = self._lasting(id, np.where(known, log_odds, np.nan))
        changes = identities.step(self.frames, frozenset(id.tolist()), lasting, shown)
        parted = self._parted(identities.groups, np.where(known, log_odds, 0.0))
        changes = [c for c in changes if not corrects(c, parted)]
        if not changes:
            return ()
        motion = self._motion()
        made = (event_of_change(c, self.frames - 1, parts_of_change(c, old, self.people), motion) for c in changes)
        return tuple(replace(e, pos=(e.pos[0] * scale, e.pos[1] * scale)) for e in made if e is not None)

    def _lasting(self, id: Ints, log_odds: Array) -> list[PersonSet]:
        belief, group = default_belief(), np.full((2, len(id)), -1)
        group[0] = known_groups(self.people.identities.groups, id)
        # the memory decides of people who are missed: what cannot be seen changes nothing
        value = np.where(np.isnan(log_odds), belief.neutral, log_odds)
        a, b = map(np.ascontiguousarray, np.nonzero(np.triu(value != UNSEEN, 1)))  # else one pair is another type
        linked_groups(
            np.array([0, 0, len(a)]), a, b, value[a, b], UNSEEN, belief.stay, belief.come, belief.nearest, group
        )
        return [frozenset(id[group[1] == g].tolist()) for g in np.unique(group[1][group[1] >= 0])]

    def _parted(self, groups: Members, log_odds: Array) -> dict[PersonSet, bool]:
        row = {person: k for k, person in enumerate(self.recent[-1][0].tolist())}
        before, pairs = self.evidence, [p for people in groups.values() for p in combinations(sorted(people), 2)]
        self.evidence = {(a, b): before.get((a, b), 0.0) + float(log_odds[row[a], row[b]]) for a, b in pairs}
        return {frozenset(pair): before[pair] > 0 for pair in before.keys() - self.evidence.keys()}

    def _motion(self) -> TrackedMotion:
        """Returns the motion of the last frames, with ids as columns."""
        first, chord = self.frames - len(self.recent), frames_of(CHORD, self.fps)
        frame = np.repeat(np.arange(first, self.frames), [len(id) for id, _, _ in self.recent])
        id, pos, seen = (np.concatenate(part) for part in zip(*self.recent, strict=True))
        order = np.lexsort((frame, id))
        frame, id, pos, seen = frame[order], id[order], pos[order], seen[order]
        key, vel = id * self.frames + frame, np.full_like(pos, np.nan)
        before = np.searchsorted(key, key - chord)
        known = (frame >= first + chord) & (key[before] == key - chord)
        vel[known] = (pos[known] - pos[before[known]]) * self.fps / chord
        order = np.lexsort((id, frame))
        rows = PeopleRows(frame, id, pos, vel, np.full(len(id), -1), seen).take(order)
        history = MotionHistory(end=first)
        history.add(rows, self.frames)
        return TrackedMotion(history, self.fps)


def known_groups(groups: Members, ids: Ints) -> Ints:
    """Returns the id of each person's group, (N,), -1 for a person alone; ids (N,)."""
    group_of = {person: group for group, people in groups.items() for person in people}
    return np.array([group_of.get(person, -1) for person in ids.tolist()], np.int64)


def no_groups(group: Ints) -> Groups | None:
    """Returns empty `Groups` if nobody is in a group; else None, so that groups are derived from the group ids."""
    return Groups.none() if (group < 0).all() else None
