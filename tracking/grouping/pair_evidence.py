"""What tells whether two people belong together: their distance and motion over time, in steps, as far as it is known.

`evidence` returns one row per pair and step (`person_motion`) with the quantities of `QUANTITIES` averaged over the
past (`TIMES`), `PACE`, `IN_NOISE` and `NEAR`, and with the noise of the two people's positions. Nothing looks ahead.
Only positions are used. Lengths are in m.

Positions err, and a chord of 0.8 s takes an error for motion. What lasts in spite of errors is the mean offset from one
to the other, and the difference of velocities by regression. Of mates they are small: `IN_NOISE` are their lengths in
units of what mates and errors make of them, so that what lies along the direction of great errors counts less.

When and where people were first seen is no evidence, nor how many are around: it tells who belongs together in
simulated scenes, and misleads in others. What the nearest others do (`OTHERS`) is evidence for events only: it misleads
about who is together now. For how long two have been near (`NEAR`) is none for events: who has just met has no past.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from sim.truth.merge_split_rules import MERGE_DISTANCE, SPLIT_VELOCITY, close_pairs
from sim.types import Array, Bools, Ints
from tracking.grouping import person_motion
from tracking.grouping.person_motion import CORRELATION, Motion, PersonMotion, StepRows, new_places, taken

REACH = 4.0  # m: pairs farther apart have no evidence.
STANDING = 0.3  # m/s.
TOUCHING = 0.1  # m: least distance by which the growth of the distance is divided.
TIMES = (0.8, 5.0, 15.0)  # s: means over the past have weights exp(-age / time).
# Of a file: longest distance of two people in it, m, and least cosines of two successive lines, and of line and way.
FILE_SPACING, FILE_STRAIGHT, FILE_ALONG = 1.8, 0.866, 0.8
LONGEST = 20.0  # s: longer times near each other tell no more.
# Averaged over the pair's rows, with weights exp(-age / time). Unknown velocities leave nan out of the means.
# velocity difference: of vectors, m/s. sideways, lengthwise: parts of the distance, m, across and along the mean
# velocity of the two where that is at least 0.3 m/s, else the whole distance and nan. growth: of the distance, m/s.
# turn: angle between the two velocities, rad, nan if one is slower than 0.3 m/s. walking difference: the velocity
# difference, m/s, nan where turn is, so that its means outlast a stop. one walks: 1 if exactly one of the two is slower
# than 0.3 m/s, else 0. file: at how many ends of the pair others go on in one line along their way, as in a queue, nan
# if the pair stands or is more than 1.8 m apart. nearer others: how many other people are nearer to the one than the
# other is, mean of both.
# common neighbours: third people less than 1.5 m from both, of velocities less than 0.7 m/s apart.
OTHERS = ("nearer others", "common neighbours")
QUANTITIES = (
    "distance", "velocity difference", "sideways", "lengthwise", "growth", "turn", "walking difference", "one walks",
    "file", *OTHERS,
)  # fmt: skip
NEAR = ("time near",)  # Not averaged: the time of the pair's rows so far, s.
# By regression over `person_motion.TIMES`, too, not averaged: speed of the mean of the two velocities, m/s.
PACE = tuple(f"pace, {time:g} s" for time in person_motion.TIMES)
# Lengths in standard deviations of mates and errors: of the mean offset over each of the `TIMES`, and of the difference
# of the velocities by regression.
MATES = (0.6, 0.25)  # m, m/s: standard deviations of mates' offsets and velocity differences.
IN_NOISE = tuple(
    f"{name} in noise, {time:g} s"
    for name, times in (("offset", TIMES), ("velocity difference", person_motion.TIMES))
    for time in times
)
# Names of the columns of `PairRows.values`.
NAMES = (*(f"{name}, {time:g} s" for name in QUANTITIES for time in TIMES), *PACE, *IN_NOISE, *NEAR)
PORTION = 100_000  # Rows worked on together: bounds memory.


@dataclass(frozen=True, slots=True, eq=False)
class PairRows:
    """Evidence about pairs of people, one row per pair and step in which both were seen less than 4 m apart."""

    step: Ints  # (R,): from 0, ascending
    # a, b (R,): columns of the two people, a < b
    a: Ints
    b: Ints
    pair: Ints  # (R,): number of the pair, from 0
    values: Array  # (R, len(NAMES)): columns `NAMES`, nan if unknown
    noise: Array  # (R,): of the positions, m


def evidence(seen: StepRows, seconds: float) -> Iterator[PairRows]:
    """Yields the evidence of all pairs within 4 m, in portions of whole steps, steps ascending. seconds: length of a
    step."""
    history = PairHistory(seconds)
    history.take_people(np.full(int(seen.column.max(initial=-1)) + 1, -1))
    yield from history.add(seen)[1]


class Follower(Protocol):
    """What is known of pairs, by number."""

    def take(self, rows: Ints) -> None:
        """Renumbers the pairs: pair k becomes what was pair rows[k], or a new one if rows[k] is -1."""


class PairHistory:
    """The evidence of pairs so far. seconds: length of a step. followers: further facts of pairs, by number.

    State: motion, of K people; a, b (P,): the people of each pair, sorted by a, then b; means, of the pairs.
    """

    def __init__(self, seconds: float, *followers: Follower) -> None:
        self.seconds, self.people = seconds, 0
        self.motion, self.means = PersonMotion(0, seconds), PairMeans(0, seconds)
        self.followers = (self.means, *followers)
        self.a, self.b = np.zeros((2, 0), np.int64)

    def take_people(self, rows: Ints) -> None:
        """Renumbers the people: person k becomes who was person rows[k], or somebody new if rows[k] is -1. Those who
        stay keep their order."""
        place = new_places(rows, self.people)
        self.motion.take(rows)
        self.people = len(rows)
        a, b = place[self.a], place[self.b]
        kept = np.flatnonzero((a >= 0) & (b >= 0))
        self.a, self.b = a[kept], b[kept]
        if len(kept) < len(a):
            self._take(kept)

    def add(self, seen: StepRows) -> tuple[Motion, Iterator[PairRows]]:
        """Adds the people of some steps, and returns their motion and the evidence of all pairs within 4 m, in portions
        of whole steps, steps ascending; all portions must be taken."""
        step, column = seen.step, seen.column
        motion = self.motion.add(step, column, seen.pos, seen.time)
        return motion, self._pairs(seen, motion)

    def _pairs(self, seen: StepRows, motion: Motion) -> Iterator[PairRows]:
        step, column = seen.step, seen.column
        i, j = close_pairs(step, seen.pos, REACH)
        pair = self._numbers(column[i], column[j])
        order = np.lexsort((pair, step[i]))
        i, j, pair = i[order], j[order], pair[order]
        for r in _portions(step[i]):
            moment = pair_moment(seen.pos, motion, i[r], j[r])
            values = self.means.add(step[i[r]], pair[r], moment)
            yield PairRows(step[i[r]], column[i[r]], column[j[r]], pair[r], values, moment.noise_level)

    def forget(self, step: int) -> None:
        """Forgets the pairs who were last near each other before a step."""
        kept = np.flatnonzero(self.means.last >= step)
        self.a, self.b = self.a[kept], self.b[kept]
        self._take(kept)

    def _numbers(self, a: Ints, b: Ints) -> Ints:
        """Returns the numbers (R,) of pairs a < b; adds those that are new."""
        old, key = self.a * self.people + self.b, a * self.people + b
        if not np.isin(key, old).all():
            every = np.union1d(old, key)
            place = np.searchsorted(old, every)
            self._take(np.where(np.append(old, -1)[place] == every, place, -1))
            self.a, self.b = divmod(every, max(self.people, 1))
            old = every
        return np.searchsorted(old, key)

    def _take(self, rows: Ints) -> None:
        for facts in self.followers:
            facts.take(rows)


@dataclass(frozen=True, slots=True, eq=False)
class PairMoment:
    """R pairs in one moment each: `QUANTITIES` (R, 11); offset (R, 2), m, from the one to the other; change (R, 2, 2),
    difference of their velocities by regression, m/s, and pace (R, 2), that of their mean; noise (R, 3), sum of their
    `Motion.noise`."""

    quantities: Array
    offset: Array
    change: Array
    pace: Array
    noise: Array

    @property
    def noise_level(self) -> Array:
        """The standard deviation of a person's position, both directions together, (R,), m."""
        return np.asarray(np.sqrt(np.maximum(self.noise[:, 0] + self.noise[:, 2], 0.0) / 2))

    def rows(self, rows: Ints) -> PairMoment:
        """Returns the pairs `rows` (K,)."""
        return PairMoment(*(getattr(self, field.name)[rows] for field in fields(self)))


