"""How `stereo`'s groups begin, merge, split and end.

Merging (eqs 13 to 15, sec. 3.5): regions of the full state that overlap.

    x_i R x_j  if MR_i and MR_j overlap; I_n: the connected components of R          (13)
    X = sum of n_i X_i,   Sigma = sum of n_i {Sigma_i + (X_i - X)(X_i - X)'}         (14), (15)
MR_i is the ellipsoid (x - X_i)' Sigma_i^-1 (x - X_i) <= merge_gate in six dimensions, and n_i = N_i / sum N.
Two ellipsoids are tested exactly, see below.

Tentative groups merge, too: without an event, as they are not reported (ours). The paper has no tentative groups: a new
one is a tracker from its first frame on (sec. 3.4). The paper does not say what P of a merged group is: here it is that
of a weighted mean, sum of n_i^2 P_i. The confirmed group with most points keeps its id (ours).

The test (`separation`): Gilitschenski & Hanebeck, "A robust computational test for overlap of two arbitrary-dimensional
ellipsoids in fault-detection of Kalman filters", 2012: the ellipsoids y' A^-1 y <= 1 and (y - d)' B^-1 (y - d) <= 1 are
disjoint if and only if f(s) = d' (A / (1 - s) + B / s)^-1 d > 1 for some s in (0, 1). f is concave. With B = L L', A' =
L^-1 A L^-T = U diag(l) U' and e = U' L^-1 d: f(s) = sum of s (1 - s) e_k^2 / (1 - s + s l_k), with A and B exchanged
where s and 1 - s are. Ellipses in the plane have kernels of their own: tracking.filters.components_kernels.

Splitting (ours: the paper has no split). A group splits if its points are two or more groups by eq. 12 for
`split_time`, and if these would not all merge again at once by eq. 13. All parts are newborn from their points, with
the velocity of the group and its covariance. The part with most points (then the one nearest to the group's position)
keeps the id; the others are its children.

Initial grouping, births, confirmation and deletion; ours, except for the initial grouping. Points in space whose
spheres of radius r overlap are linked (eq. 12, sec. 3.4): those at most 2 r apart. The groups are the connected
components with enough points.

A new group is tentative, without an id, until it has been measured for `confirm_time`. A group that has not been
measured for `coast_time`, a tentative one for `confirm_time`, is deleted.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sim.types import Array, Ints
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.space_group import VEL, Measurement, Motion3D, SpaceGroup, newborn

STEPS = 60  # Halvings of the interval in which f has its maximum.


def separation(d: Array, A: Array, B: Array) -> float:
    """Returns the largest f(s), s in [0, 1], of two ellipsoids with matrices A, B (D, D) whose centres differ by d
    (D,); they overlap if it is 1 or less."""
    # The result is also the squared factor by which both would have to be enlarged to touch.
    L = np.linalg.cholesky(B)
    inverse = np.linalg.inv(L)
    values, U = np.linalg.eigh(inverse @ A @ inverse.T)
    e2 = np.square(U.T @ (inverse @ d))

    def slope(s: float) -> float:
        m = s * values + (1 - s)  # f = sum e2 s (1 - s) / m
        return float((e2 * ((1 - 2 * s) * m - s * (1 - s) * (values - 1)) / m**2).sum())

    low, high = 0.0, 1.0
    # f is concave, so that its slope has one root
    for _ in range(STEPS):
        s = (low + high) / 2
        low, high = (s, high) if slope(s) > 0 else (low, s)
    s = (low + high) / 2
    return float((e2 * s * (1 - s) / (s * values + (1 - s))).sum())


def merge(groups: list[SpaceGroup], config: StereoConfig, t: float) -> list[WholeGroupEvent]:
    """Merges groups of the list, in place, at t (s); returns an event for each union of two or more confirmed ones."""
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
    kept = max(known or parts, key=lambda g: (g.count, -g.id))
    counts = np.array([g.count for g in parts])
    n, old = counts / counts.sum(), [g.pos for g in parts]
    X, kept.spread = pooled(np.stack([g.ekf.x[:, 0] for g in parts]), np.stack([g.spread for g in parts]), counts)
    kept.ekf.x, kept.ekf.P = X[:, None], np.einsum("k,kij->ij", n**2, np.stack([g.ekf.P for g in parts]))
    kept.members = np.concatenate([g.members + p for g, p in zip(parts, old, strict=True)]) - kept.pos
    kept.count, kept.rise = float(counts.sum()), float(n @ [g.rise for g in parts])
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
    return WholeGroupEvent("merge", t, before, (kept.id,), (x, y))


def split(
    group: SpaceGroup, points: SpacePoints, part: Ints, measurement: Measurement, motion: Motion3D, t: float
) -> list[SpaceGroup]:
    """Returns the children of a group whose M points have been in parts for `split_time`, [] if it does not split."""
    count = int(part.max(initial=-1)) + 1
    if count < 2:
        group.apart_since = float("nan")
        return []
    if np.isnan(group.apart_since):
        group.apart_since = t
    if t - group.apart_since < motion.config.split_time - 1e-9:
        return []
    away = [float(np.linalg.norm(points.pos[part == k].mean(0) - group.pos)) for k in range(count)]
    largest = int(np.lexsort((np.array(away), -np.bincount(part[part >= 0])))[0])
    born = [newborn(points.at(part == k), measurement, motion, t) for k in range(count)]
    for child in born:
        child.ekf.x[VEL] = group.ekf.x[VEL]
        child.ekf.P[np.ix_(VEL, VEL)] = group.ekf.P[np.ix_(VEL, VEL)]
        child.first_seen, child.measured_time = group.apart_since, group.measured_time
    if [len(parts) for parts in connected(born, motion.config.merge_gate)] == [count]:
        return []
    own = born.pop(largest)
    group.ekf, group.spread, group.count, group.members = own.ekf, own.spread, own.count, own.members
    group.rise, group.apart_since = own.rise, float("nan")
    for child in born:
        child.parent = group.id
    return born


def born(points: SpacePoints, group: Ints, measurement: Measurement, motion: Motion3D, t: float) -> list[SpaceGroup]:
    """Returns the tentative groups of free points (sec. 3.4); group (M,): number of each point's group, -1 for none."""
    return [newborn(points.at(group == k), measurement, motion, t) for k in range(int(group.max(initial=-1)) + 1)]


