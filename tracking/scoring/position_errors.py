"""Errors of positions, velocities and group extents: RMSE of mapped people, GOSPA, Wasserstein distance of extents.

RMSE, the root mean square error, counts only people of the tracker that are mapped (matched one to one) to true people.
It rewards a tracker that drops difficult people. So read it together with GOSPA, a distance between sets of positions
that also counts missed people and false tracks.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.candidate_pairs import point_pairs
from tracking.scoring.gospa import gospa
from tracking.scoring.people_and_groups import PersonRows, Surface

REACH = 2.0  # m: distance from which the similarity of two positions is 0; also the cut-off of GOSPA


def position_scores(
    true: PersonRows, est: PersonRows, mapping: Ints, surface: Surface, plane: str, scale: float, frames: int
) -> dict[str, float]:
    """Returns RMSE_pos, RMSE_vel, GOSPA and its parts by key; {} without positions or scale on the surface."""
    compared = compared_positions(true, est, surface, plane, scale)
    if compared is None:
        return {}
    true_pos, est_pos, *vel = compared
    pairs = point_pairs(true.rows, est.rows, true_pos, est_pos, REACH * scale)
    return people_errors(mapping, true_pos, est_pos, *vel) | gospa(pairs, REACH * scale, frames)


def compared_positions(
    true: PersonRows, est: PersonRows, surface: Surface, plane: str, scale: float
) -> tuple[Array, Array, Array | None, Array | None] | None:
    """Returns positions on the surface (R, 2), (S, 2), and velocities or None; None if a side has no positions."""
    true_pos, est_pos = true.positions_on(surface, "ground"), est.positions_on(surface, plane)
    if true_pos is None or est_pos is None or not 0 < scale < np.inf:
        return None
    return (true_pos, est_pos, true.vel, est.vel) if surface == "ground" else (true_pos, est_pos, None, None)


def people_errors(
    mapping: Ints, true_pos: Array, est_pos: Array, true_vel: Array | None = None, est_vel: Array | None = None
) -> dict[str, float]:
    """Returns RMSE_pos and RMSE_vel of mapped people by key; mapping (S,): true row of each estimated one, -1 none."""
    j = np.flatnonzero(mapping >= 0)
    i = mapping[j]
    found = {"RMSE_pos": root_mean_square(est_pos[j] - true_pos[i]), "RMSE_vel": float("nan")}
    if true_vel is not None and est_vel is not None:
        found["RMSE_vel"] = root_mean_square(est_vel[j] - true_vel[i])
    return found


def root_mean_square(errors: Array) -> float:
    """Returns the root of the mean of |e|^2 over the finite rows e of errors (K, D), nan without any."""
    squares = np.square(errors).sum(axis=1)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def gaussian_wasserstein(pos: Array, extent: Array, other_pos: Array, other_extent: Array) -> Array:
    """Returns the 2-Wasserstein distances (K,) of K pairs of Gaussians in the plane (Givens & Shortt 1984).

        d^2 = |m1 - m2|^2 + tr(S1 + S2 - 2 (S1^1/2 S2 S1^1/2)^1/2)
    with means m (K, 2) and covariances S (K, 2, 2).
    """
    # tr M^1/2 = (tr M + 2 (det M)^1/2)^1/2 of a symmetric 2 x 2 matrix M >= 0; here M = S1^1/2 S2 S1^1/2
    inner = np.einsum("kab,kba->k", extent, other_extent)
    det = np.maximum(_det(extent), 0) * np.maximum(_det(other_extent), 0)
    shape = np.trace(extent + other_extent, axis1=1, axis2=2) - 2 * np.sqrt(np.maximum(inner + 2 * np.sqrt(det), 0))
    return np.asarray(np.sqrt(np.square(pos - other_pos).sum(axis=1) + np.maximum(shape, 0)))


def _det(m: Array) -> Array:
    return np.asarray(m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0])
