"""Data association of `stereo`: which group each point belongs to (sec. 3.3).

    (y_i - xi_j)' S^-1 (y_i - xi_j) < gamma                  search region of group j (eq. 8)
    m_total = p(y_i | xi_j, P_xi)^k_p p(lambda_i | v_j, P_v)^k_v            (eqs 9 to 11)
Each point belongs to the group with the largest m_total among those in whose region it lies.

Departures. k_p and k_v are exponents: as factors they cancel. S is the sum of the group's spread Sigma, the covariance
P of its centroid and that of the point, C_i; the same for velocities.
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
    """Return for each of M points the number of its group in `groups`, (M,), -1 for none (eqs 8 to 11).

    groups: predicted to this frame.
    """
    if not groups or not len(points):
        return np.full(len(points), -1)
    spread = np.stack([g.spread for g in groups])
    P = np.stack([g.ekf.P for g in groups])
    d2, position = _log_density(points.pos, points.cov, groups, (spread, P), POS, config)
    _, velocity = _log_density(points.vel, points.vel_cov, groups, (spread, P), VEL, config)
    total = config.position_weight * position + config.velocity_weight * velocity
    inside = d2 < config.gate
    return np.where(inside.any(0), np.where(inside, total, -np.inf).argmax(0), -1)


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
