"""Initial grouping of `stereo`: points in space whose spheres overlap are one group (eq. 12, sec. 3.4).

y_i R_0 y_j if the spheres of radius r round them overlap, so if they are at most 2 r apart. The groups are the
connected components of R_0 with enough points.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sim.types import Array, Ints


def sphere_groups(pos: Array, radius: float, least: int) -> Ints:
    """Return the group of each point, (M,), numbered 0, 1, … in the order of the groups' first points; -1 for none."""
    M = len(pos)
    if not M:
        return np.zeros(0, np.int64)
    if np.square(np.ptp(pos, axis=0)).sum() <= (2 * radius) ** 2:  # all of them are linked
        return np.full(M, 0 if least <= M else -1)
    i, j = cKDTree(pos).query_pairs(2 * radius, output_type="ndarray").T
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), (M, M)), directed=False)[1]
    large = np.bincount(label) >= least
    _, first = np.unique(label, return_index=True)
    rank = np.full(len(large), -1)
    order = np.argsort(first)
    rank[order[large[order]]] = np.arange(large.sum())
    return np.asarray(rank[label], np.int64)
