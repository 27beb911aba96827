"""Smooth labelled positions of people and resample them to another frame rate.

Each gap-free segment of a person's positions y (m) becomes the smoothing spline f that minimises Σ |y - f|² + (tau⁴ /
dt) ∫ |f''|², with dt the time between labels in s and tau a time constant in s. It keeps motion slower than tau and
removes faster motion, that is, label jitter. tau is the smallest of TIMES (0.05 to 1 s) for which the 99 % quantile of
all accelerations is at most LIMIT (2.5 m/s²), since people do not walk with more; the largest of TIMES if none
satisfies it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

TIMES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)  # s, candidates for tau
LIMIT = 2.5  # m/s²
GAP = 2.0  # s without label after which a person counts as absent


@dataclass(frozen=True)
class Trajectories:
    """Resampled motion of P people in T frames."""

    id: Ints  # (P,) person ids, ascending; column k belongs to id[k]
    # (T, P, 2) x, y in m, and vel (T, P, 2): m/s, the derivative of the smoothed positions; both nan while absent
    pos: Array
    vel: Array
    present: Bools  # (T, P) True while present
    smoothing: float  # the chosen time constant tau in s; faster motion was removed


Curve = Callable[[Array], Array]
Segment = tuple[int, Array, Curve, Curve]


def resample(frame: Ints, id: Ints, pos: Array, rate: float, fps: float, first: float, last: float) -> Trajectories:
    """Returns the smoothed motion of labelled people at the times first, first + 1/fps, … last (s).

    frame (from 1), id (R,), pos (R, 2) m: labelled rows in any order, each id once in a frame. rate: label frames per
    s. People are absent in gaps of more than 2 s, and before and after their labels.
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
    from scipy.interpolate import CubicSpline

    rows = np.flatnonzero(id == one)
    rows = rows[np.argsort(frame[rows])]
    cuts = np.flatnonzero(np.diff(frame[rows]) > GAP * rate) + 1
    made: list[Segment] = []
    for part in np.split(rows, cuts):
        # A single label tells no motion.
        if len(part) >= 2:
            times = (frame[part] - 1) / rate
            f = CubicSpline(times, smoothing_spline(times, pos[part], tau**4 * rate), bc_type="natural")
            made.append((one, times, f, f.derivative()))
    return made


def smoothing_spline(t: Array, y: Array, weight: float) -> Array:
    """Returns the natural cubic spline f (N, 2) at its knots t (N,) that minimises Σ |y - f|² + weight ∫ |f''|².

    Reinsch (1967): f = y - weight Q γ with (R + weight Qᵀ Q) γ = Qᵀ y. γ (N - 2,) is f'' at the inner knots. Qᵀ forms
    differences of slopes at the inner knots; R holds the integrals of products of hat functions there.
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
    """Returns the 99 % quantile of the accelerations, m/s²."""
    size = [np.zeros(1)]
    for _, times, _, velocity in segments:
        t = np.arange(times[0], times[-1], 1 / fps)
        size.append(np.linalg.norm(np.diff(velocity(t), axis=0), axis=1) * fps)
    return float(np.quantile(np.concatenate(size), 0.99))


def nearest_row(frame: Ints, id: Ints, people: Ints, rate: float, t: Array) -> Ints:
    """Returns the label row that is nearest in time, for each time t (T,) s and person (P,): (T, P).

    frame (from 1), id (R,): the label rows. rate: label frames per s. Of two equally near rows the earlier one is
    taken.
    """
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
