"""Merging of `stereo`'s groups: regions of the full state that overlap (eqs 13 to 15, sec. 3.5).

    x_i R x_j  if MR_i and MR_j overlap; I_n: the connected components of R          (13)
    X = sum of n_i X_i,   Sigma = sum of n_i {Sigma_i + (X_i - X)(X_i - X)'}         (14), (15)
MR_i is the ellipsoid (x - X_i)' Sigma_i^-1 (x - X_i) <= merge_gate in six dimensions, and n_i = N_i / sum N.
Two ellipsoids are tested exactly (tracking.filters.ellipsoid_overlap).

Tentative groups merge, too: without an event, as nobody knows of them. The paper does not say what P of a merged group
is: here it is that of a weighted mean, sum of n_i^2 P_i. The group with most points keeps its id, of those that have
been there for SETTLED if there are any, else of the confirmed ones (ours).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from sim.types import Array
from tracking.filters.ellipsoid_overlap import separation
from tracking.grouping.whole_groups import NO_ID, WholeGroupEvent
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.space_group import SpaceGroup

# s: a group that came less long ago, and did not split from another one, enters with the other one; that is no merge
# (ours).
SETTLED = 1.0


def merge(groups: list[SpaceGroup], config: StereoConfig, t: float) -> list[WholeGroupEvent]:
    """Merge groups of the list, in place, at time t (s), and return the events of unions of two or more confirmed
    groups: merge, or enter if at most one of these has been there for 1 s or split from another one.
    """
    events = [_merge(groups, parts, t) for parts in connected(groups, config.merge_gate)]
    return [event for event in events if event is not None]


def overlap(a: SpaceGroup, b: SpaceGroup, gate: float) -> bool:
    """Returns True if the regions MR of two groups have a common point (eq. 13); gate: squared Mahalanobis radius."""
    d = (b.ekf.x - a.ekf.x)[:, 0]
    return separation(d, a.spread, b.spread) <= gate


def _close_pairs(groups: Sequence[SpaceGroup], gate: float) -> list[tuple[int, int]]:
    if len(groups) < 2:
        return []
    x = np.stack([g.ekf.x for g in groups])
    A = np.stack([g.spread for g in groups])
    # 2 f(1/2) is at least the squared distance over the trace of both Sigma: most pairs need no more than that
    trace, square = np.trace(A, axis1=1, axis2=2), np.zeros((len(groups), len(groups)))
    for values in x[..., 0].T:
        square += np.square(values - values[:, None])
    i, j = np.nonzero(np.triu(square <= 2 * gate * (1 + 1e-9) * (trace[:, None] + trace), 1))
    d = x[j] - x[i]
    half = (d * np.linalg.solve(A[i] + A[j], d)).sum((1, 2)) / 2
    close = half <= gate
    return list(zip(i[close].tolist(), j[close].tolist(), strict=True))


def pooled(states: Array, spreads: Array, counts: Array) -> tuple[Array, Array]:
    """Returns the state (D,) and Sigma (D, D) of a merged group (eqs 14, 15)."""
    n = counts / counts.sum()
    X = n @ states
    away = states - X
    return X, np.einsum("k,kij->ij", n, spreads + away[:, :, None] * away[:, None])


def covariance_of_mean(n: Array, P: Array) -> Array:
    """Returns the covariance (D, D) of a mean with weights n (K,), sum 1, of states with covariances P (K, D, D)."""
    return np.asarray(np.einsum("k,kij->ij", n**2, P))


def connected(groups: Sequence[SpaceGroup], gate: float) -> list[list[SpaceGroup]]:
    """Returns the sets I_n of two or more groups whose regions overlap directly or through others (eq. 13)."""
    pairs = [(i, j) for i, j in _close_pairs(groups, gate) if overlap(groups[i], groups[j], gate)]
    if not pairs:
        return []
    i, j = np.array(pairs, np.int64).T
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), (len(groups), len(groups))), directed=False)[1]
    return [[groups[k] for k in np.flatnonzero(label == c).tolist()] for c in np.unique(label[i]).tolist()]


def _merge(groups: list[SpaceGroup], parts: list[SpaceGroup], t: float) -> WholeGroupEvent | None:
    known = [g for g in parts if g.confirmed]
    settled = [g for g in known if g.first_seen <= t - SETTLED or g.parent != NO_ID]
    kept = max(settled or known or parts, key=lambda g: (g.count, -g.id))
    counts = np.array([g.count for g in parts])
    n, old = counts / counts.sum(), [g.pos for g in parts]
    X, kept.spread = pooled(np.stack([g.ekf.x[:, 0] for g in parts]), np.stack([g.spread for g in parts]), counts)
    kept.ekf.x, kept.ekf.P = X[:, None], covariance_of_mean(n, np.stack([g.ekf.P for g in parts]))
    kept.members = np.concatenate([g.members + p for g, p in zip(parts, old, strict=True)]) - kept.pos
    kept.count = float(counts.sum())
    kept.first_seen, kept.last_seen = min(g.first_seen for g in parts), max(g.last_seen for g in parts)
    kept.measured_time = max(g.measured_time for g in parts)
    gone = {id(g) for g in parts if g is not kept}
    groups[:] = [g for g in groups if id(g) not in gone]
    if not known:
        kept.parent = max(g.parent for g in parts)
        return None
    before = tuple(sorted(g.id for g in known))
    for g in groups:
        g.parent = kept.id if g.parent in before else g.parent
    if len(known) < 2:
        return None
    kept.apart_since = float("nan")
    x, y = kept.pos[:2].tolist()
    return WholeGroupEvent("merge" if len(settled) > 1 else "enter", t, before, (kept.id,), (x, y))
