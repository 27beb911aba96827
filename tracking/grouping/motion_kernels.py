"""Numba kernels of what erring positions tell: motion and noise of each person, and how a pair's offset lasts."""

from __future__ import annotations

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints

FASTEST = 1.5  # m/s: standard deviation of the velocity of whoever was not seen before


@njit(cache=True)
def add_to_motion(
    step: Ints, person: Ints, pos: Array, time: Array, chord: int, times: Array, settings: Array, recent: Array,
    sums: Array, spread: Array, pooled: Array, vel: Array, slope: Array, place: Array, noise: Array,
) -> None:  # fmt: skip
    """Adds rows (R,), steps ascending, to the state of their people, and writes velocities and noise after each step.

    chord: steps over which `vel` is measured. times (T,): of the regressions, s. settings (5,): change of a
    walker's velocity, m/s, correlation time of errors, s, time for which a person's own noise counts, s, weight of the
    noise of all, and longest jump, m. State by person: recent (K, W, 4), step, time, x, y of the last W rows; sums
    (K, T, 7); spread (K, 4), weighted sums of the noise xx, xy, yy, m², and its weight. pooled (4,): these sums of all
    people. Out: vel (R, 2), slope (R, T, 2), m/s, nan if unknown; place (R, 2), m, mean over the first of the times;
    noise (R, 3), m²: xx, xy, yy.
    """
    legs, correlation, own, common, jump = settings
    low = 0
    while low < len(step):
        high = low
        while high < len(step) and step[high] == step[low]:
            k = person[high]
            _add_noise(recent[k], spread[k], pooled, step[high], time[high], pos[high], legs, correlation, own, jump)
            for n in range(len(times)):
                _add_slope(sums[k, n], time[high] - recent[k, 0, 1], times[n], pos[high], slope[high, n])
            for d in range(2):
                place[high, d] = sums[k, 0, 3 + d] / sums[k, 0, 0]
            recent[k, 1:] = recent[k, :-1].copy()
            recent[k, 0, 0], recent[k, 0, 1] = step[high], time[high]
            recent[k, 0, 2], recent[k, 0, 3] = pos[high, 0], pos[high, 1]
            vel[high] = np.nan
            for w in range(1, recent.shape[1]):
                if step[high] - recent[k, w, 0] <= chord:
                    for d in range(2):
                        vel[high, d] = (pos[high, d] - recent[k, w, 2 + d]) / (time[high] - recent[k, w, 1])
            high += 1
        for r in range(low, high):
            part = spread[person[r]]
            for c in range(3):
                noise[r, c] = (common * pooled[c] / pooled[3] + part[c]) / (common + part[3])
        low = high


@njit(cache=True)
def _add_noise(
    recent: Array, spread: Array, pooled: Array, step: int, time: float, pos: Array, legs: float, correlation: float,
    own: float, jump: float,
) -> None:  # fmt: skip
    """Adds the noise that shows in three steps in a row: in how far the last position is off a uniform motion."""
    if recent[0, 0] != step - 1 or recent[1, 0] != step - 2:
        return
    # of errors with the standard deviation s and the correlation r from step to step, the deviation has the variance
    # s² (6 - 8 r + 2 r²); legs add (v t)² for a change of velocity v
    lasted, before = time - recent[0, 1], recent[0, 1] - recent[1, 1]
    t = (lasted + before) / 2
    x = pos[0] - recent[0, 2] - (recent[0, 2] - recent[1, 2]) * lasted / before
    y = pos[1] - recent[0, 3] - (recent[0, 3] - recent[1, 3]) * lasted / before
    far = np.sqrt(x * x + y * y)
    if far > jump:
        x, y = x * jump / far, y * jump / far
    r, walked = np.exp(-t / correlation), (legs * t) ** 2
    share = 1 / (6 - 8 * r + 2 * r * r)
    spread *= np.exp(-t / own)
    for part in (spread, pooled):
        part[0] += (x * x - walked) * share
        part[1] += x * y * share
        part[2] += (y * y - walked) * share
        part[3] += 1


@njit(cache=True)
def _add_slope(sums: Array, lasted: float, time: float, pos: Array, slope: Array) -> None:
    """Adds a position to an exponentially weighted linear regression over time, and writes its slope, nan at first.

    sums (7,): of the weights w, w t, w t², w x, w y, w t x, w t y, with times t before the last row. lasted: s since.
    """
    if sums[0] > 0:
        sums[2] += lasted * (lasted * sums[0] - 2 * sums[1])
        sums[1] -= lasted * sums[0]
        sums[5] -= lasted * sums[3]
        sums[6] -= lasted * sums[4]
        sums *= np.exp(-lasted / time)
    sums[0] += 1
    sums[3] += pos[0]
    sums[4] += pos[1]
    wide = sums[0] * sums[2] - sums[1] * sums[1]
    for d in range(2):
        slope[d] = (sums[0] * sums[5 + d] - sums[1] * sums[3 + d]) / wide if wide > 0 else np.nan


@njit(cache=True)
def add_to_offsets(step: Ints, pair: Ints, offset: Array, times: Array, total: Array, last: Ints, out: Array) -> None:
    """Adds offsets (R, 2) to the means of their pairs, in order, and writes the means after each to out (R, T, 2).

    times (T,): of the weights exp(-age / time), in steps. total (K, T, 3): weighted sums of x, y and 1 by pair; last
    (K,): step of a pair's last row.
    """
    for r in range(len(step)):
        k = pair[r]
        for n in range(len(times)):
            part = total[k, n]
            part *= np.exp(-(step[r] - last[k]) / times[n])
            part[0] += offset[r, 0]
            part[1] += offset[r, 1]
            part[2] += 1
            out[r, n, 0], out[r, n, 1] = part[0] / part[2], part[1] / part[2]
        last[k] = step[r]