def pair_moment(pos: Array, motion: Motion, i: Ints, j: Ints, *, others: bool = True) -> PairMoment:
    """Returns R pairs as `PairMeans` adds them.

    pos (N, 2), m, motion: of N rows, one per person and step. i, j, others: as of `instant_evidence`.
    """
    quantities = instant_evidence(pos, motion, i, j, others=others)
    first, second = motion.slope[i], motion.slope[j]
    pace = np.hypot(*(first + second).T).T / 2
    return PairMoment(quantities, pos[j] - pos[i], second - first, pace, motion.noise[i] + motion.noise[j])


def instant_evidence(pos: Array, motion: Motion, i: Ints, j: Ints, *, others: bool = True) -> Array:
    """Returns the `QUANTITIES` (R, 11) of R pairs, for one moment each.

    pos (N, 2), m, motion: of N rows, one per person and step. i, j (R,): the two rows of each pair; all pairs within
    4 m must be given. others: False leaves the columns `OTHERS` nan, which only beliefs about events need.
    """
    vel = motion.vel
    apart, change, mean = pos[j] - pos[i], vel[j] - vel[i], (vel[i] + vel[j]) / 2
    distance, differ, pace = (np.hypot(*x.T) for x in (apart, change, mean))
    walks = pace >= STANDING  # False where nan
    unit = mean / np.where(walks, pace, 1.0)[:, None]
    across = np.abs(apart[:, 0] * unit[:, 1] - apart[:, 1] * unit[:, 0])
    along = np.abs((apart * unit).sum(axis=1))
    speed = np.hypot(*vel.T)
    first, second = speed[i] >= STANDING, speed[j] >= STANDING
    both = first & second
    cosine = (vel[i] * vel[j]).sum(axis=1) / np.where(both, speed[i] * speed[j], 1.0)
    near = np.full((2, len(i)), np.nan)
    if others:
        linked = (distance < MERGE_DISTANCE) & (differ < SPLIT_VELOCITY)
        near[:] = _nearer(i, j, distance), _common(i, j, linked)
    return np.column_stack([
        distance, differ, np.where(walks, across, distance), np.where(walks, along, np.nan),
        (apart * change).sum(axis=1) / np.maximum(distance, TOUCHING),
        np.where(both, np.arccos(np.clip(cosine, -1.0, 1.0)), np.nan),
        np.where(both, differ, np.nan), np.where(np.isfinite(differ), first != second, np.nan),
        _file(motion.place, motion.slope[:, -1], i, j), *near,
    ])  # fmt: skip


