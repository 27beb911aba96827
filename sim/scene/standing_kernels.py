"""Compiled loops of `sim.scene.standing`: the body whose box is given, by Levenberg's and Marquardt's steps."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit

STEPS, CLOSE = 40, 1e-11  # most steps, and the step, in shares of the box, at which they end
NUDGE = 1e-6  # for differences
LARGEST = 0.2  # step of an unknown
WIDTH_WEIGHT = 0.05  # of the width of a box beside its middle, upper and lower edge
LOWEST, TALLEST = 0.5, 2.5  # m: heights of bodies
START = (0.5, 1.0, 1.7, 0.4)  # foot, height, turned by 44°
FAR = 1e3  # error of a body that is not before the camera
SHARE_X, SHARE_Y, TALL, TURN = range(4)  # unknowns; TURN: the tangent of half the angle from the line of sight


@njit(cache=True)
def _error(q, low, size, z, lens, eye, turn, parts, out):  # type: ignore[no-untyped-def]
    """Writes to out (4,) by how much the box of the body q (4,) differs, in shares of the box."""
    fx, fy, u0, v0, radial = lens
    u, v = low[0] + q[SHARE_X] * size[0], low[1] + q[SHARE_Y] * size[1]
    a, b = (u - u0) / fx, (v - v0) / fy
    bend = 1.0 + radial * (a * a + b * b)
    a, b = a * bend, b * bend
    dx, dy = turn[0, 0] * a + turn[1, 0] * b + turn[2, 0], turn[0, 1] * a + turn[1, 1] * b + turn[2, 1]
    depth = (z - eye[2]) / (turn[0, 2] * a + turn[1, 2] * b + turn[2, 2])
    out[:] = FAR
    if not (0.0 < depth < np.inf):
        return
    away = np.sqrt(dx * dx + dy * dy)
    if away == 0.0:
        dx, away = 1.0, 1.0
    t = q[TURN]
    c, s = (1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)
    hx, hy = (dx * c - dy * s) / away, (dx * s + dy * c) / away  # the heading
    left, top, right, bottom = np.inf, np.inf, -np.inf, -np.inf
    h = q[TALL]
    for part in range(2):
        centre, across, along, up = parts[part, 0] * h, parts[part, 1], parts[part, 2], parts[part, 3]
        # A line p'X = 0 through the camera touches the ellipsoid if p'(A - c c')p = 0, where c is its centre and A its
        # squared half axes, turned. For p = (1, 0, -u) this is a quadratic in u, whose two roots are the edges:
        # own - 2 both u + below u² = 0.
        x2 = depth + centre * turn[2, 2]
        n2, m2 = hx * turn[2, 0] + hy * turn[2, 1], hy * turn[2, 0] - hx * turn[2, 1]
        below = h * h * (across * m2 * m2 + along * n2 * n2 + up * turn[2, 2] * turn[2, 2]) - x2 * x2
        if not (x2 > 0.0 and below < 0.0):  # not wholly before the camera
            return
        for axis in range(2):
            x = (a if axis == 0 else b) * depth + centre * turn[axis, 2]
            n, m = hx * turn[axis, 0] + hy * turn[axis, 1], hy * turn[axis, 0] - hx * turn[axis, 1]
            own = h * h * (across * m * m + along * n * n + up * turn[axis, 2] * turn[axis, 2]) - x * x
            both = h * h * (across * m * m2 + along * n * n2 + up * turn[axis, 2] * turn[2, 2]) - x * x2
            middle = both / below
            half = np.sqrt(max(middle * middle - own / below, 0.0))
            if axis == 0:
                left, right = min(left, middle - half), max(right, middle + half)
            else:
                top, bottom = min(top, middle - half), max(bottom, middle + half)
    # Edges are compared relative to the place, where the lens distorts both alike.
    left, right = (left - a) * fx / size[0] + q[SHARE_X], (right - a) * fx / size[0] + q[SHARE_X]
    out[0] = (left + right) / 2 - 0.5
    out[1] = (top - b) * fy / size[1] + q[SHARE_Y]
    out[2] = (bottom - b) * fy / size[1] + q[SHARE_Y] - 1.0
    out[3] = WIDTH_WEIGHT * (right - left - 1.0)


@njit(cache=True)
def _solve(a, b):  # type: ignore[no-untyped-def]
    """Solves a x = b for a positive definite (4, 4); writes x to b and changes a."""
    for k in range(4):
        for i in range(k + 1, 4):
            f = a[i, k] / a[k, k]
            for j in range(k, 4):
                a[i, j] -= f * a[k, j]
            b[i] -= f * b[k]
    for k in range(3, -1, -1):
        for j in range(k + 1, 4):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]


@njit(cache=True)
def bodies(low, size, z, lens, eye, turn, parts):  # type: ignore[no-untyped-def]
    """Returns the two bodies with each of the boxes, (2, R, 3): where they stand in the box, as shares of its width and
    height from the left upper corner, and their height, m. z (R,): height of the ground, m."""
    found = np.empty((2, len(low), 3))
    q, new, error, tried = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    J, A, g = np.empty((4, 4)), np.empty((4, 4)), np.empty(4)
    for r in range(len(low)):
        q[:] = START
        for side in range(2):
            q[TURN] = -q[TURN]  # the second search begins at the mirror image of the first body
            _error(q, low[r], size[r], z[r], lens, eye, turn, parts, error)
            damping, moved = 1e-3, np.inf
            for _ in range(STEPS):
                for k in range(4 if moved > 0.0 else 0):  # after a step that was refused the slopes are the same
                    new[:] = q
                    new[k] += NUDGE
                    _error(new, low[r], size[r], z[r], lens, eye, turn, parts, tried)
                    for i in range(4):
                        J[i, k] = (tried[i] - error[i]) / NUDGE
                for i in range(4):
                    g[i] = 0.0
                    for j in range(4):
                        g[i] -= J[j, i] * error[j]
                        A[i, j] = J[0, i] * J[0, j] + J[1, i] * J[1, j] + J[2, i] * J[2, j] + J[3, i] * J[3, j]
                    A[i, i] += damping * A[i, i] + 1e-12
                _solve(A, g)
                for k in range(4):  # far from the answer a full step would leave the picture
                    new[k] = q[k] + min(max(g[k], -LARGEST), LARGEST)
                new[TALL] = min(max(new[TALL], LOWEST), TALLEST)
                _error(new, low[r], size[r], z[r], lens, eye, turn, parts, tried)
                if (tried * tried).sum() <= (error * error).sum():
                    moved = max(abs(new[SHARE_X] - q[SHARE_X]), abs(new[SHARE_Y] - q[SHARE_Y]))
                    q[:], error[:] = new, tried
                    damping *= 0.1
                    if moved < CLOSE:
                        break
                else:
                    damping, moved = 10.0 * damping, 0.0
            found[side, r] = q[:TURN]
    return found
