"""Labelled places over time as smooth motion at another frame rate.

Each stretch of a person's places becomes a smoothing spline f: the least Σ |place - f|² + (tau⁴ / dt) ∫ |f''|², which
keeps what is slower than tau and leaves out the rest, the jitter of labels. tau is the shortest of TIMES with which
99 % of the accelerations are at most LIMIT: what labels jump beyond that, nobody walks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

TIMES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)  # s
LIMIT = 2.5  # m/s²
GAP = 2.0  # s: who is not labelled for longer was away


@dataclass(frozen=True)
class Trajectories:
    """Places and velocities (T, P, 2), nan while absent; id (P,); present (T, P); smoothing: tau, s."""

    id: Ints
    pos: Array
    vel: Array
    present: Bools
    smoothing: float


Curve = Callable[[Array], Array]
Segment = tuple[int, Array, Curve, Curve]


def resample(frame: Ints, id: Ints, pos: Array, rate: float, fps: float, first: float, last: float) -> Trajectories:
    """The motion of rows (R,) at `rate` labels per second, at times first, first + 1/fps … up to last (s).

    Who is labelled once only is left out, as is everybody who is not there in that time.
    """
    t = first + np.arange(int(np.floor((last - first) * fps + 1e-6)) + 1) / fps
    for tau in TIMES:
        segments = [s for one in np.unique(id) for s in _segments(frame, id, pos, int(one), rate, tau)]
        if _acceleration(segments, fps) <= LIMIT:
            break
    people = np.array(sorted({s[0] for s in segments if _inside(s[1], t).any()}), np.int64)
    pos, vel = np.full((len(t), len(people), 2), np.nan), np.full((len(t), len(people), 2), np.nan)
    for one, times, place, velocity in segments:
        here = _inside(times, t)
        if here.any():
            column = int(np.searchsorted(people, one))
            pos[here, column], vel[here, column] = place(t[here]), velocity(t[here])
    return Trajectories(people, pos, vel, np.isfinite(pos[:, :, 0]), tau)


def _inside(times: Array, t: Array) -> Bools:
    return np.asarray((t >= times[0] - 1e-9) & (t <= times[-1] + 1e-9))


def _segments(frame: Ints, id: Ints, pos: Array, one: int, rate: float, tau: float) -> list[Segment]:
    """A person's segments without a gap: id, times, and place and velocity as functions of time."""
    from scipy.interpolate import CubicSpline

    rows = np.flatnonzero(id == one)
    rows = rows[np.argsort(frame[rows])]
    cuts = np.flatnonzero(np.diff(frame[rows]) > GAP * rate) + 1
    made: list[Segment] = []
    for part in np.split(rows, cuts):
        if len(part) >= 2:
            times = (frame[part] - 1) / rate
            f = CubicSpline(times, smoothing_spline(times, pos[part], tau**4 * rate), bc_type="natural")
            made.append((one, times, f, f.derivative()))
    return made


def smoothing_spline(t: Array, y: Array, weight: float) -> Array:
    """Places (N, 2) of the natural cubic spline f at its knots t: the least Σ |y - f|² + weight ∫ |f''|².

    Reinsch (1967): f = y - weight Q γ with (R + weight Qᵀ Q) γ = Qᵀ y, γ being f'' at the inner knots.
    """
    from scipy.linalg import solveh_banded

    if len(t) < 3:
        return y
    h = np.diff(t)
    a, c = 1.0 / h[:-1], 1.0 / h[1:]
    b = -a - c  # column j of Q: a_j, b_j, c_j in rows j, j + 1, j + 2
    bands = np.zeros((3, len(t) - 2))
    bands[0] = (h[:-1] + h[1:]) / 3.0 + weight * (a**2 + b**2 + c**2)
    bands[1, :-1] = h[1:-1] / 6.0 + weight * (b[:-1] * a[1:] + c[:-1] * b[1:])
    bands[2, :-2] = weight * c[:-2] * a[2:]
    bend = a[:, None] * y[:-2] + b[:, None] * y[1:-1] + c[:, None] * y[2:]
    gamma = weight * solveh_banded(bands, bend, lower=True)
    f = np.array(y, dtype=float)
    f[:-2] -= a[:, None] * gamma
    f[1:-1] -= b[:, None] * gamma
    f[2:] -= c[:, None] * gamma
    return f


def _acceleration(segments: list[Segment], fps: float) -> float:
    """The 99 % quantile of accelerations, m/s², at `fps` instants per second."""
    size = [np.zeros(1)]
    for _, times, _, velocity in segments:
        t = np.arange(times[0], times[-1], 1 / fps)
        size.append(np.linalg.norm(np.diff(velocity(t), axis=0), axis=1) * fps)
    return float(np.quantile(np.concatenate(size), 0.99))


def nearest_row(frame: Ints, id: Ints, people: Ints, rate: float, t: Array) -> Ints:
    """(T, P) the row of each person whose label is nearest in time to t (T,)."""
    out = np.zeros((len(t), len(people)), np.int64)
    for column, one in enumerate(people):
        rows = np.flatnonzero(id == one)
        rows = rows[np.argsort(frame[rows])]
        times = (frame[rows] - 1) / rate
        after = np.clip(np.searchsorted(times, t), 1, max(len(rows) - 1, 1))
        before = after - 1
        after = np.minimum(after, len(rows) - 1)
        out[:, column] = rows[np.where(np.abs(times[after] - t) < np.abs(t - times[before]), after, before)]
    return out