def _file(place: Array, way: Array, i: Ints, j: Ints) -> Array:
    """Returns at how many ends of each pair others go on in file, (R,).

    place (N, 2): mean places, m, as errors bend a line of others; all lag alike. way (N, 2): velocities, m/s.
    """
    from tracking.grouping.motion_kernels import file_ends

    one, other, out = np.concatenate([i, j]), np.concatenate([j, i]), np.empty(len(i))
    order = np.argsort(one, kind="stable")
    begin = np.searchsorted(one[order], np.arange(len(place) + 1))
    file_ends(begin, other[order], place, way, i, j, STANDING, FILE_SPACING, FILE_STRAIGHT, FILE_ALONG, out)
    return out


def _nearer(i: Ints, j: Ints, distance: Array) -> Array:
    """Returns how many other rows are nearer to the one of a pair than the other is, mean of both, (R,)."""
    centre, far = np.concatenate([i, j]), np.concatenate([distance, distance])
    order = np.lexsort((far, centre))
    centre, far = centre[order], far[order]
    # who is equally far shares a rank
    further = np.append(True, (np.diff(centre) != 0) | (np.diff(far) > 0))[: len(order)]
    rank = np.empty(len(order))
    rank[order] = np.maximum.accumulate(np.arange(len(order)) * further) - np.searchsorted(centre, centre)
    return np.asarray((rank[: len(i)] + rank[len(i) :]) / 2)


