"""Correlation of a detector's errors over time, and the sum of exponentials that fits it.

The correlation at a lag is that of two errors of one person, this lag apart. Lags go from one frame to 10 s, evenly
spaced in their logarithm. The fit is a sum of share · exp(-lag / time): share of the variance, time constant in s. For
misses, which are yes or no, it is the tetrachoric correlation: a miss occurs where a standard normal number is below a
threshold, and rho is the correlation of two such numbers that gives the observed number of pairs with both missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from scenarios.schema.sensor import Memory
from sim.types import Array, Bools, Ints, Truth

REACH = 10.0  # s: longest lag
LAGS = 14  # number of lags, before equal ones are merged
TIMES = np.geomspace(0.05, 2 * REACH, 26)  # s: time constants that are tried, up to twice the longest lag
LEAST = 0.03  # share of the variance: smaller parts are left out
PAIRS = 12000  # about this many pairs of a lag are used
FEW = 20  # a lag with fewer pairs is left out


def pairs_by_lag(truth: Truth, keep: Bools) -> list[tuple[float, Ints, Ints]]:
    """Returns for each lag (lag in s, i (P,), j (P,)): pairs of labelled rows of one person, row j this lag after row
    i. keep (R,): the rows that are used. A lag with fewer than 20 pairs is left out."""
    rows = np.flatnonzero(keep)
    people, column = np.unique(truth.id[rows], return_inverse=True)
    row_of = np.full((len(people), truth.length + 1), -1, np.int64)
    row_of[column, truth.frame[rows]] = rows
    most = max(1, min(truth.length - 1, round(REACH * truth.fps)))
    found = []
    for lag in np.unique(np.round(np.geomspace(1, most, LAGS)).astype(np.int64)):
        i, j = row_of[:, :-lag].ravel(), row_of[:, lag:].ravel()
        both = np.flatnonzero((i >= 0) & (j >= 0))
        if len(both) >= FEW:
            both = both[:: 1 + len(both) // PAIRS]
            found.append((float(lag) / truth.fps, i[both], j[both]))
    return found


def correlations(truth: Truth, z: Array, keep: Bools) -> Array:
    """Returns the correlations over time of errors z (R, D) of variance 1, pooled; keep (R,): the rows used.

    The columns of the result (K, 3) are the time between two errors of one person, s, ascending; their correlation; and
    the number of pairs of rows behind it. K may be 0.
    """
    return _table([(lag, float((z[i] * z[j]).mean()), len(i)) for lag, i, j in pairs_by_lag(truth, keep)])


def miss_correlations(truth: Truth, missed: Bools, p_miss: Array) -> Array:
    """Returns the tetrachoric correlations over time of misses, in the columns (K, 3) of `correlations`. missed (R,):
    True if a labelled row is missed; p_miss (R,): the probability of this."""
    from scipy.special import ndtri

    threshold = ndtri(np.clip(p_miss, 1e-3, 1.0 - 1e-3))
    rows = []
    for lag, i, j in pairs_by_lag(truth, np.ones(len(missed), bool)):
        both = float((missed[i] & missed[j]).sum())
        rows.append((lag, _tetrachoric(threshold[i], threshold[j], both), len(i)))
    return _table(rows)


def _table(rows: list[tuple[float, float, int]]) -> Array:
    return np.array(rows, dtype=float).reshape(-1, 3)


def bivariate_normal_cdf(a: Array, b: Array, rho: float) -> Array:
    """Returns P(x < a, y < b), (P,), of standard normals with correlation rho, |rho| < 1; a, b (P,): finite.

    Φ(a) Φ(b) + 1 / 2π ∫ exp(-(a² + b² - 2 a b sin θ) / (2 cos² θ)) dθ, from 0 to asin(rho)
    """
    from scipy.special import ndtr

    # 16 nodes reach full precision in the range of rho that is asked for
    nodes, weights = np.polynomial.legendre.leggauss(16)
    angle = 0.5 * np.arcsin(rho) * (nodes + 1.0)
    power = np.outer(a**2 + b**2, -0.5 / np.cos(angle) ** 2) + np.outer(a * b, np.sin(angle) / np.cos(angle) ** 2)
    return np.asarray(ndtr(a) * ndtr(b) + np.exp(power) @ weights * (0.25 * np.arcsin(rho) / np.pi))


def _tetrachoric(a: Array, b: Array, both: float) -> float:
    """Returns the correlation with which as many pairs are expected below both thresholds as `both`."""
    from scipy.optimize import brentq

    low, high = -0.5, 0.995

    def short(rho: float) -> float:
        return float(bivariate_normal_cdf(a, b, rho).sum()) - both

    if short(low) >= 0.0 or short(high) <= 0.0:
        return low if short(low) >= 0.0 else high
    return float(brentq(short, low, high, xtol=1e-4))


def fit_memory(found: Sequence[Array]) -> tuple[Memory, ...]:
    """Returns at most two parts whose sum of share · exp(-lag / time) is nearest to the correlations. found: tables of
    `correlations`. It is () if no sum is nearer than a correlation of 0, or all shares are below 3 %."""
    from scipy.optimize import nnls

    lag, rho, pairs = np.concatenate([np.zeros((0, 3)), *found]).T
    if not len(lag):
        return ()
    weight = np.sqrt(pairs)
    best: tuple[float, Array, tuple[float, ...]] = (float(weight**2 @ rho**2), np.zeros(1), (1.0,))
    tried = [float(t) for t in TIMES if t <= 2 * lag.max()]
    for times in [(t,) for t in tried] + list(combinations(tried, 2)):
        curves = np.exp(-lag[:, None] / np.array(times))
        share = nnls(curves * weight[:, None], rho * weight)[0]
        share /= max(1.0, share.sum())
        error = float(((curves @ share - rho) ** 2 * pairs).sum())
        if error < best[0] * (1.0 - 1e-9):
            best = error, share, times
    parts = [(round(float(s), 3), t) for s, t in zip(best[1], best[2], strict=True) if s >= LEAST]
    scale = max(1.0, sum(s for s, _ in parts))
    return tuple(Memory(share=s / scale, time=float(f"{t:.3g}")) for s, t in parts)
