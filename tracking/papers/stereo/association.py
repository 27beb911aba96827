"""Data association of `stereo`: which group each point belongs to (sec. 3.3).

    (y_i - xi_j)' S^-1 (y_i - xi_j) < gamma                  search region of group j (eq. 8)
    m_total = p(y_i | xi_j, P_xi)^k_p p(lambda_i | v_j, P_v)^k_v            (eqs 9 to 11)
Each point belongs to the group with the largest m_total among those in whose region it lies.

Departures. k_p and k_v are exponents: as factors they cancel. S is the sum of the group's spread Sigma, the covariance
P of its centroid and that of the point, C_i; the same for velocities. A point in no region is attached to a group by
eq. 12 (`attached`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from sim.types import Array, Bools, Ints
from tracking.detect.features import SpacePoints
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.measurement import POS, VEL
from tracking.papers.stereo.space_group import SpaceGroup


def associated(groups: Sequence[SpaceGroup], points: SpacePoints, config: StereoConfig, radius: float) -> Ints:
    """Return for each of M points the number of its group in `groups`, (M,), -1 for none (eqs 8 to 11).

    groups: predicted to this frame. radius: of the spheres, m, for `attached`.
    """
    if not groups or not len(points):
        return np.full(len(points), -1)
    spread = np.stack([g.spread for g in groups])
    P = np.stack([g.ekf.P for g in groups])
    d2, position = _log_density(points.pos, points.cov, groups, (spread, P), POS, config)
    dv2, velocity = _log_density(points.vel, points.vel_cov, groups, (spread, P), VEL, config)
    total = config.position_weight * position + config.velocity_weight * velocity
    inside = d2 < config.gate
    owner = np.where(inside.any(0), np.where(inside, total, -np.inf).argmax(0), -1)
    return attached(points, owner, dv2 < config.gate, radius) if config.attach else owner


def attached(points: SpacePoints, owner: Ints, alike: Bools, radius: float) -> Ints:
    """Return the owners (M,) of M points after points in no region were attached to groups (ours).

    owner (M,): number of each point's group, -1 for none. alike (G, M): True where the velocity of a point is in the
    region of the group's velocities. radius: m. A point without a group gets that of the nearest point with one, if
    their spheres overlap and the velocity is alike.
    """
    free, taken = np.flatnonzero(owner < 0), np.flatnonzero(owner >= 0)
    if not len(free) or not len(taken):
        return owner
    away, nearest = cKDTree(points.pos[taken]).query(points.pos[free])
    group = owner[taken[nearest]]
    fits = (away <= 2 * radius) & alike[group, free]
    found = owner.copy()
    found[free[fits]] = group[fits]
    return found


def _log_density(
    y: Array, cov: Array, groups: Sequence[SpaceGroup], both: tuple[Array, Array], part: list[int], config: StereoConfig
) -> tuple[Array, Array]:
    """Returns squared Mahalanobis distances (G, M) and log densities, without their constant, of eqs 9 and 10.

    y (M, 3), cov (M, 3, 3): positions or velocities of the points; part: the entries of the state. both: Sigma and P
    (G, 6, 6) of the groups.
    """
    spread, P = (a[:, part][:, :, part] for a in both)
    S = spread[:, None] + np.zeros((1, len(y), 1, 1))
    if config.point_covariance:
        S = (spread + P)[:, None] + cov
    away = y - np.stack([g.ekf.x[part, 0] for g in groups])[:, None]
    inverse = np.linalg.inv(S)
    d2 = np.einsum("gmi,gmij,gmj->gm", away, inverse, away)
    return d2, (np.linalg.slogdet(inverse)[1] - d2) / 2
