"""Kernels of `group-pda`: the parts of an association's mass (eq. 4.2), and the noise of a measured centroid.

An association is a set of points that may be one group's; its mass, a relative weight, is m_d m_N m_g. m_d is the
density of the points' centroid about the predicted one: `log_density`, with covariance S = H P H' + R. P is the
covariance of the group's state, H picks its position, and R (`centroid_noise`) is the covariance of the measured
centroid. m_N is the density of the number of people in the points, given that of the group: `log_count`. m_g is 1 for a
feasible association (its points form one group), else 0. The module association_kernels puts them together. Symmetric
2 x 2 matrices are stored as (3,) = xx, xy, yy. The slots of the array `rules` are named here.
"""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array

# Slots of the array `rules`, RULES in all; tracking.papers.group_pda.scaled_parameters fills them. GATE: squared
# Mahalanobis radius in the group constraint, gamma / GATE_FACTOR. LINK: 2 r of R_0. PRIOR_XX, _XY, _YY: covariance
# that extents are shrunk to, with the weight PRIOR_WEIGHT in people. LEAST_WEIGHT: people below which a component is
# noise. POINT_SD: standard deviation of one person's measured position. COUNT_SD (people): sigma_n^2 = COUNT_SD^2 +
# (COUNT_SHARE N)^2. KEEP: alpha_s = alpha_N of eq. 2.4 per frame. GATE_FACTOR: share of its covariance that a Gaussian
# keeps inside the gate. REDRAWN: 1 if members are drawn anew in each frame. UNCONSTRAINED: 1 if a group takes all
# points in its region, without the group constraint (sec. 5.2.1). LEAST_OTHERS: lower bound of n - 1 in the variance
# of a mean drawn without replacement.
(GATE, LINK, PRIOR_XX, PRIOR_XY, PRIOR_YY, PRIOR_WEIGHT, LEAST_WEIGHT, POINT_SD, COUNT_SD,
 KEEP, GATE_FACTOR, REDRAWN, UNCONSTRAINED, LEAST_OTHERS) = range(14)  # fmt: skip
RULES = LEAST_OTHERS + 1
# The part of sigma_n that grows with N, per N.
COUNT_SHARE = 0.01
# Probability that a group's number of people does not depend on its number before.
NEWCOMERS = 0.02


@njit(cache=True)
def running_moments(points: Array, weights: Array, x: float, y: float, start: int) -> tuple[Array, Array, Array]:
    """Returns people (J,), centroid (J, 2) relative to (x, y) and covariance (J, 3) xx, xy, yy of each association's
    points.

    points (M, 2), weights (M,): people each stands for. Association j = 0, 1, … M - start has the first start + j
    points. The covariance is that with 1/N. All are 0 for an association without points. Its sums come from those of
    the one before (sec. 4.2.1).
    """
    count = len(points) - start + 1
    people, mean, cov = np.zeros(count), np.zeros((count, 2)), np.zeros((count, 3))
    n = sx = sy = sxx = sxy = syy = 0.0
    for k in range(len(points) + 1):
        if k >= start and n > 0:
            j = k - start
            u, v = sx / n, sy / n
            people[j], mean[j, 0], mean[j, 1] = n, u, v
            cov[j, 0], cov[j, 1], cov[j, 2] = max(sxx / n - u * u, 0.0), sxy / n - u * v, max(syy / n - v * v, 0.0)
        if k < len(points):
            w, u, v = weights[k], points[k, 0] - x, points[k, 1] - y
            n, sx, sy = n + w, sx + w * u, sy + w * v
            sxx, sxy, syy = sxx + w * u * u, sxy + w * u * v, syy + w * v * v
    return people, mean, cov


@njit(cache=True)
def log_count(people: float, size: float, width: float) -> float:
    """Returns log m_N (sec. 4.2), the log density, per person, of seeing `people` people in a group of `size` people.

    It is a Gaussian about `size` with variance `width`, people^2. Departure: a small part with the density
    (size + 1) / (size + 1 + people)^2, which does not depend on the width, gives it tails, because people who join a
    group come all at once.
    """
    gauss = np.exp(-0.5 * (people - size) ** 2 / width) / np.sqrt(2 * np.pi * width)
    return float(np.log((1 - NEWCOMERS) * gauss + NEWCOMERS * (size + 1) / (size + people + 1) ** 2))


@njit(cache=True)
def centroid_noise(
    counted: float, seen: float, cov: Array, extent: Array, size: float, rules: Array
) -> tuple[float, float, float]:
    """Returns R (xx, xy, yy), the covariance of the centroid of m = `counted` people about that of the n = `size`.

    Of the people counted, `seen` > 0 were measured in this frame; the others are missed members. cov (3,): covariance
    xx, xy, yy of the people counted; extent (2, 2): Sigma, covariance of the members; rules: parameters; r: its
    POINT_SD.
    - REDRAWN, n_y of eq. 2.3 if eq. 2.1 is read literally: Sigma / m.
    - Members keep their places (ours): r^2 / m + (1 - m / n) n / (n - 1) Sigma / m, the variance of a mean of m drawn
      out of n without replacement, with Sigma less r^2 (at least 0). m is at least 1, or n if that is less.
    - More are counted than are there: the members are n drawn out of the m, r^2 / n + (m - n) / (m - 1) cov / n.
    - Missed members (ours): r^2 is multiplied by 1 + 2 k / s, of k = m - s missed and s seen. The error of a place is
      used again in each frame in which the member is missed: if members are seen with probability p, its sum over many
      frames has 1 + 2 (1 - p) / p times the variance of that of fresh errors.

    n - 1 is at least LEAST_OTHERS: 1 from points, where a size between one and two means doubt about which of the two.
    """
    noise = rules[POINT_SD] ** 2  # Sigma is the covariance of measured positions, so it contains this variance
    xx, xy, yy = max(extent[0, 0] - noise, 0.0), extent[0, 1], max(extent[1, 1] - noise, 0.0)
    if rules[REDRAWN] > 0:
        return extent[0, 0] / counted, xy / counted, extent[1, 1] / counted
    noise *= 1 + 2 * (counted - seen) / seen
    if counted > size:  # some of them are strangers
        strange = (counted - size) / max(counted - 1, 1.0) / max(size, 1.0)
        own = noise / max(size, 1.0)
        return own + strange * cov[0], strange * cov[1], own + strange * cov[2]
    m = max(counted, min(1.0, size))
    unseen = (size - m) / max(size - 1, rules[LEAST_OTHERS]) / m if size > 1 else 0.0
    return noise / m + unseen * xx, unseen * xy, noise / m + unseen * yy


@njit(cache=True)
def log_density(dx: float, dy: float, S: Array) -> float:
    """Returns log m_d (sec. 4.2): the log of the Gaussian density N((dx, dy); 0, S), per unit of area.

    S (3,): covariance xx, xy, yy, positive definite, in the squared unit of dx and dy.
    """
    area = S[0] * S[2] - S[1] * S[1]
    d2 = (S[2] * dx * dx - 2 * S[1] * dx * dy + S[0] * dy * dy) / area
    return float(-0.5 * (d2 + np.log(area)) - np.log(2 * np.pi))