@njit(cache=True)
def lengths_in_noise(vector: Array, usual: Array, share: Array, noise: Array, out: Array) -> None:
    """Writes how long vectors (R, Q, 2) are in units of their standard deviations: of mates' vectors, `usual` (Q,), and
    of errors, noise (R, 3), xx, xy, yy, times share (Q,). out (R, Q): nan where a vector is unknown."""
    for r in range(len(vector)):
        # variances that were estimated from few deviations may not be any
        xx, yy = max(noise[r, 0], 0.0), max(noise[r, 2], 0.0)
        xy = min(max(noise[r, 1], -np.sqrt(xx * yy)), np.sqrt(xx * yy))
        for q in range(len(share)):
            own = usual[q] * usual[q]
            a, b, c = own + share[q] * xx, share[q] * xy, own + share[q] * yy
            x, y = vector[r, q, 0], vector[r, q, 1]
            out[r, q] = np.sqrt(max(c * x * x - 2 * b * x * y + a * y * y, 0.0) / (a * c - b * b))


@njit(cache=True)
def file_ends(
    begin: Ints, neighbour: Ints, pos: Array, way: Array, i: Ints, j: Ints, slowest: float, reach: float,
    straight: float, along: float, out: Array,
) -> None:  # fmt: skip
    """Writes for pairs (R,) of rows at how many ends, 0 to 2, somebody goes on in the line of the two along their way.

    begin (N + 1,), neighbour: who is near each row of pos, way (N, 2), m, m/s. slowest: m/s. Whoever goes on is less
    than reach from the end, m, in a direction whose cosine with the line is at least `straight`. along: least cosine of
    the line and the way. out (R,): 0 beside each other, nan if the two are farther apart than reach or slower.
    """
    for r in range(len(i)):
        a, b = i[r], j[r]
        x, y = pos[b, 0] - pos[a, 0], pos[b, 1] - pos[a, 1]
        u, v = (way[a, 0] + way[b, 0]) / 2, (way[a, 1] + way[b, 1]) / 2
        far, pace = np.sqrt(x * x + y * y), np.sqrt(u * u + v * v)
        out[r] = np.nan
        if not (pace >= slowest and far < reach):
            continue
        out[r] = 0.0
        if abs(x * u + y * v) < along * far * pace:
            continue
        for end, sign in ((a, -1.0), (b, 1.0)):
            for n in range(begin[end], begin[end + 1]):
                k = neighbour[n]
                p, q = pos[k, 0] - pos[end, 0], pos[k, 1] - pos[end, 1]
                away = np.sqrt(p * p + q * q)
                if k != a and k != b and away < reach and sign * (p * x + q * y) >= straight * away * far:
                    out[r] += 1.0
                    break


@njit(cache=True)
def filter_places(
    frame: Ints, person: Ints, pos: Array, step: Ints, walker: Ints, variance: Array, size: int, fps: float,
    spread: float, times: float, noise: Array, latest: Array, state: Array, cov: Array, last: Ints, out: Array,
) -> None:  # fmt: skip
    """Writes the places (R, 2) of a Kalman filter for each axis by itself, rows sorted by frame.

    frame, person (R,), pos (R, 2), m: a row without position keeps it unknown. step, walker (S,), ascending, variance
    (S, 2), m²: noise of each person's positions after steps of `size` frames; `times` as much is expected. spread: by
    how much a velocity changes in 1 s, m/s. State: noise (K, 2), of each person, nan if unknown, and latest (2,), of
    whoever was seen last; state (K, 2, 2), cov (K, 2, 3), and the frame, last (K,), of a person's last row, -1: none.
    """
    n = 0
    for r in range(len(person)):
        # the noise of the last step that is over when the frame comes
        over = (frame[r] - 1) // size
        while n < len(step) and step[n] <= over:
            noise[walker[n]] = variance[n]
            latest[:] = variance[n]
            n += 1
        if np.isnan(pos[r, 0]):
            continue
        k = person[r]
        errors = latest if np.isnan(noise[k, 0]) else noise[k]
        if last[k] < 0:
            for d in range(2):
                error = times * errors[d]
                state[k, d, 0], state[k, d, 1] = pos[r, d], 0.0
                cov[k, d, 0], cov[k, d, 1], cov[k, d, 2] = error, 0.0, FASTEST * FASTEST
        else:
            t = frame[r] / fps - last[k] / fps
            for d in range(2):
                q = spread * spread * t
                state[k, d, 0] += t * state[k, d, 1]
                cov[k, d, 0] += t * (2 * cov[k, d, 1] + t * cov[k, d, 2]) + q * t * t / 3
                cov[k, d, 1] += t * cov[k, d, 2] + q * t / 2
                cov[k, d, 2] += q
                whole = cov[k, d, 0] + times * errors[d]
                if whole > 0:
                    gain, drift, off = cov[k, d, 0] / whole, cov[k, d, 1] / whole, pos[r, d] - state[k, d, 0]
                    state[k, d, 0] += gain * off
                    state[k, d, 1] += drift * off
                    cov[k, d, 2] -= drift * cov[k, d, 1]
                    cov[k, d, 1] -= gain * cov[k, d, 1]
                    cov[k, d, 0] -= gain * cov[k, d, 0]
        out[r, 0], out[r, 1] = state[k, 0, 0], state[k, 1, 0]
        last[k] = frame[r]
    while n < len(step):
        noise[walker[n]] = variance[n]
        latest[:] = variance[n]
        n += 1
