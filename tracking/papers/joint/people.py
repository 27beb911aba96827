"""Who is tracked: detections are associated with people, new people are started and lost ones removed (all ours).

The paper does not say how individuals start, end or get their detections. One association serves all particles: that
of the largest probability with the means over particles. A new person is followed by a Kalman filter until it probably
exists, and then drawn into the particles from its posterior.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect.point_detections import PersonTable
from tracking.filters import existence, kalman
from tracking.filters.assignment import one_to_one
from tracking.filters.person_streams import birth_keys
from tracking.papers.joint.config import BIRTH_DENSITY, CLUTTER_DENSITY, SPEED_PRIOR

NEWCOMER_NOISE = 1.0  # Standard deviation of the acceleration of a person who is not confirmed, m/s^2.


@dataclass
class Candidates(PersonTable):
    """People who may exist. states (K, 3): probabilities of existence.SHOWN and the following, by person."""

    states: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def existence(self) -> Array:
        """The probability (K,) that each person exists."""
        return np.asarray(self.states[:, : existence.FALSE].sum(axis=1))

    def odds(self, detect_prob: float, dt: float) -> Array:
        """Returns the odds (K,) of detected to missed, divided by the density of nobody's detections, so in m^2; times
        the density of a person's detections, the odds that a detection is the person's. A false alarm is detected, too.
        """
        p = detect_prob * self.states[:, [existence.SHOWN, existence.FALSE]].sum(axis=1)
        return np.asarray(p / (1 - p) / (CLUTTER_DENSITY + BIRTH_DENSITY * dt))

    def pass_time(self, change: Array) -> None:
        """Predicts existence by a step's matrix (3, 3), as `existence.transition` has it."""
        self.states = self.states @ change.T

    def weigh(self, rows: Ints, density: Array, detect_prob: float) -> None:
        """Updates existence: the people `rows` (R,) were measured, at places of `density` (R,), 1/m^2; all others were
        missed."""
        existence.update(self.states.T, rows, np.full(len(self.states), detect_prob), density / CLUTTER_DENSITY, 1.0)


@dataclass
class People(Candidates):
    """The K tracked people. id (K,): of the track. next_id: the next new id."""

    id: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    next_id: int = 1

    def add(self, new: Newcomers, rows: Bools) -> None:
        """Adds the newcomers `rows` (M,)."""
        ids = self.next_id + np.arange(rows.sum())
        self.extend(id=ids, states=new.states[rows], size=new.size[rows], key=new.key[rows])
        self.next_id += len(ids)


@dataclass
class Newcomers(Candidates):
    """People who are not confirmed yet. bank (5, M, 2): a Kalman filter of x, y, m, for each."""

    bank: Array = field(default_factory=lambda: np.zeros((5, 0, 2)))

    def predict(self, dt: float) -> None:
        """Predicts all filters dt s ahead, in place."""
        kalman.predict(self.bank, dt, kalman.white_acceleration(dt, np.full(2, NEWCOMER_NOISE)))

    def measure(self, points: Array, sizes: Array, noise: float, detect_prob: float, dt: float) -> Ints:
        """Updates the newcomers by the points (M, 2), m, associated with them, in place; returns the rows of
        the points left over. sizes (M, 2), px: of boxes; noise: standard deviation, m; dt: s since the last frame."""
        cov = self.bank[kalman.VAR][:, None] * np.eye(2)
        rows, columns, density = associate(self.bank[kalman.PLACE], cov, points, noise, self.odds(detect_prob, dt))
        kalman.update(self.bank, rows, points[columns], noise**2)
        self.weigh(rows, density, detect_prob)
        self.size[rows] = np.where(np.isnan(sizes[columns]), self.size[rows], sizes[columns])
        return np.setdiff1d(np.arange(len(points)), columns)

    def start(self, points: Array, sizes: Array, noise: float, frame: int, dt: float) -> None:
        """Adds a person at each of the points (M, 2), m; frame: number of this frame; dt: s since the last one."""
        bank, person = kalman.born(points, noise**2, SPEED_PRIOR**2), BIRTH_DENSITY * dt
        states = existence.newborn(np.full(len(points), person / (person + CLUTTER_DENSITY))).T
        self.extend(bank=bank, states=states, size=sizes, key=birth_keys(points, frame))

    def draw(self, rows: Bools, normals: Array) -> Array:
        """Returns states (N, R, 4) drawn from the posteriors of the R people `rows`; normals (N, R, 4)."""
        place, rate, var, cross, rate_var = self.bank[:, rows]
        a = np.sqrt(var)
        b = cross / a
        c = np.sqrt(np.maximum(rate_var - b * b, 0.0))
        u, v = normals[..., :2], normals[..., 2:]
        return np.concatenate([place + a * u, rate + b * u + c * v], axis=-1)


def associate(mean: Array, cov: Array, points: Array, noise: float, odds: Array) -> tuple[Ints, Ints, Array]:
    """Returns rows and columns (R,) of the associated people and points, one to one, and the densities N(z; mean, S)
    (R,) of the points, 1/m^2. A pair is more probable than none, and the product of all is the largest. odds (K,): as
    `Candidates.odds`."""
    S = cov + noise**2 * np.eye(2)
    log_det, log_odds = np.linalg.slogdet(2 * np.pi * S)[1], np.log(odds)
    # Only points on a strip of the probable ones are looked at: of 2,000 people in a hall one in 40.
    reach = np.sqrt(np.maximum(2 * log_odds - log_det, 0.0) * (S[:, 0, 0] + S[:, 1, 1])) * 1.001 + 1e-6
    order = np.argsort(points[:, 0])
    first, last = (np.searchsorted(points[order, 0], mean[:, 0] + side * reach) for side in (-1, 1))
    rows = np.repeat(np.arange(len(mean)), last - first)
    columns = order[np.arange(len(rows)) - np.repeat(np.cumsum(last - first) - last, last - first)]
    x, y = (points[columns] - mean[rows]).T
    xx, xy, yx, yy = np.linalg.inv(S).reshape(-1, 4)[rows].T
    d2 = x * xx * x + x * xy * y + y * yx * x + y * yy * y
    log_density = -(d2 + log_det[rows]) / 2
    cost = -log_density - log_odds[rows]
    kept = np.flatnonzero(cost < 0)
    kept = kept[np.lexsort((columns[kept], rows[kept]))]
    best = kept[one_to_one(rows[kept], columns[kept], cost[kept])]
    return rows[best], columns[best], np.exp(log_density[best])