def _common(i: Ints, j: Ints, linked: Bools) -> Array:
    """Returns how many third rows are linked with both of a pair, (R,)."""
    from scipy.sparse import coo_array

    if not len(i):
        return np.zeros(0)
    low, rows = int(i.min()), int(max(i.max(), j.max())) + 1
    near = np.concatenate([i[linked], j[linked]]) - low, np.concatenate([j[linked], i[linked]]) - low
    link = coo_array((np.ones(len(near[0])), near), (rows - low, rows - low)).tocsr()
    return np.asarray((link @ link)[i - low, j - low]).ravel()


def _portions(step: Ints) -> Iterator[slice]:
    low = 0
    while low < len(step):
        high = int(np.searchsorted(step, step[min(low + PORTION, len(step)) - 1], side="right"))
        yield slice(low, high)
        low = high


class PairMeans:
    """What pairs have been like so far: means of their quantities and offsets, with weights exp(-age / time).

    total, weight (K, 11, 3): sums by pair, quantity and time; offsets (K, 3, 3): sums of x, y and weights by pair and
    time. last (K,): step of a pair's last row; rows (K,): number of rows.
    """

    def __init__(self, pairs: int, seconds: float) -> None:
        self.seconds, self.times = seconds, np.array(TIMES)
        self.total = np.zeros((pairs, len(QUANTITIES), len(TIMES)))
        self.weight, self.offsets = np.zeros_like(self.total), np.zeros((pairs, len(TIMES), 3))
        self.last, self.rows = np.zeros(pairs, np.int64), np.zeros(pairs, np.int64)

    def add(self, step: Ints, pair: Ints, moment: PairMoment) -> Array:
        """Adds R rows, steps ascending, and returns the values (R, len(NAMES)) of each row's pair after this row. step,
        pair (R,): step and number of the pair."""
        from tracking.grouping.belief_kernels import add_to_means
        from tracking.grouping.motion_kernels import add_to_offsets, lengths_in_noise

        count, many = len(step), len(self.times)
        times, near = self.times / self.seconds, np.empty(count, np.int64)
        means, in_noise = np.empty((count, len(QUANTITIES), many)), np.empty((count, len(IN_NOISE)))
        vectors = np.concatenate([np.empty((count, many, 2)), moment.change], axis=1)
        add_to_offsets(step, pair, moment.offset, times, self.offsets, self.last.copy(), vectors[:, :many])
        add_to_means(step, pair, moment.quantities, times, self.total, self.weight, self.last, self.rows, means, near)
        usual = np.repeat(MATES, [many, len(person_motion.TIMES)])
        lengths_in_noise(vectors, usual, NOISE_SHARES, moment.noise, in_noise)
        near_time = np.minimum(near * self.seconds, LONGEST)
        return np.column_stack([means.reshape(count, -1), moment.pace, in_noise, near_time])

    def take(self, rows: Ints) -> None:
        """Renumbers the pairs: pair k becomes what was pair rows[k], or a new pair without past if rows[k] is -1."""
        for name in ("total", "weight", "offsets", "last", "rows"):
            setattr(self, name, taken(getattr(self, name), rows, 0))


def _noise_shares() -> Array:
    """Returns which share of the positions' variance is in a mean over each of the `TIMES`, and, in 1/s², in a velocity
    by regression, as in the difference of two such means that lie about half the time apart."""
    mean, slope = np.array(TIMES), np.array(person_motion.TIMES)
    share, share_of_slope = (CORRELATION / (CORRELATION + times) for times in (mean, slope))
    return np.concatenate([share, 4 * share_of_slope / slope**2])


NOISE_SHARES = _noise_shares()
