"""A bank of Kalman filters in arrays: constant velocity in each coordinate, and a random-walk direction.

Each of D measured coordinates (for example x, y, h, w) has a filter of its own with state x = (place, rate), A = [[1,
dt], [0, 1]], C = [1, 0] and filterpy's process noise. A bank of N filters is one array `state` (5, N, D) with rows
    PLACE, RATE               the state
    VAR, COV, RATE_VAR        entries 11, 12, 22 of the covariance P

    predict  x = A x,  P = A P A' + Q          (Gonzalez et al. 2006, eqs 1, 2; eq. 8: C A x is the predicted place)
    update   y = z - C x,  S = P11 + R,  K = (P11, P12) / S,  x += K y,  P = (I - K C) P      (eqs 5, 6, 7, 3, 4)
A is the transition of a step, C selects the place, Q is the process noise, z a measurement, R its variance, y the
innovation, S its variance, K the gain. Eq. 4 is printed without the brackets. Eq. 9 is printed with row and column
exchanged.

Places may be in another unit (px) than covariances (m^2): gains have no unit, so that only distances need the scale
(N,) between the two units.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints

PLACE, RATE, VAR, COV, RATE_VAR = range(5)  # Rows of a bank's `state`.
DIRECTION, DIRECTION_VAR = range(2)  # Rows of `angle`.
# rad^2: a measured direction with this variance or more carries no information. (An axis differs from any other by at
# most pi / 2; a uniform distribution has a standard deviation of 52 deg.)
VAGUE = np.radians(30.0) ** 2


def white_acceleration(dt: float, sigma: Array | float) -> Array:
    """Returns the entries 11, 12 and 22 of the process noise Q of a step of dt s, (3, …), where … is the shape of
    `sigma`, the standard deviation of the acceleration."""
    # imported here, as filterpy takes 0.65 s to import; a bank is equal to as many of its filters to 1e-9, and faster
    from filterpy.common import Q_discrete_white_noise

    unit = Q_discrete_white_noise(2, dt)
    return np.asarray(np.multiply.outer(unit[[0, 0, 1], [0, 1, 1]], np.square(sigma)))


def constant_velocity(dt: float, axes: int) -> tuple[Array, Array]:
    """Returns A and Q, (2 D, 2 D) each, of D = `axes` coordinates; the state is all places, then all rates."""
    from filterpy.common import Q_discrete_white_noise, kinematic_kf

    A = kinematic_kf(axes, 1, dt, order_by_dim=False).F
    return A, Q_discrete_white_noise(2, dt, block_size=axes, order_by_dim=False)


def born(place: Array, var: Array | float, rate_var: Array | float) -> Array:
    """Returns the state (5, N, D) of N new filters: place (N, D), rate 0, variances `var` of place and `rate_var` of
    rate, covariance of both 0."""
    state = np.zeros((5, *place.shape))
    state[PLACE], state[VAR], state[RATE_VAR] = place, var, rate_var
    return state


def predict(state: Array, dt: float, q: Array) -> None:
    """Predicts a bank one step of dt s ahead, in place; q (3, N, D) or (3, D): from `white_acceleration`."""
    place, rate, var, cov, rate_var = state
    place += dt * rate  # eq. 1
    step = dt * rate_var  # eq. 2, to the end
    # place, rate, var … are views of `state`, so that this changes it
    var += dt * (cov + cov + step)
    cov += step
    # q of common noise has no axis of filters
    state[VAR:] += q if q.ndim == 3 else q[:, None]


def fading(stay: Array) -> Array:
    """Returns the factors (5, 1, D) of a bank by which rates are multiplied by `stay` (D,), 0 to 1, and their
    (co)variances accordingly."""
    return np.stack([np.ones_like(stay), stay, np.ones_like(stay), stay, stay**2])[:, None]


def update(state: Array, rows: Ints, z: Array, noise: Array | float) -> Array:
    """Updates the filters `rows` (K,) with measurements z (K, D), in place; each row once at most.

    Returns y^2 / S of each coordinate, (K, D), whose sum over the coordinates is d^2 (eq. 9).
    """
    # take copies the rows once; indexing each of the five by `rows` would copy five times
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


def asymptote(dt: float, sigma: Array | float, noise: Array | float) -> Array:
    """Returns the innovation variance S to which a filter converges if it is measured in every frame (Kalata 1984). dt:
    s; sigma: standard deviation of the acceleration; noise: variance of a measurement."""
    index = np.asarray(sigma) * dt**2 / np.sqrt(noise)
    # the closed form of the Riccati equation of one coordinate, with the tracking index sigma dt² / sqrt(noise)
    r = (4 + index - np.sqrt(8 * index + index**2)) / 4
    return np.asarray(noise / r**2)


def angle_innovation(measured: Array, predicted: Array) -> Array:
    """Returns measured - predicted of directions of axes, rad in [-pi/2, pi/2) (eq. 5)."""
    # an axis turned by pi is the same axis
    return (measured - predicted + np.pi / 2) % np.pi - np.pi / 2


def directed(noise: Array) -> Bools:
    """Returns bool (N,): True if a measured direction carries information. noise (N,): its variance, rad^2, which is
    large for a nearly round blob."""
    return np.asarray(noise < VAGUE)


def angle_update(angle: Array, rows: Ints, z: Array, noise: Array) -> None:
    """Updates the directions `rows` (K,) of `angle` (2, N) with measured directions z (K,), rad, in place."""
    usable = directed(noise)
    rows, z, noise = rows[usable], z[usable], noise[usable]
    theta, var = angle[:, rows]
    gain = var / (var + noise)
    theta = (theta + gain * angle_innovation(z, theta)) % np.pi
    angle[:, rows] = np.stack([theta, var - gain * var])
