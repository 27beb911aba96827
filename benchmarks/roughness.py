"""How rough the motion of people is: the middle of distributions, and what part of them is error of the labels.

`roughness` measures positions at 2.5 frames/s; `benchmarks.realism middle` prints the figures. A *walk* is a window of
4 s in which a person covers more than 0.8 m/s on average. Its straight line of least squares is removed; what is left
is split into the parts along and across the line.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass

import numpy as np

from benchmarks.belonging.pair_features import NAMES, pair_features
from benchmarks.belonging.sources import FPS, are_mates
from sim.types import Array, Bools, Ints, Truth

WINDOW = 10  # frames
WALKING = 0.8  # m/s
FAST = 0.94  # Hz
VELOCITY_DIFFERENCE = NAMES.index("velocity difference, 2 s")


@dataclass(frozen=True)
class Roughness:
    """Samples of the quantities of rough motion, pooled over scenes.

    - acceleration (A,): m/s², of everybody, from second differences of positions.
    - walks (W, 2, F): power spectra of the positions of walks along and across their lines, mm²/Hz, at the frequencies
      of `frequencies`. pace (W,): mean speed of each walk, m/s.
    - mates_velocity (M,): m/s, difference of the velocities of mates, mean over 2 s.
    - mates_spread (K,): m, standard deviation over time of the distance of mates who walk 4 s or longer together.
    - mates_angle (L,): degrees between the line through a pair that walks and its velocity; 90 is abreast.
    - still (S, 2): of windows in which a person stands: share of frames whose label equals the one before; error of
      the labels, m, from second differences as of independent errors.
    """

    acceleration: Array
    walks: Array
    pace: Array
    mates_velocity: Array
    mates_spread: Array
    mates_angle: Array
    still: Array


def frequencies() -> Array:
    """Returns the frequencies of the spectra of walks, Hz, (F,)."""
    return np.fft.rfftfreq(WINDOW, 1 / FPS)


def roughness(truths: Iterable[Truth]) -> Roughness:
    """Returns the samples of truths with positions at 2.5 frames/s and group labels."""
    parts = [astuple(_of(truth)) for truth in truths]
    return Roughness(*(np.concatenate(x) for x in zip(*parts, strict=True)))


def fast_part(walks: Array) -> Array:
    """Returns the root mean square of positions above 0.94 Hz along and across the walks, mm, (2,)."""
    f = frequencies()
    return np.asarray(np.sqrt(walks[:, :, f > FAST].mean(axis=0).sum(axis=-1) * f[1]))


def _of(truth: Truth) -> Roughness:
    assert truth.pos is not None
    ids, column = np.unique(truth.id, return_inverse=True)
    pos = np.full((truth.length, len(ids), 2), np.nan)
    group = np.full((truth.length, len(ids)), -1, np.int64)
    pos[truth.frame - 1, column], group[truth.frame - 1, column] = truth.pos, truth.group
    vel = np.full(pos.shape, np.nan)
    vel[1:-1] = (pos[2:] - pos[:-2]) * FPS / 2
    acceleration = np.linalg.norm(np.diff(pos, 2, axis=0), axis=2).ravel() * FPS**2
    windows = np.concatenate([_windows(pos[:, k]) for k in range(len(ids))])
    speed = np.linalg.norm(windows[:, -1] - windows[:, 0], axis=1) * FPS / (WINDOW - 1)
    steps = np.linalg.norm(np.diff(windows, axis=1), axis=2)
    still = windows[(speed < 0.15) & (steps.max(axis=1) * FPS < 0.5)]
    spread, angle = _mates(pos, vel, group)
    pairs = pair_features(truth.frame, truth.id, truth.pos, FPS)
    apart = pairs.features[are_mates(truth, pairs), VELOCITY_DIFFERENCE]
    return Roughness(
        acceleration[np.isfinite(acceleration)], _spectra(windows[speed > WALKING]), speed[speed > WALKING],
        apart[np.isfinite(apart)], spread, angle, _label_errors(still),
    )  # fmt: skip


def _windows(pos: Array) -> Array:
    """Returns the windows (W, WINDOW, 2) of one person's positions (T, 2), nan while absent; half of each overlaps."""
    starts = np.arange(0, len(pos) - WINDOW + 1)
    first = int(np.argmax(np.isfinite(pos[:, 0])))
    starts = starts[(starts - first) % (WINDOW // 2) == 0]
    out = pos[starts[:, None] + np.arange(WINDOW)]
    return np.asarray(out[np.isfinite(out).all(axis=(1, 2))])


def _spectra(windows: Array) -> Array:
    """Returns the power spectra (W, 2, F), mm²/Hz, of windows (W, WINDOW, 2), m, along and across straight lines."""
    t = np.arange(WINDOW) - (WINDOW - 1) / 2
    slope = np.einsum("t,wtk->wk", t, windows) / (t @ t)
    rest = windows - windows.mean(axis=1, keepdims=True) - t[None, :, None] * slope[:, None]
    e = slope / np.linalg.norm(slope, axis=1, keepdims=True)
    axes = np.stack([e, np.stack([-e[:, 1], e[:, 0]], axis=1)], axis=1)
    parts = np.einsum("wtk,wak->wat", rest, axes)
    taper = np.hanning(WINDOW + 2)[1:-1]
    return np.asarray(2e6 * np.abs(np.fft.rfft(parts * taper)) ** 2 / (taper @ taper) / FPS)


def _mates(pos: Array, vel: Array, group: Ints) -> tuple[Array, Array]:
    """Returns the spread of the distance, m, of each two mates who walk, and angles of pairs, degrees."""
    spread, angle = [], []
    for a in range(pos.shape[1]):
        mates = (group == group[:, a : a + 1]) & (group[:, a : a + 1] >= 0)
        for b in np.flatnonzero(mates[:, a + 1 :].any(axis=0)) + a + 1:
            velocity = (vel[:, a] + vel[:, b]) / 2
            speed = np.linalg.norm(velocity, axis=1)
            on: Bools = mates[:, b] & (speed > WALKING)
            apart = pos[on, a] - pos[on, b]
            distance = np.linalg.norm(apart, axis=1)
            if len(distance) >= WINDOW:
                spread.append(distance.std())
            pair = (group[on] == group[on, a][:, None]).sum(axis=1) == 2
            along = np.abs(np.sum(apart * velocity[on], axis=1)) / speed[on]
            angle.append(np.degrees(np.arccos(np.clip(along / distance, 0, 1)))[pair])
    return np.array(spread), np.concatenate([np.zeros(0), *angle])


def _label_errors(still: Array) -> Array:
    """Returns the share of repeated labels and the error, m, of each window (S, WINDOW, 2) of a person who stands."""
    same = np.mean((np.diff(still, axis=1) == 0).all(axis=2), axis=1)
    error = np.sqrt(np.mean(np.diff(still, 2, axis=1) ** 2, axis=(1, 2)) / 6)
    return np.stack([same, error], axis=1)
