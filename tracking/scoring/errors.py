"""How far off estimates are: root mean square errors of people's places and velocities, and errors of extents.

The root mean square over matches alone rewards a tracker that drops whoever is hard: read it beside GOSPA, which counts
the missed.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints


def rms(errors: Array) -> float:
    """Square root of the mean of |e|^2 over the rows e of errors (K, D) that are known; nan where none is."""
    squares = np.square(errors).sum(axis=1)
    squares = squares[np.isfinite(squares)]
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")


def people_errors(
    stands_for: Ints, true_pos: Array, est_pos: Array, true_vel: Array | None = None, est_vel: Array | None = None
) -> dict[str, float]:
    """RMSE_pos and RMSE_vel of mapped people, in the unit of the places: both sides (R, D) and (S, D) in one plane.

    stands_for (S,): the true row of each estimated one or -1 (tracking.scoring.mapping). nan where nothing is known.
    """
    j = np.flatnonzero(stands_for >= 0)
    i = stands_for[j]
    found = {"RMSE_pos": rms(est_pos[j] - true_pos[i]), "RMSE_vel": float("nan")}
    if true_vel is not None and est_vel is not None:
        found["RMSE_vel"] = rms(est_vel[j] - true_vel[i])
    return found


def gaussian_wasserstein(pos: Array, extent: Array, other_pos: Array, other_extent: Array) -> Array:
    """2-Wasserstein distance (K,) of Gaussians N(pos, extent): (K, 2) and (K, 2, 2) on either side; nan where unknown.

    d^2 = |m1 - m2|^2 + tr(S1 + S2 - 2 (S1^1/2 S2 S1^1/2)^1/2) (Givens & Shortt 1984). A symmetric 2 x 2 matrix M >= 0
    has tr M^1/2 = (tr M + 2 (det M)^1/2)^1/2; here tr M = tr(S1 S2) and det M = det S1 det S2.
    """
    inner = np.einsum("kab,kba->k", extent, other_extent)
    det = np.maximum(_det(extent), 0) * np.maximum(_det(other_extent), 0)
    shape = np.trace(extent + other_extent, axis1=1, axis2=2) - 2 * np.sqrt(np.maximum(inner + 2 * np.sqrt(det), 0))
    return np.asarray(np.sqrt(np.square(pos - other_pos).sum(axis=1) + np.maximum(shape, 0)))


def _det(m: Array) -> Array:
    return np.asarray(m[:, 0, 0] * m[:, 1, 1] - m[:, 0, 1] * m[:, 1, 0])
