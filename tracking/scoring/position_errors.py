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
    """Returns a dict: RMSE_pos, RMSE_vel (root mean square errors of mapped people), GOSPA and its three parts
    GOSPA_localisation, GOSPA_missed and GOSPA_false.

    true, est: the R true and S tracked people in frames. mapping (S,): index of the row of `true` that each row of
    `est` is mapped to, -1 none. surface: "ground" or "image", where positions are compared. plane: of `est.pos`,
    "ground", "space" or "image". scale: units of the surface per metre. frames: number of scored frames.

    Lengths are in m on the ground or px in the image, RMSE_vel in m/s. RMSE_vel is nan in the image and where a side
    has no velocities; both RMSE are nan without mapped people. GOSPA's cut-off distance is 2 m; its four values are nan
    if frames is 0. The result is empty if one side has no positions on the surface, or if the scale is not finite
    and above 0.
    """
    compared = compared_positions(true, est, surface, plane, scale)
    if compared is None:
        return {}
    true_pos, est_pos, *vel = compared
    pairs = point_pairs(true.rows, est.rows, true_pos, est_pos, REACH * scale)
    return people_errors(mapping, true_pos, est_pos, *vel) | gospa(pairs, REACH * scale, frames)


def compared_positions(
    true: PersonRows, est: PersonRows, surface: Surface, plane: str, scale: float
) -> tuple[Array, Array, Array | None, Array | None] | None:
    """Returns true and estimated positions on the surface, (R, 2) and (S, 2), then true and estimated velocities or
    None.

    surface: "ground" or "image". plane: of `est.pos`. scale: units of the surface per metre. Velocities are None in the
    image and where a side has none. The result is None if a side has no positions on the surface, or if the scale is
    not finite and above 0.
    """
    true_pos, est_pos = true.positions_on(surface, "ground"), est.positions_on(surface, plane)
    if true_pos is None or est_pos is None or not 0 < scale < np.inf:
        return None
    return (true_pos, est_pos, true.vel, est.vel) if surface == "ground" else (true_pos, est_pos, None, None)


def people_errors(
    mapping: Ints, true_pos: Array, est_pos: Array, true_vel: Array | None = None, est_vel: Array | None = None
) -> dict[str, float]:
    """Returns a dict of RMSE_pos and RMSE_vel, root mean square errors over mapped people, in the units of the inputs.

    mapping (S,): index of the true row that each estimated row is mapped to, -1 none. true_pos, true_vel (R, 2) and
    est_pos, est_vel (S, 2): x, y of one plane, in one unit. Rows with a nan or infinity are left out. A score is nan if
    no mapped person has both values; RMSE_vel also if a velocity array is None.
    """
    j = np.flatnonzero(mapping >= 0)
    i = mapping[j]
    found = {"RMSE_pos": root_mean_square(est_pos[j] - true_pos[i]), "RMSE_vel": float("nan")}
    if true_vel is not None and est_vel is not None:
        found["RMSE_vel"] = root_mean_square(est_vel[j] - true_vel[i])
    return found


def root_mean_square(errors: Array) -> float:
    """Returns the square root of the mean of |e|^2 over the rows e of errors (K, D); |e|^2 is the sum over the D
    columns.

    Rows with a nan or infinity are left out. The result is nan if no row is left.
    """
    squares = np.square(errors).sum(axis=1)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def gaussian_wasserstein(pos: Array, extent: Array, other_pos: Array, other_extent: Array) -> Array:
    """Returns the 2-Wasserstein distances (K,) of K pairs of two-dimensional Gaussians, nan where an input is nan.

    Means pos, other_pos (K, 2), covariances extent, other_extent (K, 2, 2), symmetric and without negative eigenvalues,
    in the squared unit of the means. The distance has the unit of the means. Givens & Shortt (1984):

        d^2 = |m1 - m2|^2 + tr(S1 + S2 - 2 (S1^1/2 S2 S1^1/2)^1/2)

    with means m, covariances S and the trace tr. A symmetric 2 x 2 matrix M >= 0 has tr M^1/2 = (tr M + 2 (det
    M)^1/2)^1/2. Here M = S1^1/2 S2 S1^1/2, with tr M = tr(S1 S2) and det M = det S1 det S2.
    """
    inner = np.einsum("kab,kba->k", extent, other_extent)
    det = np.maximum(_det(extent), 0) * np.maximum(_det(other_extent), 0)
    shape = np.trace(extent + other_extent, axis1=1, axis2=2) - 2 * np.sqrt(np.maximum(inner + 2 * np.sqrt(det), 0))
    return np.asarray(np.sqrt(np.square(pos - other_pos).sum(axis=1) + np.maximum(shape, 0)))


def _det(m: Array) -> Array:
    return np.asarray(m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0])
