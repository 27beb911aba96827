"""A rectified stereo pair as a sensor of points: (u, v, d) of a world point, its Jacobian, and the way back.

u, v: pixel in the left image; d = u_left - u_right: disparity, px. With x_c = R (X - C) = (x right, y down, z forward),
R the rotation and C the position of the left camera, f its focal lengths, b the baseline:
    u = u0 + fx x_c / z_c,   v = v0 + fy y_c / z_c,   d = b fx / z_c                 (Hoshikawa et al. 2011, eq. 6)
    d(u, v, d)/dX = J R,   J = [[fx/z, 0, -fx x/z^2], [0, fy/z, -fy y/z^2], [0, 0, -b fx/z^2]]
Eq. 6 is printed with y in place of x, and with world coordinates in place of camera coordinates.
"""

from __future__ import annotations

import numpy as np

from sim.elementary import inverse_3x3, product, turned
from sim.types import Array, Camera


def project_pair(camera: Camera, xyz: Array) -> Array:
    """Returns u, v, d (N, 3) px of world points xyz (N, 3) m before the camera (eq. 6, with its pose)."""
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = x[:, 2]
    return np.column_stack([u0 + fx * x[:, 0] / z, v0 + fy * x[:, 1] / z, camera.baseline * fx / z])


def back_project(camera: Camera, uvd: Array) -> Array:
    """Returns the world points (N, 3) m that are measured as uvd (N, 3) px, d above 0."""
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = camera.baseline * fx / uvd[:, 2]
    x = np.column_stack([(uvd[:, 0] - u0) / fx * z, (uvd[:, 1] - v0) / fy * z, z])
    return np.asarray(turned(camera.rotation.T, x) + camera.position)


def pair_jacobian(camera: Camera, xyz: Array) -> Array:
    """Returns d(u, v, d)/d(x, y, z) of `project_pair` at xyz (N, 3): (N, 3, 3) px/m."""
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), z = camera.focal_px, x[:, 2]
    J = np.zeros((len(x), 3, 3))
    J[:, 0, 0], J[:, 0, 2] = fx / z, -fx * x[:, 0] / (z * z)
    J[:, 1, 1], J[:, 1, 2] = fy / z, -fy * x[:, 1] / (z * z)
    J[:, 2, 2] = -camera.baseline * fx / (z * z)
    return product(J, camera.rotation)


def point_covariances(camera: Camera, xyz: Array, variances: Array) -> Array:
    """Returns the covariances J⁻¹ R J⁻ᵀ (N, 3, 3) m² of measured points xyz (N, 3); variances (3,) px²: of u, v, d."""
    inverse = inverse_3x3(pair_jacobian(camera, xyz))
    return product(inverse * variances, np.swapaxes(inverse, 1, 2))
