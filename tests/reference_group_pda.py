"""Slow, obvious oracle of a group's associations: Gennari & Hager (2004), 4.1 to 4.3, as plain numpy with loops.

A point is (place, people it stands for). Rules come by name; nothing is incremental, each association is looked at by
itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammainc, softmax
from scipy.stats import multivariate_normal, norm

from tests import reference_components
from tracking.filters.components import Constraint

H = np.eye(2, 4)
NEWCOMERS = 0.02  # probability that the number of people is any


@dataclass(frozen=True)
class Rules:
    constraint: Constraint
    noise: float  # standard deviation of one person's measured place
    count_noise: float
    keep: float
    correct: bool  # what the gate cuts off is put back
    redrawn: bool
    unconstrained: bool = False
    others: float = 1.0  # people beside one, of those who are there, at least

    @property
    def numbers(self):
        """`rules` of the kernels."""
        c, P = self.constraint, self.constraint.prior
        cut = truncation(c.gate) if self.correct else 1.0
        return np.array([
            c.gate, c.link, P[0, 0], P[0, 1], P[1, 1], c.strength, c.least, self.noise, self.count_noise,
            self.keep, cut, self.redrawn, self.unconstrained, self.others,
        ], float)  # fmt: skip


def truncation(gate, dims=2):
    """F_chi2,d+2(gate) / F_chi2,d(gate): how much of its covariance a Gaussian keeps inside the gate."""
    return gammainc(dims / 2 + 1, gate / 2) / gammainc(dims / 2, gate / 2)


def search_region(P, extent, noise):
    """Sigma + H P H' + noise I of one group."""
    return extent + H @ P @ H.T + noise * np.eye(2)


def search(points, x, region, gate):
    """(G, M) squared Mahalanobis distances, inf outside the region."""
    d2 = np.full((len(x), len(points)), np.inf)
    for g, S in enumerate(region):
        for k, y in enumerate(points):
            d = y - x[g, :2]
            if d @ np.linalg.solve(S, d) < gate:
                d2[g, k] = d @ np.linalg.solve(S, d)
    return d2


def shares(points, x, region, size, owner, may):
    """(G, M) probability of each group to have made a point, by N_g N(y; xi_g, S_g); 1 for its owner."""
    found = np.zeros((len(x), len(points)))
    for k, y in enumerate(points):
        if owner[k] >= 0:
            found[owner[k], k] = may[owner[k], k]
            continue
        those = np.flatnonzero(may[:, k])
        for g in those:
            found[g, k] = size[g] * multivariate_normal(x[g, :2], region[g]).pdf(y) if len(those) > 1 else 1.0
        found[:, k] /= found[:, k].sum() or 1.0
    return found


def claims(d2, own, hits, g):
    """Unshared points of group g, and the shared ones in the order of their distance (4.1)."""
    inside = [k for k in range(len(own)) if np.isfinite(d2[g, k]) or own[k] == g]
    return [k for k in inside if hits[k] < 2], sorted((k for k in inside if hits[k] > 1), key=lambda k: d2[g, k])


def centroid_noise(seen, cov, extent, size, rules, fresh=None):
    """R of the centroid of `seen` people of a group of `size`; cov: their own covariance.

    The extent is that of measured places. Members redrawn in each frame: as many of those, extent / m. Members who keep
    their places: r^2 I / m and the variance of the mean of m out of n true places drawn without replacement, (n - m) /
    (n - 1) Sigma / m, Sigma being the extent without r^2 I; at least one (or all) is seen. If more are seen than there
    are, the n members are drawn out of the m seen. fresh: of the seen, those of this frame (None: all); the errors of
    the others are used again.
    """
    noise = rules.noise**2 * np.eye(2)
    if rules.redrawn:
        return extent / seen
    true = extent - noise
    np.fill_diagonal(true, np.maximum(np.diag(true), 0.0))
    if fresh is not None:
        noise = noise * (2 * seen - fresh) / fresh
    if seen > size:
        return noise / max(size, 1.0) + cov * (seen - size) / max(seen - 1, 1.0) / max(size, 1.0)
    m = max(seen, min(1.0, size))
    return noise / m + (true * (size - m) / max(size - 1, rules.others) / m if size > 1 else 0.0)


def moments(points, weights):
    n = weights.sum()
    mean = weights @ points / n
    return n, mean, (weights * (points - mean).T) @ (points - mean) / n


def associations(mine, shared, points, weights, rules):
    """The feasible sets of points, largest last; rows of `points`."""
    sets = [mine + shared[:j] for j in range(len(shared) + 1)]
    if rules.unconstrained:
        return sets[-1:]
    return [s for s in sets if reference_components.is_group(points[s], weights[s], rules.constraint)]


def masses(sets, mine, shared, points, weights, own, x, P, extent, size, rules):
    """Masses of the associations, m_d m_N (4.2), normalised; each one's R.

    m_N is a mass of numbers of people, which differ by those of a point: Gaussian, with tails.
    """
    step = weights[mine + shared].mean()
    sigma = np.hypot(rules.count_noise, 0.01 * size)
    log, R = [], []
    for s in sets:
        n, mean, cov = moments(points[s], weights[s])
        R.append(centroid_noise(n, cov, extent, size, rules, weights[s] @ (own[s] < 0) or None))
        close = multivariate_normal(x[:2], H @ P @ H.T + R[-1]).logpdf(mean)
        many = (1 - NEWCOMERS) * norm(size, sigma).pdf(n) + NEWCOMERS * (size + 1) / (size + 1 + n) ** 2
        log.append(close + np.log(step * many))
    return softmax(log), R


def update(g, points, weights, d2, own, hits, x, P, extent, size, hold, rules):
    """One group after its points: state, rows chosen, x, P, extent, size."""
    mine, shared = claims(d2, own, hits, g)
    same = x, P, extent, size
    if not mine + shared:
        return "nothing", [], *same
    sets = associations(mine, shared, points, weights, rules)
    if not sets:
        some = mine + shared
        if reference_components.partition(points[some], weights[some], rules.constraint).max() < 0:
            return "nothing", [], *same  # noise
        return "null", some, *same
    beta, R = masses(sets, mine, shared, points, weights, own, x, P, extent, size, rules)
    states, covariances = [], []
    for s, r in zip(sets, R, strict=True):
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + r) * (own[s] < 0).any()
        states.append(x + K @ (moments(points[s], weights[s])[1] - x[:2]))
        covariances.append(P - K @ H @ P)
    new_x = beta @ np.array(states)
    new_P = sum(b * (C + np.outer(y - new_x, y - new_x)) for b, y, C in zip(beta, states, covariances, strict=True))
    new_extent, new_size = extent, size
    if not hold:
        new_extent, new_size = adapted(sets, beta, points, weights, extent, size, rules)
    return "measured", sets[int(np.argmax(beta))], new_x, new_P, new_extent, new_size


def adapted(sets, share, points, weights, extent, size, rules):
    """(2.4) of each association, mixed."""
    c, cut = rules.constraint, truncation(rules.constraint.gate) if rules.correct else 1.0
    new_extent, new_size = 0.0, 0.0
    for b, s in zip(share, sets, strict=True):
        n, _, S = moments(points[s], weights[s])
        shrunk = (n * S + c.strength * c.prior) / (n + c.strength) / cut
        new_extent = new_extent + b * (rules.keep * extent + (1 - rules.keep) * shrunk)
        new_size = new_size + b * (rules.keep * size + (1 - rules.keep) * n)
    return new_extent, new_size
