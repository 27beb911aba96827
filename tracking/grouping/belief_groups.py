"""Consistent groups from beliefs of pairs, by linkage.

The two groups (or people) that are worth most together are joined, as long as that is above 0: the weighted mean of two
means, over all their pairs, and over their people of the best pair with the other group. So a chain of strangers is no
group, and a group whose ends are far apart is one. Groups of *now* take a pair's probability minus the belief's
threshold, groups of *events* its log-odds; both with a memory of the step before.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.truth.merge_split_rules import frames_of, runs, stretches
from sim.types import Array, Bools, Ints
from tracking.grouping.belief import UNSEEN, Belief, PairBeliefs, beliefs_of_tracks
from tracking.grouping.group_events import SEARCHED
from tracking.grouping.link_rule import CELLS, Links
from tracking.grouping.person_motion import StepRows, frames_per_step, step_rows


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
    come: float = 0.0, nearest: float = 0.0,
) -> StepGroups:  # fmt: skip
    """Returns the groups of each step.

    step, a, b, values (R,): one row per pair (a, b) and step, step ascending; pairs without a row have the value
    `unseen`. stay is added to the value of a pair that was in one group in the step before, come is subtracted from
    the value of any other pair. nearest: weight of the best pairs.
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
        linked_groups(np.append(ends[0], ends), a, b, values, unseen, stay, come, nearest, label)
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
    unseen = float(belief.together(np.array(UNSEEN), np.array(0.0)))
    now = groups_of_steps(shape, *pairs, gain, unseen, belief.hold, belief.join, belief.nearest)
    lasting = groups_of_steps(shape, *pairs, log_odds, UNSEEN, belief.stay, belief.come, belief.nearest)
    rows = slice(None) if measured is None else measured
    seen, searched = step_rows(frame[rows], column[rows], pos[rows], length, fps), frames_of(SEARCHED * fps / size, 1.0)
    return FoundGroups(_links(lasting, size, found.take(~found.missed), seen, searched), now, size)


def _links(label: StepGroups, size: int, found: PairBeliefs, seen: StepRows, searched: int) -> Links:
    """Returns all switches of links: any two people of one group are linked. A removal is sure if the pair's log-odds,
    summed over the time of the link, are positive; a link if they were negative before, summed over as many steps as
    are searched, or the two were too far apart for evidence."""
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
    since = np.maximum(first - searched, 0)
    before, begin, end = (np.searchsorted(row, both * steps + at) for at in (since, first, last + 1))
    where = np.sort(seen.column * steps + seen.step)
    k, at = runs(since, first)
    there = np.isin(both[k] // people * steps + at, where) & np.isin(both[k] % people * steps + at, where)
    met = np.bincount(k, there, len(both)) > begin - before  # also where they had no row
    ends = last + 1 < steps
    t, both = np.concatenate([first, last[ends] + 1]), np.concatenate([both, both[ends]])
    on = np.arange(len(t)) < len(first)
    sure = np.append(met | (total[begin] < total[before]), (total[end] > total[begin])[ends])
    order = np.lexsort((both, t))
    t, both = t[order], both[order]
    return Links(t * size, both // people, both % people, on[order], sure[order])
