"""A bank of Kalman filters in arrays: independent position-velocity blocks, and a random-walk angle.

Each of D measured coordinates (centre x, y, axes h, w) has a 2-state filter of its own: x = (place, rate),
A = [[1, dt], [0, 1]], C = [1, 0], and Q = s^2 [[dt^4/4, dt^3/2], [dt^3/2, dt^2]], a white acceleration of standard
deviation s held over a step (filterpy's Q_discrete_white_noise). Since no block speaks to another, a filter of 2 D
states is D times three numbers of covariance, and a bank is one array `state` (5, N, D): place, rate, and P's entries
11, 12, 22.

    predict  x = A x,  P = A P A' + Q          (Gonzalez et al. 2006, eqs 1, 2; eq. 8: C A x is the predicted place)
    update   S = P11 + R,  K = (P11, P12) / S,  x += K y,  P -= K S K'      (eqs 3-7; eq 4 needs brackets: (I - K C) P)

Places may be in a unit of their own (px) while covariances are in another (m^2): gains have no unit, so only a distance
needs the scale (N,) between the two.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints

PLACE, RATE, VAR, COV, RATE_VAR = range(5)
VAGUE = np.radians(30.0) ** 2  # rad^2: an axis is within pi / 2 of any other, with (52 deg)^2 if nothing is known


def white_acceleration(dt: float, sigma: Array | float) -> Array:
    """(3, ...) entries 11, 12, 22 of Q for a white acceleration of standard deviation sigma, held over dt."""
    q = np.square(np.asarray(sigma, float))
    return np.stack([q * dt**4 / 4, q * dt**3 / 2, q * dt**2])


def born(place: Array, var: Array | float, rate_var: Array | float) -> Array:
    """(5, N, D) new filters at `place` (N, D), at rest, with uncorrelated variances."""
    state = np.zeros((5, *place.shape))
    state[PLACE], state[VAR], state[RATE_VAR] = place, var, rate_var
    return state


def predict(state: Array, dt: float, q: Array) -> None:
    """One step of dt, s, in place; q (3, N, D) or (3, D) from `white_acceleration`."""
    place, rate, var, cov, rate_var = state
    place += dt * rate  # eq. 1
    step = dt * rate_var  # eq. 2, to the end
    var += dt * (cov + cov + step)
    cov += step
    state[VAR:] += q if q.ndim == 3 else q[:, None]


def update(state: Array, rows: Ints, z: Array, noise: Array | float) -> Array:
    """Measure filters `rows` (each at most once) at z (K, D) with variances `noise` (K, D) or (D,), in place.

    Returns (K, D) y^2 / S of each coordinate, in squared units of z per unit of covariance (summed: eq. 9).
    """
    new = state.take(rows, 1)
    place, rate, var, cov, rate_var = new
    s = var + noise  # eq. 6
    gain, rate_gain = var / s, cov / s  # eq. 7
    y = z - place  # eq. 5
    place += gain * y  # eq. 3
    rate += rate_gain * y
    rate_var -= rate_gain * cov  # eq. 4, with brackets: (I - K C) P
    var -= gain * var
    cov -= gain * cov
    state[:, rows] = new
    return np.asarray(y * y / s)


def distances(state: Array, z: Array, noise: Array | float, scale: Array | float = 1.0) -> Array:
    """(N, M) squared Mahalanobis distances y' S^-1 y between N predictions and M measurements (the paper's MSD, eq. 9).

    noise (M, D) or (D,) in the covariances' unit, scale (N,) or a number: units of z per unit of covariance.
    """
    place, spread = state[PLACE], np.reshape(np.square(scale), (-1, 1))
    if np.ndim(noise) < 2:
        return _common_noise(place, z, 1.0 / ((state[VAR] + noise) * spread))
    y = z[None] - place[:, None]
    s = (state[VAR][:, None] + np.asarray(noise)[None]) * spread[..., None]
    return np.asarray(np.sum(y * y / s, 2))


def _common_noise(place: Array, z: Array, w: Array) -> Array:
    """Sum over d of w (z - place)^2, expanded to matrix products: about one of the points, so that little cancels."""
    if not len(place) or not len(z):
        return np.zeros((len(place), len(z)))
    p, m = place - z[0], z - z[0]
    pw = p * w
    d2 = w @ (m * m).T
    d2 -= pw @ (m + m).T
    d2 += np.einsum("nd,nd->n", pw, p)[:, None]
    return np.asarray(np.maximum(d2, 0.0, out=d2))


def asymptote(dt: float, sigma: Array | float, noise: Array | float) -> Array:
    """S that an unbroken run of measurements settles at: the Riccati equation of one block in closed form.

    With l = sigma dt^2 / sqrt(noise):  r = (4 + l - sqrt(8 l + l^2)) / 4,  S = noise / r^2 (Kalata).
    """
    index = np.asarray(sigma) * dt**2 / np.sqrt(noise)
    r = (4 + index - np.sqrt(8 * index + index**2)) / 4
    return np.asarray(noise / r**2)


def angle_innovation(measured: Array, predicted: Array) -> Array:
    """Difference of two axes' directions (eq. 5), rad, in [-pi/2, pi/2): an axis turned by pi is the same axis."""
    return (measured - predicted + np.pi / 2) % np.pi - np.pi / 2


def directed(noise: Array) -> Bools:
    """Do axes measured with these variances (N,), rad^2, have a direction at all? Those of a near circle have none."""
    return np.asarray(noise < VAGUE)


def angle_update(angle: Array, rows: Ints, z: Array, noise: Array) -> None:
    """Measure the axes `rows` of angle (2, N), direction rad and its variance, at z (K,) with `noise` (K,), in place.

    A measurement without a direction is left out.
    """
    usable = directed(noise)
    rows, z, noise = rows[usable], z[usable], noise[usable]
    theta, var = angle[:, rows]
    gain = var / (var + noise)
    theta = (theta + gain * angle_innovation(z, theta)) % np.pi
    angle[:, rows] = np.stack([theta, var - gain * var])
