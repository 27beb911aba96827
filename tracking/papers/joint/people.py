"""Who is tracked: detections are associated with people, new people are started and lost ones removed (all ours).

The paper does not say how individuals start, end or get their detections. One association serves all particles: that
of least total cost with the means over particles. A new person is followed by a Kalman filter until confirmed, and then
drawn into the particles from its posterior.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect.point_detections import PersonTable, followed_sizes
from tracking.filters import kalman
from tracking.filters.assignment import optimal
from tracking.filters.person_streams import Keys, birth_keys

NEWCOMER_NOISE = 1.0  # Standard deviation of the acceleration of a person who is not confirmed, m/s^2.


@dataclass
class People(PersonTable):
    """The K tracked people. id (K,): of the track. next_id: the next new id."""

    id: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    next_id: int = 1

    def add(self, size: Array, key: Keys) -> None:
        """Adds people; size (M, 2): of their boxes, px, nan if unknown; key (M,)."""
        self.extend(id=self.next_id + np.arange(len(size)), size=size, key=key)
        self.next_id += len(size)

    def record(self, rows: Ints, sizes: Array, dt: float) -> None:
        """Records that the people `rows` (R,) were measured in a frame, with boxes of `sizes` (R, 2), px, and that all
        others were missed for dt s more."""
        self.missed += dt
        self.missed[rows] = 0.0
        self.size[rows] = followed_sizes(self.size[rows], sizes, dt)

    def absence(self, group: Ints) -> Array:
        """Returns for how long each person has been missed, s, (K,); in a group of whom nobody was measured, the sum
        over its members."""
        same = ((group[:, None] == group) & (group >= 0)) | np.eye(len(group), dtype=bool)
        measured = (same & (self.missed == 0)).any(axis=1)
        return np.where(measured, self.missed, same @ self.missed)


@dataclass
class Newcomers(PersonTable):
    """People who are not confirmed yet. `missed` does not grow in frames in which nobody could be measured. bank (5, M,
    2): a Kalman filter of x, y, m, for each. age (M,): s since the first measurement."""

    bank: Array = field(default_factory=lambda: np.zeros((5, 0, 2)))
    age: Array = field(default_factory=lambda: np.zeros(0))

    def predict(self, dt: float) -> None:
        """Predicts all filters dt s ahead, in place, and adds dt to the ages."""
        kalman.predict(self.bank, dt, kalman.white_acceleration(dt, np.full(2, NEWCOMER_NOISE)))
        self.age += dt

    def measure(self, points: Array, sizes: Array, noise: float, gate: float) -> Bools:
        """Updates the newcomers by the points (M, 2), m, associated with them, in place; returns bool (M,), True for
        points left over. sizes (M, 2), px: of boxes; noise: standard deviation, m; gate: largest d^2."""
        d2 = kalman.distances(self.bank, points, noise**2)
        rows, columns = optimal(np.where(d2 <= gate, d2, np.inf), 2 * gate)
        kalman.update(self.bank, rows, points[columns], noise**2)
        self.missed[rows] = 0.0
        self.size[rows] = np.where(np.isnan(sizes[columns]), self.size[rows], sizes[columns])
        free = np.ones(len(points), bool)
        free[columns] = False
        return free

    def start(self, points: Array, sizes: Array, noise: float, speed: float, frame: int) -> None:
        """Adds a person at each of the points (M, 2), m; speed: standard deviation of the velocity per axis, m/s;
        frame: number of this frame."""
        bank, age = kalman.born(points, noise**2, speed**2), np.zeros(len(points))
        self.extend(bank=bank, age=age, size=sizes, key=birth_keys(points, frame))

    def draw(self, rows: Bools, normals: Array) -> Array:
        """Returns states (N, R, 4) drawn from the posteriors of the R people `rows`; normals (N, R, 4)."""
        place, rate, var, cross, rate_var = self.bank[:, rows]
        a = np.sqrt(var)
        b = cross / a
        c = np.sqrt(np.maximum(rate_var - b * b, 0.0))
        u, v = normals[..., :2], normals[..., 2:]
        return np.concatenate([place + a * u, rate + b * u + c * v], axis=-1)


def associate(mean: Array, cov: Array, points: Array, noise: float, gate: float) -> tuple[Ints, Ints]:
    """Returns rows and columns (R,) of the associated people and points: least total of d^2 + ln |S| (one to one)."""
    if not len(mean) or not len(points):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    S = cov + noise**2 * np.eye(2)
    # d^2 is at least |error|^2 over the trace of S: most pairs need no more than that
    square = np.square(points[:, 0] - mean[:, :1]) + np.square(points[:, 1] - mean[:, 1:])
    k, m = np.nonzero(square <= gate * (1 + 1e-9) * np.trace(S, axis1=1, axis2=2)[:, None])
    error = points[m] - mean[k]
    d2 = np.einsum("ri,ri->r", error, np.linalg.solve(S[k], error[..., None])[..., 0])
    log_det = np.linalg.slogdet(S)[1]
    log_det = log_det - log_det.min()
    cost = np.full(square.shape, np.inf)
    cost[k, m] = np.where(d2 <= gate, d2 + log_det[k], np.inf)
    return optimal(cost, gate + float(log_det.max()) + 1e-9)
