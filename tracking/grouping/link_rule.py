"""The baseline rule for pairs of tracked people: who is linked to whom when, never looking ahead.

A pair is linked once it has been near, and moving alike, in enough of the last seconds in which both were seen; the
link breaks once they have been far apart for long enough. All pairs of a sequence are worked on at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sim.truth.merge_split_rules import HOLD_TIME, MERGE_DISTANCE, MERGE_VELOCITY, SPLIT_DISTANCE, frames_of
from sim.truth.proximity import close_pairs
from sim.types import Array, Bools, Ints
from tracking.config import Config, param

CELLS = 4_000_000  # frames times pairs held at once
NEVER = 10.0  # m/s: velocities of people never differ by more


@dataclass(frozen=True)
class Grouping(Config):
    """Parameters of the baseline rule; lengths in metres, multiplied by px_per_m in the image. Declared like a
    tracker's, so that they are searched, stored and read in the same way."""

    tracker: ClassVar[str] = "grouping"

    near: float = param(MERGE_DISTANCE, (0.5, 3.0), "m", "nearer is together")
    alike: float = param(MERGE_VELOCITY, (0.1, 2.0), "m/s", "velocities that differ by less are alike")
    share: float = param(0.8, (0.3, 1.0), "share", "of the frames of the last `window` in which both were seen")
    window: float = param(HOLD_TIME, (0.2, 6.0), "s", "how far back it looks")
    acquaintance: float = param(
        1.0,
        (0.0, 6.0),
        "s",
        "of the window in which both must have been seen: who has just come is judged sooner",
    )
    apart: float = param(SPLIT_DISTANCE, (0.5, 5.0), "m", "further is apart")
    patience: float = param(HOLD_TIME, (0.1, 6.0), "s", "apart for so long, and the link breaks")
    idle: float = param(
        0.0,
        (0.0, 1.0),
        "m/s",
        "standing side by side, both slower, links nobody; 0: it does, as in a conversation",
        before=0.0,
    )
    diverge: float = param(
        NEVER,
        (0.2, NEVER),
        "m/s",
        "beyond `near`, and velocities differing by more, is apart too; 10: never",
        "log",
        before=NEVER,
    )
    smooth: float = param(0.0, (0.0, 3.0), "s", "velocities are chords of positions over so long; 0: the tracker's own")
    memory: float = param(1.0, (0.0, 5.0), "s", "a group waits so long for a member who is not seen")
    arrival: float = param(1.0, (0.0, 5.0), "s", "a link that began so soon after a track did is an arrival, no merge")


@dataclass(frozen=True, slots=True, eq=False)
class Links:
    """Changes of links, L rows sorted by time: frame (from 0), columns a < b, on or off, since: first frame of the
    stretch that made the change."""

    frame: Ints
    a: Ints
    b: Ints
    on: Bools
    since: Ints


def find_links(frame: Ints, column: Ints, pos: Array, vel: Array, length: int, fps: float, rule: Grouping) -> Links:
    """Links among people; rows sorted by frame (from 0), column (R,) of the person, pos, vel (R, 2) in m, m/s."""
    i, j = close_pairs(frame, pos, max(rule.apart, rule.near))
    swap = column[i] > column[j]
    i, j = np.where(swap, j, i), np.where(swap, i, j)
    distance = np.hypot(*(pos[i] - pos[j]).T)
    differ = np.hypot(*(vel[i] - vel[j]).T)
    near = (distance < rule.near) & ~(differ >= rule.alike)  # nan: not yet known
    speed = np.hypot(*vel.T)
    near &= ~(np.maximum(speed[i], speed[j]) < rule.idle)
    people = int(column.max(initial=0)) + 1
    pair = column[i] * people + column[j]
    known = np.unique(pair[near])
    present = np.zeros((length, people), bool)
    present[frame, column] = True
    within = (distance <= rule.apart) & ~((distance > rule.near) & (differ > rule.diverge))
    found = []
    for some in _portions(known, max(1, CELLS // max(length, 1))):
        rows = np.flatnonzero((pair >= some[0]) & (pair <= some[-1]))
        place = np.searchsorted(some, pair[rows])
        kept = some[np.minimum(place, len(some) - 1)] == pair[rows]
        rows, place = rows[kept], place[kept]
        found.append(_changes(frame[i[rows]], place, near[rows], within[rows], some, present, fps, rule))
    columns = [np.concatenate([np.zeros(0, np.int64), *(f[k] for f in found)]) for k in range(4)]
    order = np.lexsort((columns[1], columns[0]))
    t, pair, on, since = (c[order] for c in columns)
    return Links(t, pair // people, pair % people, on.astype(bool), since)


def _portions(pairs: Ints, size: int) -> Iterator[Ints]:
    for low in range(0, len(pairs), size):
        yield pairs[low : low + size]


def _changes(
    frame: Ints, place: Ints, near: Bools, within: Bools, pairs: Ints, present: Bools, fps: float, rule: Grouping
) -> tuple[Ints, Ints, Ints, Ints]:
    """(frame, pair, on, since) of the changes of some pairs, from rows (frame, place of the pair) that are close."""
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
    turned_on = state[when, which]
    since = np.where(turned_on, _onset(together, window)[when, which], when - frames_of(rule.patience, fps) + 1)
    return when, pairs[which], turned_on.astype(np.int64), since


def _recent(flags: Bools, frames: int) -> Ints:
    """How many of the last `frames` frames (T, K) are true, this one included."""
    total = np.cumsum(flags, axis=0)
    late = np.zeros_like(total)
    late[frames:] = total[:-frames] if frames < len(total) else 0
    return np.asarray(total - late)


def _onset(together: Bools, window: int) -> Ints:
    """The first frame with a true flag among the last `window` (T, K)."""
    t = np.arange(len(together))[:, None]
    after = np.minimum.accumulate(np.where(together, t, len(together))[::-1], axis=0)[::-1]
    return np.asarray(np.take_along_axis(after, np.maximum(t - window + 1, 0) + np.zeros_like(after), axis=0))
