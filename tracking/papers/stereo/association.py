"""Data association of `stereo`: which group each point belongs to (sec. 3.3).

    (y_i - xi_j)' S^-1 (y_i - xi_j) < gamma                  search region of group j (eq. 8)
    m_total = p(y_i | xi_j, P_xi)^k_p p(lambda_i | v_j, P_v)^k_v            (eqs 9 to 11)
Each point belongs to the group with the largest m_total among those in whose region it lies.

Departures. k_p = 1 and k_v are exponents: as factors they cancel. S is the sum of the group's spread Sigma, the
covariance P of its centroid and that of the point, C_i; the same for velocities.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.types import Array, Ints
from tracking.detect.features import SpacePoints
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.measurement import POS, VEL
from tracking.papers.stereo.space_group import SpaceGroup


def associated(groups: Sequence[SpaceGroup], points: SpacePoints, config: StereoConfig) -> Ints:
    """Returns for each of M points the number of its group in `groups`, (M,), -1 for none (eqs 8 to 11)."""
    if not groups or not len(points):
        return np.full(len(points), -1)
    x = np.stack([g.ekf.x[:, 0] for g in groups])
    own = np.stack([g.spread + g.ekf.P if config.point_covariance else g.spread for g in groups])
    total = np.full((len(groups), len(points)), -np.inf)
    g, m = _in_reach(x, own, points, config)
    d2, position = _log_density(points.pos[m] - x[g][:, POS], own[g], points.cov[m], POS, config)
    near = d2 < config.gate
    g, m, position = g[near], m[near], position[near]
    _, velocity = _log_density(points.vel[m] - x[g][:, VEL], own[g], points.vel_cov[m], VEL, config)
    total[g, m] = position + config.velocity_weight * velocity
    inside = np.zeros(total.shape, bool)
    inside[g, m] = True
    return np.where(inside.any(0), total.argmax(0), -1)


def _in_reach(x: Array, own: Array, points: SpacePoints, config: StereoConfig) -> tuple[Ints, Ints]:
    trace, square = np.einsum("gii->g", own[:, POS][:, :, POS]), np.zeros((len(x), len(points)))
    spread = np.einsum("mii->m", points.cov) if config.point_covariance else np.zeros(len(points))
    for d, k in enumerate(POS):
        square += np.square(points.pos[:, d] - x[:, k, None])
    rows, columns = np.nonzero(square <= config.gate * (1 + 1e-9) * (trace[:, None] + spread))
    return np.asarray(rows, np.int64), np.asarray(columns, np.int64)


def _log_density(away: Array, own: Array, cov: Array, part: list[int], config: StereoConfig) -> tuple[Array, Array]:
    S = own[:, part][:, :, part]
    if config.point_covariance:
        S = S + cov
    inverse = np.linalg.inv(S)
    d2 = np.einsum("ri,rij,rj->r", away, inverse, away)
    return d2, (np.linalg.slogdet(inverse)[1] - d2) / 2
