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
    """Return u, v, d (N, 3) in px of world points xyz (N, 3) in m (eq. 6, with the camera's pose).

    camera: a pinhole camera with a baseline, without lens distortion. Points at depth 0 or behind the camera have no
    meaning; a depth of 0 gives inf or nan, with a numpy warning.
    """
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = x[:, 2]
    return np.column_stack([u0 + fx * x[:, 0] / z, v0 + fy * x[:, 1] / z, camera.baseline * fx / z])


def back_project(camera: Camera, uvd: Array) -> Array:
    """Return the world points (N, 3), m, that are measured as uvd (N, 3): u, v, d in px; the inverse of `project_pair`.

    A row with nan gives nan. d must be above 0; the depth is b fx / d.
    """
    (fx, fy), (u0, v0) = camera.focal_px, camera.centre_px
    z = camera.baseline * fx / uvd[:, 2]
    x = np.column_stack([(uvd[:, 0] - u0) / fx * z, (uvd[:, 1] - v0) / fy * z, z])
    return np.asarray(turned(camera.rotation.T, x) + camera.position)


def pair_jacobian(camera: Camera, xyz: Array) -> Array:
    """Return the derivatives d(u, v, d)/d(x, y, z) of `project_pair` at world points xyz (N, 3), (N, 3, 3) in px/m.

    Rows are u, v, d, columns world x, y, z. The determinant is -b fx^2 fy / z_c^4 for every pose of the camera.
    """
    x = turned(camera.rotation, xyz - camera.position)
    (fx, fy), z = camera.focal_px, x[:, 2]
    J = np.zeros((len(x), 3, 3))
    J[:, 0, 0], J[:, 0, 2] = fx / z, -fx * x[:, 0] / (z * z)
    J[:, 1, 1], J[:, 1, 2] = fy / z, -fy * x[:, 1] / (z * z)
    J[:, 2, 2] = -camera.baseline * fx / (z * z)
    return product(J, camera.rotation)


def point_covariances(camera: Camera, xyz: Array, variances: Array) -> Array:
    """Return the covariances J^-1 R J^-T (N, 3, 3), m^2, of measured world points xyz (N, 3), m.

    variances (3,): of u, v and d, px^2, the diagonal of R; J: the Jacobian of the pair at each point. The standard
    deviation along the line of sight grows with the squared depth.
    """
    inverse = inverse_3x3(pair_jacobian(camera, xyz))
    return product(inverse * variances, np.swapaxes(inverse, 1, 2))