def confirm(groups: list[SpaceGroup], config: StereoConfig, t: float, ids: GroupIds) -> list[WholeGroupEvent]:
    """Gives ids to tentative groups that have been measured for `confirm_time`, and returns the events."""
    events, alive = [], {g.id for g in groups if g.confirmed}
    for g in groups:
        if g.confirmed or g.last_seen < t or g.measured_time < config.confirm_time - 1e-9:
            continue
        g.id = ids.new()
        pos = (float(g.pos[0]), float(g.pos[1]))
        if g.parent in alive:
            events.append(WholeGroupEvent("split", g.first_seen, (g.parent,), tuple(sorted((g.parent, g.id))), pos))
        else:
            events.append(WholeGroupEvent("enter", g.first_seen, (), (g.id,), pos))
    return events


def remove_lost(groups: list[SpaceGroup], config: StereoConfig, t: float) -> list[WholeGroupEvent]:
    """Deletes groups without measurements for too long, in place, and returns the leave events of confirmed ones."""
    events, kept = [], []
    for g in groups:
        if t - g.last_seen <= (config.coast_time if g.confirmed else config.confirm_time) + 1e-9:
            kept.append(g)
        elif g.id != NO_ID:
            events.append(WholeGroupEvent("leave", t, (g.id,), (), (float(g.pos[0]), float(g.pos[1]))))
    groups[:] = kept
    return events


def sphere_groups(pos: Array, radius: float, least: int) -> Ints:
    """Returns the group of each point, (M,), numbered 0, 1, … in the order of the groups' first points; -1 for none."""
    M = len(pos)
    if not M:
        return np.zeros(0, np.int64)
    if np.square(np.ptp(pos, axis=0)).sum() <= (2 * radius) ** 2:  # all of them are linked
        return np.full(M, 0 if least <= M else -1)
    i, j = cKDTree(pos).query_pairs(2 * radius, output_type="ndarray").T
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), (M, M)), directed=False)[1]
    large = np.bincount(label) >= least  # labels are in the order of first points
    return np.asarray(np.where(large, np.cumsum(large) - 1, -1)[label])
