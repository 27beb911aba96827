"""Kernels of tracked_people: who hides whom, costs of pairs, second boxes of people, and who is reported.

Boxes are centred: centre x, y, height, width, px. bank (5, N, 4): Kalman filters (tracking.filters.kalman). The loops
over all pairs need no table of the pairs.
"""

from __future__ import annotations

from math import erf

import numpy as np

from sim.compiler import njit
from sim.types import Array, Bools, Ints
from tracking.filters.existence import FALSE, SHOWN
from tracking.filters.kalman import RATE, VAR

LIKELY = 0.5  # least probability of a confirmed track, and of a reported box
BODY = 0.35  # m: a box is right if its middle is so near to the person
IN_FRONT = 0.15  # m in the image: whose feet are lower by more stands in front
FARTHEST = 9.0  # standard deviations from which a density is taken as 0: it is below 1e-17
DOUBLE_SPREAD = 0.3  # m: standard deviation of centre, height and width of a second box of a person


@njit(cache=True)
def covered_share(box: Array, other: Array) -> float:
    """Returns the share, 0 to 1, of a box (4,) that lies in another box (4,)."""
    wide = min(box[0] + box[3] / 2, other[0] + other[3] / 2) - max(box[0] - box[3] / 2, other[0] - other[3] / 2)
    high = min(box[1] + box[2] / 2, other[1] + other[2] / 2) - max(box[1] - box[2] / 2, other[1] - other[2] / 2)
    return float(max(wide, 0.0) * max(high, 0.0) / max(box[2] * box[3], 1e-9))


@njit(cache=True)
def covered_shares(boxes: Array, others: Array) -> Array:
    """Returns the share (N, M), 0 to 1, of each of the boxes (N, 4) that lies in each of the others (M, 4)."""
    share = np.empty((len(boxes), len(others)))
    for i in range(len(boxes)):
        for j in range(len(others)):
            share[i, j] = covered_share(boxes[i], others[j])
    return share


@njit(cache=True)
def well_placed(var: float) -> float:
    """Returns the probability that the middle of a box is right; var: variance of its x, m^2."""
    return erf(BODY / np.sqrt(2 * var))


@njit(cache=True)
def visible_shares(boxes: Array, scale: Array, existence: Array, var: Array) -> Array:
    """Returns the share (N,) of each of the boxes (N, 4) that no person in front covers, as far as places are known.

    scale (N,): px per m; existence (N,): probability that the person in the box exists; var (N, 4): of places, m^2.
    """
    share, foot = np.ones(len(boxes)), boxes[:, 1] + boxes[:, 2] / 2
    for i in range(len(boxes)):
        hidden = 0.0
        for j in range(len(boxes)):
            # few boxes are so near in x: the test that hardly ever succeeds comes first, so that the processor is right
            aside = 2 * abs(boxes[j, 0] - boxes[i, 0]) < boxes[i, 3] + boxes[j, 3]
            if aside and foot[j] - foot[i] > IN_FRONT * scale[i]:
                hidden = max(hidden, covered_share(boxes[i], boxes[j]) * existence[j])
        share[i] -= hidden * well_placed(var[i, 0])
    return share


@njit(cache=True)
def pair_costs(rows: Ints, evidence: Array, ratio: Array, new: float, detectable: Array, states: Array) -> Array:
    """Returns ln p(missed, box is nobody's) - ln p(measured) of P pairs of tracks `rows` and boxes, (P,).

    evidence (P,): ln of the box's density over that of false ones; ratio (P,): likelihood ratio of its score; new:
    expected boxes of new people over that of false ones. detectable (N,), states (3, N): of all tracks.
    """
    cost = np.empty(len(rows))
    for k in range(len(rows)):
        p, shown, false = detectable[rows[k]], states[SHOWN, rows[k]], states[FALSE, rows[k]]
        missed, measured = 1 - p * (shown + false), p * (shown * ratio[k] + false)
        cost[k] = np.log(missed * (1 + new * ratio[k])) - np.log(measured) - evidence[k]
    return cost


@njit(cache=True)
def add_doubles(total: Array, boxes: Array, owners: Array, scale: Array, owned: Array, earlier: bool) -> None:
    """Adds to `total` (M,), in place, the sum over the owners (N, 4) of owned (N,) exp(-d^2 / 2) / scale (N,)^2.

    d: distance of each of the boxes (M, 4) from the owner, in DOUBLE_SPREAD times its scale. earlier: only of owners
    with a smaller index than the box.
    """
    for j in range(len(owners)):
        spread = DOUBLE_SPREAD * scale[j]
        for i in range(j + 1 if earlier else 0, len(boxes) if owned[j] > 0 else 0):
            if abs(boxes[i, 0] - owners[j, 0]) < FARTHEST * spread:
                d2 = 0.0
                for axis in range(4):
                    d2 += ((boxes[i, axis] - owners[j, axis]) / spread) ** 2
                if d2 < FARTHEST**2:
                    total[i] += owned[j] / scale[j] ** 2 * np.exp(-0.5 * d2)


@njit(cache=True)
def reported(boxes: Array, bank: Array, existence: Array, measured: Bools, view: Array) -> Bools:
    """Returns flags (N,): True if a person's box is right with the probability LIKELY, and not leaving the field of
    view, from x, y view[0] to view[1], px, while missed."""
    shown = np.empty(len(boxes), np.bool_)
    for i in range(len(boxes)):
        shown[i] = existence[i] * (1.0 if measured[i] else well_placed(bank[VAR, i, 0])) >= LIKELY
        for axis in range(2):
            rate = bank[RATE, i, axis]
            edge = boxes[i, axis] + np.sign(rate) * boxes[i, 3 - axis] / 2
            shown[i] &= measured[i] or not ((rate < 0 and edge < view[0, axis]) or (rate > 0 and edge > view[1, axis]))
    return shown


@njit(cache=True)
def image_covariance(bank: Array, scale: Array) -> Array:
    """Returns the covariances (N, 4, 4) of x, y, vx, vy, px and px/s, of filters; scale (N,): px per m."""
    cov = np.zeros((len(scale), 4, 4))
    for i in range(len(scale)):
        for axis in range(2):
            var, cross, rate_var = bank[VAR:, i, axis] * (scale[i] * scale[i])
            cov[i, axis, axis], cov[i, axis + 2, axis + 2] = var, rate_var
            cov[i, axis, axis + 2] = cov[i, axis + 2, axis] = cross
    return cov
