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
    """Resampled motion of P people in T frames.

    id (P,): person ids, ascending; column k belongs to id[k]. pos (T, P, 2): x, y in m, and vel (T, P, 2): m/s, the
    derivative of the smoothed positions; both nan while absent. present (T, P): True while present. smoothing: the
    chosen time constant tau in s; faster motion was removed.
    """

    id: Ints
    pos: Array
    vel: Array
    present: Bools
    smoothing: float


Curve = Callable[[Array], Array]
Segment = tuple[int, Array, Curve, Curve]


def resample(frame: Ints, id: Ints, pos: Array, rate: float, fps: float, first: float, last: float) -> Trajectories:
    """Return the smoothed motion of labelled people at times first, first + 1/fps, … up to and including last (s).

    frame (from 1), id (R,), pos (R, 2) m, finite: labelled rows in any order, each id once in a frame. rate: label
    frames per second; frame 1 is time 0. A person is absent in gaps of more than 2 s between labels, before the first
    and after the last label. Segments with a single label are dropped, and so are people who are absent at all of the
    times. Without rows the result has no people. One smoothing time serves all people: the smallest of 0.05 to 1 s
    (TIMES) that keeps the 99 % quantile of accelerations within 2.5 m/s²; 1 s if none does.
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
    """Return the gap-free segments of the person with id `one`, smoothed with time constant `tau` (s).

    Each segment is (id, times of its labels in s, position as a function of time, velocity as a function of time).
    frame (from 1), id (R,), pos (R, 2) m: all labelled rows. rate: label frames per second. A gap is more than 2 s.
    Segments with a single label are left out.
    """
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
    """Return the smoothing spline f (N, 2) at its knots t (N,): the minimum of Σ |y - f|² + weight ∫ |f''|².

    t (N,): ascending times, no two equal. y (N, 2): finite values at t. weight: 0 or more; 0 returns y; a large one
    gives a straight line. Fewer than 3 rows are returned unchanged, as `y` itself. f is a natural cubic spline.

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
    """Return the 99 % quantile of the segments' accelerations in m/s², sampled `fps` times per s; 0 without segments.

    An acceleration is the length of the difference of two successive velocities times fps. One 0 is always among them.
    """
    size = [np.zeros(1)]
    for _, times, _, velocity in segments:
        t = np.arange(times[0], times[-1], 1 / fps)
        size.append(np.linalg.norm(np.diff(velocity(t), axis=0), axis=1) * fps)
    return float(np.quantile(np.concatenate(size), 0.99))


def nearest_row(frame: Ints, id: Ints, people: Ints, rate: float, t: Array) -> Ints:
    """Return for each time and person the index of the person's label row that is nearest in time, shape (T, P).

    frame (from 1), id (R,): the label rows, in any order. people (P,): ids, each of which must have a row (else
    IndexError). rate: label frames per second; frame 1 is time 0. t (T,): times in s. Of two equally near rows the
    earlier one is taken.
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
