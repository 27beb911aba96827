"""Slow, obvious oracles of grouped measurements: G_0, G_x, G_y of Gennari & Hager (2004), 3.3, and ellipses that meet.

Covariances are (2, 2), the region of one {y : (y - m)' S^-1 (y - m) <= gate}. Nothing here is incremental.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.spatial.distance import cdist

from tracking.filters.components import Constraint

ANGLES = np.linspace(0, 2 * np.pi, 120, endpoint=False)


def nearest(mean, shape, other_mean, other_shape):
    """(K,) how far the other ellipse is: the least (y - m)' A^-1 (y - m) of its points y, at most 1 where they meet.

    All of shape (K, 2) and (K, 2, 2). Where m itself is in the other ellipse it is 0; else the nearest point is on the
    boundary c + M (cos t, sin t). In coordinates where A = I its square distance is a trigonometric polynomial of
    degree 2 in t, so that fine steps find the right valley and Newton's find its bottom.
    """
    white = np.linalg.inv(np.linalg.cholesky(shape))
    c = np.einsum("kij,kj->ki", white, other_mean - mean)[:, :, None]
    M = white @ np.linalg.cholesky(other_shape)

    def square(t):
        u = np.stack([np.cos(t), np.sin(t)], axis=1)
        y, first, second = c + M @ u, M @ np.stack([-u[:, 1], u[:, 0]], axis=1), M @ -u
        slope, bend = 2 * (y * first).sum(1), 2 * (first**2 + y * second).sum(1)
        return (y**2).sum(1), slope, bend

    coarse = square(np.tile(ANGLES, (len(c), 1)))[0]
    valley = (coarse <= np.roll(coarse, 1, axis=1)) & (coarse <= np.roll(coarse, -1, axis=1))  # one or two
    t = ANGLES[np.argsort(np.where(valley, coarse, np.inf), axis=1)[:, :2]]
    best = square(t)[0]
    for _ in range(6):
        _, slope, bend = square(t)
        t = t - np.clip(np.divide(slope, bend, out=np.zeros_like(t), where=bend > 0), -0.06, 0.06)
        best = np.minimum(best, square(t)[0])
    inside = np.linalg.solve(M, c)[:, :, 0]
    return np.where((inside**2).sum(1) <= 1, 0.0, best.min(1))


def meet(mean, covariance, other_mean, other_covariance, gate):
    """(K,) whether the regions have a point in common."""
    return nearest(mean, gate * covariance, other_mean, gate * other_covariance) <= 1


def linked(points, link):
    """G_0: (M,) the component of each point, by all distances."""
    return by_first(connected_components(cdist(points, points) <= link, directed=False)[1]) if len(points) else []


def by_first(label):
    """The same parts, numbered in the order of their first points; -1 stays."""
    number = {-1: -1}
    for g in label:
        number.setdefault(int(g), len(number) - 1)
    return np.array([number[int(g)] for g in label], int)


def region(points, weights, rule: Constraint):
    """Mean and covariance of a set of points, shrunk: (N S + n0 S0) / (N + n0)."""
    n = weights.sum()
    mean = weights @ points / n
    d = points - mean
    return mean, ((weights * d.T) @ d + rule.strength * rule.prior) / (n + rule.strength)


def closure(parts, points, weights, rule: Constraint):
    """G_x of parts (lists of rows), to closure: those whose regions overlap are joined, also through others, then the
    joined ones, until no two overlap."""
    while True:
        pairs = list(combinations(range(len(parts)), 2))
        if not pairs:
            return parts
        fits = [region(points[p], weights[p], rule) for p in parts]
        mean, S = np.array([m for m, _ in fits]), np.array([s for _, s in fits])
        i, j = np.array(pairs).T
        near = np.zeros((len(parts), len(parts)), bool)
        near[i, j] = meet(mean[i], S[i], mean[j], S[j], rule.gate)
        if not near.any():
            return parts
        label = connected_components(near, directed=False)[1]
        parts = [[y for k in np.flatnonzero(label == g) for y in parts[k]] for g in range(label.max() + 1)]


def partition(points, weights, rule: Constraint, label=None):
    """G_y: (M,) the group of each point, -1 for components of less than the least weight."""
    label = linked(points, rule.link) if label is None else label
    components = [np.flatnonzero(label == g).tolist() for g in np.unique(label)]
    parts = [p for p in components if weights[p].sum() >= rule.least]
    group = np.full(len(points), -1)
    for g, part in enumerate(closure(parts, points, weights, rule)):
        group[part] = g
    return by_first(group)


def is_group(points, weights, rule: Constraint):
    """|G_y| = 1; nobody, or noise alone, is no group."""
    return len(points) > 0 and partition(points, weights, rule, linked(points, rule.link)).max() == 0


def prefixes(points, weights, start, rule: Constraint):
    """(M - start + 1,) whether the first start, start + 1, … points are a group, each looked at afresh."""
    return np.array([is_group(points[:n], weights[:n], rule) for n in range(start, len(points) + 1)])
