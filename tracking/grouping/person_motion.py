"""Each person's motion in steps, from positions that err: velocities, and the noise of the positions themselves.

`step_rows` averages positions over steps of at most 0.4 s. `PersonMotion` adds steps one after another, and nothing in
it looks ahead. The noise of a person's positions is estimated from what legs cannot do: from how far a position is off
the uniform motion of the two before, in both directions of the plane. Until a person has been seen for some time, that
of everybody in the recording counts. Lengths are in m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.types import Array, Ints

STEP = 0.4  # s: longest step, unless one frame lasts longer.
CHORD = 0.8  # s over which velocities are measured: two frames of a recording with 2.5 frames/s.
TIMES = (1.5, 4.0)  # s: in regressions, positions have weights exp(-age / time).
# Of the noise: standard deviation of a walker's change of velocity, m/s (0.12 to 0.2 in seq_hotel and zara01, over 0.4
# to 2 s); correlation time of the errors, s; time and number of deviations for which a person's own noise is told from
# that of all, s; the longest deviation that counts, m.
LEGS, CORRELATION, OWN, COMMON, JUMP = 0.18, 1.0, 20.0, 20.0, 4.0
STEADY = 0.6  # m/s: by how much a walker's velocity changes in 1 s; 0.3 reports merges later
FIRST = (0.1, 10.0)  # m: noise before anything was seen, with the weight of so many deviations.


def frames_per_step(fps: float) -> int:
    """Returns the number of frames in a step: the greatest number that lasts at most 0.4 s, and at least 1."""
    return max(1, int(STEP * fps + 1e-9))


@dataclass(frozen=True, slots=True, eq=False)
class StepRows:
    """Where people were seen, one row per person and step, sorted by step, then column."""

    step: Ints  # (R,): from 0
    column: Ints  # (R,): number of the person, from 0
    pos: Array  # (R, 2): mean position in the step, m
    time: Array  # (R,): mean time in the step, s


def step_rows(frame: Ints, column: Ints, pos: Array, end: int, fps: float) -> StepRows:
    """Returns each person's mean position and time in each step that is complete before frame `end`.

    frame, column (R,), from 0, pos (R, 2), m: one row per person and frame. With n = `frames_per_step(fps)`, step s
    ends with frame n s, so that step 0 is frame 0 alone.
    """
    size = frames_per_step(fps)
    steps, step, people = -(-end // size), -(-frame // size), int(column.max(initial=0)) + 1
    whole = step < steps
    key, row, count = np.unique((step * people + column)[whole], return_inverse=True, return_counts=True)
    total = np.stack([np.bincount(row, x[whole], len(key)) for x in (*pos.T, frame / fps)], axis=-1)
    mean = total / count[:, None]
    known = np.isfinite(mean[:, 0])
    key, mean = key[known], mean[known]
    return StepRows(key // people, key % people, mean[:, :2], mean[:, 2])


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """The motion of R people and steps: vel (R, 2), m/s, from a person's earliest position in the last 0.8 s to the
    present one; slope (R, 2, 2), m/s, velocities by regression over the `TIMES`; place (R, 2), m, the mean over the
    first of these; noise (R, 3), m²: variances xx and yy and covariance xy, in the order xx, xy, yy. Velocities are nan
    for a person without past."""

    vel: Array
    slope: Array
    place: Array
    noise: Array


class PersonMotion:
    """The motion of K people, step by step. seconds: length of a step.

    State (`motion_kernels`): recent (K, W, 4), sums (K, 2, 7), spread (K, 4), and pooled (4,) of all people so far.
    """

    def __init__(self, people: int, seconds: float) -> None:
        self.chord = max(1, round(CHORD / seconds))
        self.recent = np.full((people, max(2, self.chord) + 1, 4), -np.inf)
        self.sums, self.spread = np.zeros((people, len(TIMES), 7)), np.zeros((people, 4))
        sd, weight = FIRST
        self.pooled = np.array([sd * sd, 0.0, sd * sd, 1.0]) * weight

    def add(self, step: Ints, person: Ints, pos: Array, time: Array) -> Motion:
        """Adds R rows, steps ascending, and returns the motion of each row's person after its step. step, person (R,):
        numbers; pos (R, 2), m; time (R,), s."""
        from tracking.grouping.motion_kernels import add_to_motion

        n, settings = len(step), np.array([LEGS, CORRELATION, OWN, COMMON, JUMP])
        found = Motion(np.empty((n, 2)), np.empty((n, len(TIMES), 2)), np.empty((n, 2)), np.empty((n, 3)))
        state = self.recent, self.sums, self.spread, self.pooled
        out = found.vel, found.slope, found.place, found.noise
        # of one type, so that numba compiles once
        step, person = np.ascontiguousarray(step), np.ascontiguousarray(person)
        pos, time = np.ascontiguousarray(pos), np.ascontiguousarray(time)
        add_to_motion(step, person, pos, time, self.chord, np.array(TIMES), settings, *state, *out)
        return found

    def new(self, pos: Array, vel: Array) -> Motion:
        """Returns the motion of N people who were not seen before, at pos, vel (N, 2), m, m/s."""
        noise = np.broadcast_to(self.pooled[:3] / self.pooled[3], (len(vel), 3))
        return Motion(vel, np.repeat(vel[:, None], len(TIMES), axis=1), pos, noise)

    def take(self, rows: Ints) -> None:
        """Renumbers the people: person k becomes who was person rows[k], or somebody new if rows[k] is -1."""
        for name, empty in (("recent", -np.inf), ("sums", 0.0), ("spread", 0.0)):
            setattr(self, name, taken(getattr(self, name), rows, empty))


class SteadyPlaces:
    """Where people are by a Kalman filter with their own noise: soon the same places if they are exact.

    People walk at nearly constant velocity. Errors that are correlated over a time count as many times as often as they
    are alike. State (`motion_kernels.filter_places`): noise (K, 2), latest (2,), state (K, 2, 2), cov (K, 2, 3), last
    (K,).
    """

    def __init__(self, fps: float) -> None:
        self.fps, self.size = float(fps), frames_per_step(fps)
        stay = np.exp(-1 / (fps * CORRELATION))
        self.times = (1 + stay) / (1 - stay)
        self.noise, self.latest = np.zeros((0, 2)), np.full(2, FIRST[0] ** 2)
        self.state, self.cov, self.last = np.zeros((0, 2, 2)), np.zeros((0, 2, 3)), np.zeros(0, np.int64)

    def add(self, frame: Ints, person: Ints, pos: Array, seen: StepRows, noise: Array) -> Array:
        """Adds R rows, sorted by frame, and returns their places (R, 2), m. frame, person (R,), from 0, pos (R, 2), m.
        seen, noise (S, 3): people in the steps that end in these frames, and the noise of their positions then."""
        from tracking.grouping.motion_kernels import filter_places

        out, variance = pos.copy(), np.ascontiguousarray(np.maximum(noise[:, [0, 2]], 0.0))
        filter_places(
            frame, person, pos, seen.step, seen.column, variance, self.size, self.fps, STEADY, self.times,
            self.noise, self.latest, self.state, self.cov, self.last, out,
        )  # fmt: skip
        return out

    def take(self, rows: Ints) -> None:
        """Renumbers the people, as `PersonMotion.take`."""
        for name, empty in (("noise", np.nan), ("state", 0.0), ("cov", 0.0), ("last", -1)):
            setattr(self, name, taken(getattr(self, name), rows, empty))


def new_places(rows: Ints, count: int) -> Ints:
    """Returns the new number of each of `count` people, and -1 at the end, if person k becomes who was person rows[k];
    -1 for those who are gone."""
    place = np.full(count + 1, -1)
    place[rows[rows >= 0]] = np.flatnonzero(rows >= 0)
    return place


def taken(table: Any, rows: Ints, empty: float) -> Any:
    """Returns the rows (R,) of a table (K, ...); `empty` where a row is -1."""
    found = np.full((len(rows), *table.shape[1:]), empty, table.dtype)
    found[rows >= 0] = table[rows[rows >= 0]]
    return found
