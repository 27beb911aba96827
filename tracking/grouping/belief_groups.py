"""Consistent groups from beliefs of pairs, by linkage.

The two groups (or people) that are worth most together are joined, as long as that is above 0: the weighted mean of two
means, over all their pairs, and over their people of the best pair with the other group. So a chain of strangers is no
group, and a group whose ends are far apart is one. Groups of *now* take a pair's probability minus the belief's
threshold, groups of *events* its log-odds; both with a memory of the step before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from sim.truth.merge_split_rules import frames_of, runs, stretches
from sim.types import Array, Ints
from tracking.grouping.belief import UNSEEN, Belief
from tracking.grouping.group_events import SEARCHED
from tracking.grouping.link_rule import CELLS, Links
from tracking.grouping.motion_history import PeopleRows
from tracking.grouping.pair_beliefs import BeliefHistory, PairBeliefs, StepBeliefs
from tracking.grouping.person_motion import new_places, taken


@dataclass(frozen=True, slots=True, eq=False)
class StepGroups:
    """The groups of steps, one row per step and person in a group, sorted by step, then person."""

    # step, person (R,), from 0; group (R,): the lowest person of the person's group
    step: Ints
    person: Ints
    group: Ints


@dataclass(frozen=True, slots=True, eq=False)
class FoundGroups:
    """Who belongs together in some frames: the switches of links between people, from which events follow, and the
    groups now, which begin with those of the step before; None: as linked."""

    links: Links
    now: StepGroups | None = None
    steps: StepBeliefs | None = None  # from which they follow, if they follow from a belief


class StepGrouping:
    """Finds the groups of each step by linkage. unseen: value of pairs without a row. stay is added to the value of a
    pair that was in one group in the step before, come is subtracted from the value of any other pair. nearest: weight
    of the best pairs. State: label (K,), the lowest person of each person's group in the last step, -1 alone."""

    def __init__(self, unseen: float, stay: float = 0.0, come: float = 0.0, nearest: float = 0.0) -> None:
        self.numbers, self.label = (unseen, stay, come, nearest), np.zeros(0, np.int64)

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, who keep their order: person k becomes who was person rows[k], or somebody new if
        rows[k] is -1."""
        self.label = new_places(rows, len(self.label))[taken(self.label, rows, -1)]

    def add(self, first: int, end: int, step: Ints, a: Ints, b: Ints, values: Array) -> StepGroups:
        """Returns the groups of the steps first … end - 1, and, to begin with, of the step before. step, a, b, values
        (R,): one row per pair (a, b) and step, step ascending."""
        from tracking.grouping.belief_kernels import linked_groups

        people = len(self.label)
        cut, found = np.searchsorted(step, np.arange(first, end + 1)), [self.last(first - 1)]
        size = max(1, CELLS // max(people, 1))
        for low in range(0, end - first, size):
            # the first row is the step before, which has no rows of pairs here
            ends = cut[low : low + size + 1]
            label = np.full((len(ends), people), -1)
            label[0] = self.label
            linked_groups(np.append(ends[0], ends), a, b, values, *self.numbers, label)
            found.append(_in_groups(first + low, label[1:]))
            self.label = label[-1]
        parts = ((g.step, g.person, g.group) for g in found)
        return StepGroups(*(np.concatenate(x) for x in zip(*parts, strict=True)))

    def last(self, step: int) -> StepGroups:
        """Returns the groups of the last step, which has the number `step`."""
        return _in_groups(step, self.label[None])


def _in_groups(first: int, label: Ints) -> StepGroups:
    at, person = np.nonzero(label >= 0)
    return StepGroups(at + first, person, label[at, person])


class BeliefGroups:
    """Finds the groups of frames by a belief. Any two members of a group from which events follow are linked.

    State: history, of the beliefs; now, lasting: the groups from which people's labels and events follow; links.
    """

    def __init__(self, fps: float, belief: Belief) -> None:
        self.belief, self.history = belief, BeliefHistory(fps, belief)
        unseen = float(belief.together(np.array(UNSEEN), np.array(0.0)))
        self.now = StepGrouping(unseen, belief.hold, belief.join, belief.nearest)
        self.lasting = StepGrouping(UNSEEN, belief.stay, belief.come, belief.nearest)
        self.links = _LinkedPairs(frames_of(SEARCHED * fps / self.history.size, 1.0), self.history.size)

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, as `PairHistory.take_people`."""
        for state in (self.history, self.now, self.lasting, self.links):
            state.take_people(rows)

    def forget(self, before: int) -> None:
        """Forgets the pairs of people who were last near each other before a frame."""
        self.history.pairs.forget(before // self.history.size)

    def add(self, rows: PeopleRows, column: Ints, end: int) -> FoundGroups:
        """Adds the frames up to `end`, and returns the groups of the steps that are complete now. column (R,): the
        person of each row, from 0."""
        steps, belief = self.history.add(rows.frame, column, rows.pos, rows.seen, end), self.belief
        if steps.first == steps.end:
            return FoundGroups(Links.none(), self.now.last(steps.first - 1), steps)
        found = steps.pairs
        # What cannot be seen changes nothing: such pairs are linked if they were in one group in the step before.
        log_odds = np.where(found.missed, belief.neutral, found.log_odds[:, 1])
        pairs = steps.first, steps.end, found.step, found.a, found.b
        now = self.now.add(*pairs, belief.together(found.log_odds[:, 0], found.noise))
        lasting = self.lasting.add(*pairs, log_odds)
        return FoundGroups(self.links.add(lasting, steps), now, steps)


class _LinkedPairs:
    """Which pairs are linked: any two people of one group. searched: steps in which people must have been apart before
    they were linked. size: frames in a step.

    State: a, b (L,), the linked pairs, sorted; total (L,), sums of their log-odds since they are; recent, rows of
    beliefs, and seen (R, 2), step and person, of the steps searched.
    """

    def __init__(self, searched: int, size: int) -> None:
        self.searched, self.size, self.people = searched, size, 0
        self.a, self.b = np.zeros((2, 0), np.int64)
        self.total, self.recent, self.seen = np.zeros(0), list[PairBeliefs](), np.zeros((0, 2), np.int64)

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, as `PairHistory.take_people`."""
        place = new_places(rows, self.people)
        self.people = len(rows)
        there = (place[self.a] >= 0) & (place[self.b] >= 0)
        self.a, self.b, self.total = place[self.a[there]], place[self.b[there]], self.total[there]
        self.recent = [replace(r, a=place[r.a], b=place[r.b]) for r in self.recent]
        self.recent = [r.take((r.a >= 0) & (r.b >= 0)) for r in self.recent]
        self.seen = np.column_stack([self.seen[:, 0], place[self.seen[:, 1]]])
        self.seen = self.seen[self.seen[:, 1] >= 0]

    def add(self, label: StepGroups, steps: StepBeliefs) -> Links:
        """Returns the switches of links in some steps. label: their groups, and those of the step before.

        A removal is sure if the pair's log-odds, summed over the time of the link, are positive; a link if they were
        negative before, summed over as many steps as are searched, or the two were too far apart for evidence.
        """
        people, first, end = self.people, steps.first, steps.end
        self.recent.append(steps.pairs.take(~steps.pairs.missed))
        self.seen = np.concatenate([self.seen, np.column_stack([steps.seen.step, steps.seen.column])])
        both, t = _pairs_in_groups(label, people)
        both, begin, last = stretches(both, t, 1)
        on, off = begin >= first, last + 1 < end
        rows = [np.concatenate([getattr(r, name) for r in self.recent]) for name in ("step", "a", "b")]
        step, key = rows[0], rows[1] * people + rows[2]
        log_odds = np.concatenate([r.log_odds for r in self.recent])[:, 1]
        order = np.lexsort((step, key))
        key, log_odds = key[order] * (end + 1) + step[order], log_odds[order]
        low, high = (np.searchsorted(key, both * (end + 1) + at) for at in (np.maximum(begin, first), last + 1))
        linked = self.a * people + self.b
        before = np.where(on, 0.0, np.append(self.total, 0.0)[np.searchsorted(linked, both)])
        total = _sums(before, log_odds, low, high)
        since = np.maximum(begin - self.searched, 0)
        low, high = (np.searchsorted(key, both * (end + 1) + at) for at in (since, begin))
        k, at = runs(since, np.where(on, begin, since))
        where = np.sort(self.seen[:, 1] * (end + 1) + self.seen[:, 0])
        there = np.isin(both[k] // people * (end + 1) + at, where) & np.isin(both[k] % people * (end + 1) + at, where)
        met = np.bincount(k, there, len(both)) > high - low  # also where they had no row
        sure_on = met | (_sums(np.zeros(len(both)), log_odds, low, np.where(on, high, low)) < 0)
        self.a, self.b = divmod(both[~off], max(people, 1))
        self.total = total[~off]
        self.recent = [r.take(r.step >= end - self.searched) for r in self.recent]
        self.recent = [r for r in self.recent if len(r.step)]
        self.seen = self.seen[self.seen[:, 0] >= end - self.searched]
        t, pair = np.concatenate([begin[on], last[off] + 1]), np.concatenate([both[on], both[off]])
        sure = np.concatenate([sure_on[on], total[off] > 0])
        set_ = np.arange(len(t)) < int(on.sum())
        order = np.lexsort((pair, t))
        t, pair = t[order], pair[order]
        return Links(t * self.size, pair // max(people, 1), pair % max(people, 1), set_[order], sure[order])


def _pairs_in_groups(label: StepGroups, people: int) -> tuple[Ints, Ints]:
    """Returns key and step of any two people of one group in each step, sorted."""
    group = label.step * people + label.group
    order = np.argsort(group, kind="stable")
    t, person, group = label.step[order], label.person[order], group[order]
    i, j = runs(np.arange(len(group)) + 1, np.searchsorted(group, group, side="right"))
    both, when = np.minimum(person[i], person[j]) * people + np.maximum(person[i], person[j]), t[i]
    order = np.lexsort((when, both))
    return both[order], when[order]


def _sums(start: Array, values: Array, low: Ints, high: Ints) -> Array:
    """Returns start (K,) plus the sums of values[low:high], added one after another, so that it does not matter in how
    many calls they are."""
    k, at = runs(low, high)
    rows = np.concatenate([np.arange(len(start)), k])
    order = np.argsort(rows, kind="stable")
    return np.asarray(np.bincount(rows[order], np.concatenate([start, values[at]])[order], len(start)), float)
