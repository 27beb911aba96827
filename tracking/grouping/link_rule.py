"""The baseline rule that links two tracked people into one group: distance, velocity difference, share of time.

A pair is linked once it has been near, with like velocities, in at least the share `share` of the frames of the last
`window` s in which both were seen. The link breaks once the pair has been apart for `patience` s. The rule never looks
ahead. `LinkRule` holds the parameters, `find_links` returns the switches of all links of a sequence. Constants that are
also the truth's merge and split rule come from sim.truth.merge_split_rules.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sim.truth.merge_split_rules import (
    HOLD_TIME,
    MERGE_DISTANCE,
    MERGE_VELOCITY,
    SPLIT_DISTANCE,
    close_pairs,
    frames_of,
    runs,
)
from sim.types import Array, Bools, Ints
from tracking.config import Config, param
from tracking.grouping.person_motion import new_places

CELLS = 1_000_000  # Numbers worked on together: bounds memory.


@dataclass(frozen=True)
class LinkRule(Config):
    """Parameters of the baseline rule that links two people: distance, velocity difference and times.

    It is a Config: it is read from TOML files and searched like a tracker's.
    """

    tracker: ClassVar[str] = "grouping"

    # fmt: off
    near: float = param(MERGE_DISTANCE, (0.5, 3.0), "m", "a pair nearer than this is near")
    alike: float = param(MERGE_VELOCITY, (0.1, 2.0), "m/s", "a pair whose velocities differ by less moves alike")
    share: float = param(0.8, (0.3, 1.0), "share",
        "a pair is linked if it was near and moved alike in this share of the frames of `window` with both seen")
    window: float = param(HOLD_TIME, (0.2, 6.0), "s", "time over which the share is counted")
    acquaintance: float = param(1.0, (0.0, 6.0), "s",
        "least time within the window in which both must have been seen before they can be linked")
    apart: float = param(SPLIT_DISTANCE, (0.5, 5.0), "m", "a pair farther than this is apart")
    patience: float = param(HOLD_TIME, (0.1, 6.0), "s", "time apart after which a link breaks")
    idle: float = param(0.0, (0.0, 1.0), "m/s",
        "two people who are both slower than this are not near; 0: standing people can be linked")
    memory: float = param(1.0, (0.0, 5.0), "s", "time for which a member that is missed stays in the group")
    # fmt: on


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """All switches of links (setting or removing one) of a sequence: L rows, sorted by frame, then pair."""

    frame: Ints  # (L,): in which the link is switched, from 0
    # a, b (L,): numbers of the two people, from 0, a < b: indices of their ids in the sorted ids of the sequence
    a: Ints
    b: Ints
    on: Bools  # (L,): True if the link is set, False if it is removed
    # sure (L,): False if a link is removed against which its evidence speaks, all in all: the two were never together
    sure: Bools

    @classmethod
    def none(cls) -> Links:
        """Returns no switches."""
        whole, flags = np.zeros(0, np.int64), np.zeros(0, bool)
        return cls(whole, whole, whole, flags, flags)


class RuleLinks:
    """Finds the links between people by the rule, frame by frame.

    State: a, b (L,): the pairs that are linked, sorted; frame, column, pos, vel: rows of the times that the rule looks
    back. People are numbers, which `take_people` changes.
    """

    def __init__(self, fps: float, rule: LinkRule) -> None:
        self.fps, self.rule, self.people, self.end = fps, rule, 0, 0
        self.back = max(frames_of(rule.window, fps), frames_of(rule.patience, fps))
        self.a, self.b = np.zeros((2, 0), np.int64)
        self.frame, self.column = np.zeros((2, 0), np.int64)
        self.pos, self.vel = np.zeros((2, 0, 2))

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people, who keep their order: person k becomes who was person rows[k], or somebody new if
        rows[k] is -1."""
        place = new_places(rows, self.people)
        self.people, self.column = len(rows), place[self.column]
        there = (place[self.a] >= 0) & (place[self.b] >= 0)
        self.a, self.b = place[self.a[there]], place[self.b[there]]

    def add(self, frame: Ints, column: Ints, pos: Array, vel: Array, end: int) -> Links:
        """Adds the frames up to `end`, and returns all switches of links in them. frame, column (R,), from 0, pos, vel
        (R, 2), m, m/s: one row per person and frame, frame sorted. A pair with an unknown (nan) velocity counts as
        moving alike."""
        rule, fps, people, first = self.rule, self.fps, max(self.people, 1), self.end
        frame, column = np.append(self.frame, frame), np.append(self.column, column)
        pos, vel = np.concatenate([self.pos, pos]), np.concatenate([self.vel, vel])
        i, j = close_pairs(frame, pos, max(rule.apart, rule.near))
        swap = column[i] > column[j]
        i, j = np.where(swap, j, i), np.where(swap, i, j)
        distance = np.hypot(*(pos[i] - pos[j]).T)
        differ = np.hypot(*(vel[i] - vel[j]).T)
        near = (distance < rule.near) & ~(differ >= rule.alike)  # true where nan: a velocity is unknown
        speed = np.hypot(*vel.T)
        near &= ~(np.maximum(speed[i], speed[j]) < rule.idle)
        # keys of two pairs, or two people, are further apart than the times of the rule
        span = end + self.back
        key = (column[i] * people + column[j]) * span + frame[i]
        together, within = np.sort(key[near]), np.sort(key[distance <= rule.apart])
        linked = self.a * people + self.b
        pairs = np.union1d(together // span, linked)
        # only those can be linked or parted who are both seen
        found = [
            _switches(both, _among(together, both), ~_among(within, both), span, fps, rule, first, linked)
            for both in _both_seen(pairs, np.sort(column * span + frame), people, span)
        ]
        key, on = (np.concatenate(x) for x in zip((np.zeros(0, np.int64), np.zeros(0, bool)), *found, strict=True))
        pair, t = key // span, key % span
        order = np.lexsort((pair, t))
        t, pair, on = t[order], pair[order], on[order]
        latest = np.unique(pair[::-1], return_index=True)
        ended = latest[0][~on[::-1][latest[1]]]
        linked = np.setdiff1d(np.union1d(linked, latest[0]), ended)
        self.a, self.b = divmod(linked, people)
        late = frame >= end - self.back
        self.frame, self.column, self.pos, self.vel, self.end = frame[late], column[late], pos[late], vel[late], end
        return Links(t, pair // people, pair % people, on.astype(bool), np.ones(len(t), bool))


def _both_seen(pairs: Ints, seen: Ints, people: int, span: int) -> Iterator[Ints]:
    """Yields the keys, pair * span + frame, of all frames in which both of a pair were seen, in portions of whole
    pairs. seen (R,): person * span + frame of each row, ascending."""
    a, b = pairs // people, pairs % people
    low_a, low_b = (np.searchsorted(seen, p * span) for p in (a, b))
    high_a, high_b = (np.searchsorted(seen, (p + 1) * span) for p in (a, b))
    there = (low_a < high_a) & (low_b < high_b)
    pairs, a, b = pairs[there], a[there], b[there]
    begin = np.maximum(seen[low_a[there]] % span, seen[low_b[there]] % span)
    end = np.minimum(seen[high_a[there] - 1] % span, seen[high_b[there] - 1] % span)
    low, high = np.searchsorted(seen, a * span + begin), np.searchsorted(seen, a * span + end, side="right")
    portion = np.cumsum(high - low) // CELLS
    for some in np.split(np.arange(len(pairs)), np.flatnonzero(np.diff(portion)) + 1):
        k, at = runs(low[some], high[some])
        k, frame = some[k], seen[at] % span
        both = _among(seen, b[k] * span + frame)
        yield pairs[k[both]] * span + frame[both]


def _among(values: Ints, wanted: Ints) -> Bools:
    """Returns which wanted values (Q,) are among `values`, which ascend."""
    return np.asarray(np.append(values, -1)[np.searchsorted(values, wanted)] == wanted)


def _switches(
    key: Ints, near: Bools, far: Bools, span: int, fps: float, rule: LinkRule, first: int, linked: Ints
) -> tuple[Ints, Bools]:
    """Returns key and on of the switches (S,) of pairs from frame `first` on. key (Q,): of each pair and frame in which
    both were seen, ascending; near, far (Q,): whether the pair is near and moves alike, and whether it is apart.
    linked: the pairs that are linked before."""
    window, patience = frames_of(rule.window, fps), frames_of(rule.patience, fps)
    seen, alike = _recent(key, np.ones_like(near), window), _recent(key, near, window)
    on = (seen >= min(frames_of(rule.acquaintance, fps), window)) & (alike >= rule.share * seen) & (alike > 0)
    off = _recent(key, far, patience) >= patience
    late = key % span >= first
    key, on, off = key[late], on[late], off[late]
    row, new = np.arange(len(key)), np.diff(key // span, prepend=-1) != 0
    last = np.maximum.accumulate(np.where(on | off | new, row, 0))
    before = _among(linked, key // span)
    # of a pair's first row, without a switch, the state before holds
    value = np.where(on, True, np.where(off, False, new & before))
    state = value[last]
    former = np.where(new, before, np.append(False, state)[:-1])
    changed = state != former
    return key[changed], state[changed]


def _recent(key: Ints, flags: Bools, frames: int) -> Ints:
    """Returns the number (Q,) of True flags among the last `frames` frames of each pair up to each row."""
    total = np.append(0, np.cumsum(flags))
    return np.asarray(total[1:] - total[np.searchsorted(key, key - frames, side="right")])
