"""The baseline rule that links two tracked people into one group: distance, velocity difference, share of time.

A pair is linked once it has been near, with like velocities, in at least the share `share` of the frames of the last
`window` s in which both were seen. The link breaks once the pair has been apart for `patience` s. The rule never looks
ahead. `LinkRule` holds the parameters, `find_links` returns the switches of all links of a sequence. Constants that are
also the truth's merge and split rule come from sim.truth.merge_split_rules.
"""

from __future__ import annotations

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
)
from sim.types import Array, Bools, Ints
from tracking.config import Config, param

CELLS = 4_000_000  # Most frames times pairs that are worked on together: bounds memory.


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


def find_links(frame: Ints, column: Ints, pos: Array, vel: Array, length: int, fps: float, rule: LinkRule) -> Links:
    """Returns all switches of links in a sequence of `length` frames. frame, column (R,), from 0, pos, vel (R, 2), m,
    m/s: one row per person and frame, frame sorted. A pair with an unknown (nan) velocity counts as moving alike."""
    i, j = close_pairs(frame, pos, max(rule.apart, rule.near))
    swap = column[i] > column[j]
    i, j = np.where(swap, j, i), np.where(swap, i, j)
    distance = np.hypot(*(pos[i] - pos[j]).T)
    differ = np.hypot(*(vel[i] - vel[j]).T)
    near = (distance < rule.near) & ~(differ >= rule.alike)  # true where nan: a velocity is unknown
    speed = np.hypot(*vel.T)
    near &= ~(np.maximum(speed[i], speed[j]) < rule.idle)
    people = int(column.max(initial=0)) + 1
    pair = column[i] * people + column[j]
    known = np.unique(pair[near])
    present = np.zeros((length, people), bool)
    present[frame, column] = True
    within = distance <= rule.apart
    found = []
    # in portions, as tables of all frames and pairs would not fit in memory
    size = max(1, CELLS // max(length, 1))
    for low in range(0, len(known), size):
        pairs = known[low : low + size]
        rows = np.flatnonzero((pair >= pairs[0]) & (pair <= pairs[-1]))
        place = np.searchsorted(pairs, pair[rows])
        kept = pairs[np.minimum(place, len(pairs) - 1)] == pair[rows]
        rows, place = rows[kept], place[kept]
        found.append(_switches(frame[i[rows]], place, near[rows], within[rows], pairs, present, fps, rule))
    columns = [np.concatenate([np.zeros(0, np.int64), *(f[k] for f in found)]) for k in range(3)]
    order = np.lexsort((columns[1], columns[0]))
    t, pair, on = (c[order] for c in columns)
    return Links(t, pair // people, pair % people, on.astype(bool), np.ones(len(t), bool))


def _switches(
    frame: Ints, place: Ints, near: Bools, within: Bools, pairs: Ints, present: Bools, fps: float, rule: LinkRule
) -> tuple[Ints, Ints, Ints]:
    """Returns frame, pair and on (1, 0) of the switches (S,) of K pairs; rows (Q,): frames in which they are close."""
    people = present.shape[1]
    both = present[:, pairs // people] & present[:, pairs % people]
    together, far = np.zeros_like(both), both.copy()
    together[frame, place] = near
    far[frame[within], place[within]] = False
    window = frames_of(rule.window, fps)
    seen, alike = _recent(both, window), _recent(together, window)
    enough = min(frames_of(rule.acquaintance, fps), window)
    on = both & (seen >= enough) & (alike >= rule.share * seen) & (alike > 0)
    off = _recent(far, frames_of(rule.patience, fps)) >= frames_of(rule.patience, fps)
    t = np.arange(len(both))[:, None]
    last = np.maximum.accumulate(np.where(on | off, t, -1), axis=0)
    state = (last >= 0) & np.take_along_axis(on, np.maximum(last, 0), axis=0)
    before = np.concatenate([np.zeros_like(state[:1]), state[:-1]])
    when, which = np.nonzero(state != before)
    return when, pairs[which], state[when, which].astype(np.int64)


def _recent(flags: Bools, frames: int) -> Ints:
    """Returns the number (T, K) of True flags among the last `frames` frames up to each frame."""
    total = np.cumsum(flags, axis=0)
    late = np.zeros_like(total)
    late[frames:] = total[:-frames] if frames < len(total) else 0
    return np.asarray(total - late)
