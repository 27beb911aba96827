"""Consistent groups from beliefs of pairs, by average linkage.

The two groups (or people) with the highest mean over their pairs are joined, as long as it is above 0. So a chain of
strangers is no group, and a group whose ends are far apart is one. Groups of *now* take a pair's probability minus the
belief's threshold, groups of *events* its log-odds; both with a memory of the step before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.truth.merge_split_rules import runs, stretches
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import UNSEEN, Belief, PairBeliefs, beliefs_of_tracks
from tracking.grouping.link_rule import CELLS, Links
from tracking.grouping.person_motion import frames_per_step


@dataclass(frozen=True, slots=True, eq=False)
class FoundGroups:
    """Who belongs together in a sequence: the links between people, from which events follow, and the groups now."""

    links: Links
    now: StepGroups | None = None  # by step of `size` frames; None: as linked
    size: int = 1


@dataclass(frozen=True, slots=True, eq=False)
class StepGroups:
    """The groups of S steps and P people, one row per step and person in a group, sorted by step, then person."""

    shape: tuple[int, int]  # S, P
    # step, person (R,), from 0; group (R,): the lowest person of the person's group
    step: Ints
    person: Ints
    group: Ints

    def of(self, step: Ints, person: Ints) -> Ints:
        """Returns the group of people in steps, -1 for people alone; arrays of one shape."""
        key, wanted = self.step * self.shape[1] + self.person, step * self.shape[1] + person
        row = np.searchsorted(key, wanted)
        return np.where(np.append(key, -1)[row] == wanted, np.append(self.group, -1)[row], -1)


def groups_of_steps(
    shape: tuple[int, int], step: Ints, a: Ints, b: Ints, values: Array, unseen: float, stay: float = 0.0,
    come: float = 0.0,
) -> StepGroups:  # fmt: skip
    """Returns the groups of each step.

    step, a, b, values (R,): one row per pair (a, b) and step, step ascending; pairs without a row have the value
    `unseen`. stay is added to the value of a pair that was in one group in the step before, come is subtracted from
    the value of any other pair.
    """
    from tracking.grouping.belief_kernels import linked_groups

    steps, people = shape
    cut, found = np.searchsorted(step, np.arange(steps + 1)), []
    size, before = max(1, CELLS // max(people, 1)), np.full(people, -1)
    for low in range(0, steps, size):
        # the first row is the step before, which has no rows of pairs here
        ends = cut[low : low + size + 1]
        label = np.full((len(ends), people), -1)
        label[0] = before
        linked_groups(np.append(ends[0], ends), a, b, values, unseen, stay, come, label)
        at, person = np.nonzero(label[1:] >= 0)
        found.append((at + low, person, label[at + 1, person]))
        before = label[-1]
    return StepGroups(shape, *(np.concatenate([np.zeros(0, np.int64), *x]) for x in zip(*found, strict=True)))


def belief_groups(
    frame: Ints, column: Ints, pos: Array, length: int, fps: float, belief: Belief, measured: Bools | None = None
) -> FoundGroups:
    """Returns the groups of a sequence of `length` frames by a belief.

    frame, column (R,), from 0, pos (R, 2), m: one row per person and frame. measured (R,): False in rows of people who
    are predicted only, which are no evidence; None: all are measured. Any two members of a group from which events
    follow are linked.
    """
    size = frames_per_step(fps)
    shape = (-(-length // size), int(column.max(initial=0)) + 1)
    found = beliefs_of_tracks(frame, column, pos, length, fps, belief, measured)
    # What cannot be seen changes nothing: such pairs are linked if they were in one group in the step before.
    log_odds = np.where(found.missed, belief.neutral, found.log_odds[:, 1])
    pairs = (found.step, found.a, found.b)
    gain = belief.together(found.log_odds[:, 0], found.noise)
    now = groups_of_steps(
        shape, *pairs, gain, float(belief.together(np.array(UNSEEN), np.array(0.0))), belief.hold, belief.join
    )
    lasting = groups_of_steps(shape, *pairs, log_odds, UNSEEN, belief.stay, belief.come)
    return FoundGroups(_links(lasting, size, found.take(~found.missed)), now, size)


def _links(label: StepGroups, size: int, found: PairBeliefs) -> Links:
    """Returns all switches of links: any two people of one group are linked. A removal is sure if the pair's log-odds,
    summed over the time of the link, are positive."""
    steps, people = label.shape
    group = label.step * people + label.group
    order = np.argsort(group, kind="stable")
    t, person, group = label.step[order], label.person[order], group[order]
    i, j = runs(np.arange(len(group)) + 1, np.searchsorted(group, group, side="right"))
    low, high = np.minimum(person[i], person[j]), np.maximum(person[i], person[j])
    both, when = low * people + high, t[i]
    order = np.lexsort((when, both))
    both, first, last = stretches(both[order], when[order], 1)
    row = (found.a * people + found.b) * steps + found.step
    order = np.argsort(row)
    total, row = np.append(0.0, np.cumsum(found.log_odds[order, 1])), row[order]
    begin, end = (np.searchsorted(row, both * steps + at) for at in (first, last + 1))
    ends = last + 1 < steps
    t, both = np.concatenate([first, last[ends] + 1]), np.concatenate([both, both[ends]])
    on = np.arange(len(t)) < len(first)
    sure = np.append(on[: len(first)], (total[end] > total[begin])[ends])
    order = np.lexsort((both, t))
    t, both = t[order], both[order]
    return Links(t * size, both // people, both % people, on[order], sure[order])
