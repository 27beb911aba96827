"""What `blob` tells the world: boxes in the image, and positions on the ground where a camera is known."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Camera


def image_covariance(state: Array, scale: Array) -> Array:
    """(N, 4, 4) covariance of x, y, vx, vy in px of a bank whose covariances are in m^2; scale (N,) px per m."""
    cov = np.zeros((state.shape[1], 16))  # entry (i, j) at 4 i + j: the strides below walk along diagonals
    var, cross, rate = state[2:, :, :2] * (scale * scale)[:, None]
    cov[:, 0:6:5], cov[:, 10:16:5] = var, rate
    cov[:, 2:8:5] = cov[:, 8:14:5] = cross
    return cov.reshape(-1, 4, 4)


def on_ground(camera: Camera, state: Array, scale: Array) -> tuple[Array, Array, Array, Bools]:
    """Positions, velocities, covariances on the ground of the rows that have one (above the horizon there is none),
    and which these are.

    The place measured is the box's bottom centre for a pinhole, its centre from above; the image's state goes through
    sim.scene.camera.to_ground and its Jacobian J: v = J (u', v'), P = J P_uv J' blockwise.
    """
    from sim.scene.camera import ground_jacobian, to_ground

    foot, rate, cov = _foot(camera, state, scale)
    ground = to_ground(camera, foot)
    seen = np.asarray(np.isfinite(ground).all(1))
    if not seen.all():
        ground, foot, rate, cov = ground[seen], foot[seen], rate[seen], cov[seen]
    jacobian = ground_jacobian(camera, foot)
    turn = np.zeros((len(foot), 4, 4))
    turn[:, :2, :2] = turn[:, 2:, 2:] = jacobian
    out = turn @ cov @ turn.transpose(0, 2, 1)
    return ground, np.einsum("nij,nj->ni", jacobian, rate), (out + out.transpose(0, 2, 1)) / 2, seen


def _foot(camera: Camera, state: Array, scale: Array) -> tuple[Array, Array, Array]:
    """(N, 2) px, (N, 2) px/s and (N, 4, 4) covariance of the point that stands on the ground, y + h / 2 of the state,
    whose place is the upright box that is told; its variance takes h for the box's height."""
    place, rate, cov = state[0, :, :2].copy(), state[1, :, :2].copy(), image_covariance(state, scale)
    if camera.kind == "pinhole":
        place[:, 1] += state[0, :, 2] / 2
        rate[:, 1] += state[1, :, 2] / 2
        height = state[2:, :, 2] * np.square(scale) / 4
        cov[:, 1, 1] += height[0]
        cov[:, 1, 3] += height[1]
        cov[:, 3, 1] += height[1]
        cov[:, 3, 3] += height[2]
    return place, rate, cov
