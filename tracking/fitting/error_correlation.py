"""How alike an error stays: correlations over time, and the sum of exponentials that gives them.

A row's error at two frames of the same person; lags from one frame to REACH seconds, evenly in their logarithm.
Of yes-or-no errors (misses) the correlation is that of the normal numbers behind them (tetrachoric): the rho with
which as many pairs are missed in both frames as were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from scenarios.schema.sensor import Memory
from sim.types import Array, Bools, Ints, Truth

REACH = 10.0  # s
LAGS = 14
TIMES = np.geomspace(0.05, 2 * REACH, 26)  # s, of the exponentials tried, up to twice the longest lag
LEAST = 0.03  # of the variance: smaller parts are left out
PAIRS = 12000  # of a lag that are looked at
FEW = 20  # pairs: a lag with fewer tells nothing


@dataclass(frozen=True)
class Correlations:
    """Lags (K,) s, correlations (K,) and the number of pairs (K,) behind each."""

    lag: Array
    rho: Array
    pairs: Array


def pairs_at(truth: Truth, keep: Bools) -> list[tuple[float, Ints, Ints]]:
    """Lags in s, with rows i and j of the same person so far apart; of the rows that `keep` names."""
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


def correlations(truth: Truth, z: Array, keep: Bools) -> Correlations:
    """Of standardised errors z (R, D), all columns together, in the rows that `keep` names."""
    rows = [(lag, float((z[i] * z[j]).mean()), len(i)) for lag, i, j in pairs_at(truth, keep)]
    return _table(rows)


def hidden_correlations(truth: Truth, missed: Bools, p_miss: Array) -> Correlations:
    """Of the normal numbers behind misses (R,), whose chances are p_miss (R,)."""
    from scipy.special import ndtri

    threshold = ndtri(np.clip(p_miss, 1e-3, 1.0 - 1e-3))
    rows = []
    for lag, i, j in pairs_at(truth, np.ones(len(missed), bool)):
        both = float((missed[i] & missed[j]).sum())
        rows.append((lag, _rho(threshold[i], threshold[j], both), len(i)))
    return _table(rows)


def _table(rows: list[tuple[float, float, int]]) -> Correlations:
    a = np.array(rows, dtype=float).reshape(-1, 3)
    return Correlations(a[:, 0], a[:, 1], a[:, 2])


def together(a: Array, b: Array, rho: float) -> Array:
    """P(x < a, y < b) of standard normals with correlation rho, |rho| < 1: Φ(a) Φ(b) + ∫₀^asin(rho) … dθ / 2π."""
    from scipy.special import ndtr

    nodes, weights = np.polynomial.legendre.leggauss(16)
    angle = 0.5 * np.arcsin(rho) * (nodes + 1.0)
    power = np.outer(a**2 + b**2, -0.5 / np.cos(angle) ** 2) + np.outer(a * b, np.sin(angle) / np.cos(angle) ** 2)
    return np.asarray(ndtr(a) * ndtr(b) + np.exp(power) @ weights * (0.25 * np.arcsin(rho) / np.pi))


def _rho(a: Array, b: Array, both: float) -> float:
    from scipy.optimize import brentq

    low, high = -0.5, 0.995

    def short(rho: float) -> float:
        return float(together(a, b, rho).sum()) - both

    if short(low) >= 0.0 or short(high) <= 0.0:
        return low if short(low) >= 0.0 else high
    return float(brentq(short, low, high, xtol=1e-4))


def memory(found: Sequence[Correlations]) -> tuple[Memory, ...]:
    """At most two exponentials, their shares from 0 and of at most 1 together, nearest to the correlations."""
    lag, rho, pairs = (np.concatenate([getattr(c, name) for c in found] or [[]]) for name in ("lag", "rho", "pairs"))
    if not len(lag):
        return ()
    weight = np.sqrt(pairs)
    best: tuple[float, Array, tuple[float, ...]] = (float(weight**2 @ rho**2), np.zeros(1), (1.0,))
    tried = [float(t) for t in TIMES if t <= 2 * lag.max()]
    for times in [(t,) for t in tried] + list(combinations(tried, 2)):
        curves = np.exp(-lag[:, None] / np.array(times))
        share = _shares(curves * weight[:, None], rho * weight)
        error = float(((curves @ share - rho) ** 2 * pairs).sum())
        if error < best[0] * (1.0 - 1e-9):
            best = error, share, times
    parts = [(round(float(s), 3), t) for s, t in zip(best[1], best[2], strict=True) if s >= LEAST]
    scale = max(1.0, sum(s for s, _ in parts))
    return tuple(Memory(share=s / scale, time=float(f"{t:.3g}")) for s, t in parts)


def _shares(curves: Array, target: Array) -> Array:
    """Least squares with shares of at least 0 and at most 1 together."""
    from scipy.optimize import nnls

    share = nnls(curves, target)[0]
    if share.sum() <= 1.0:
        return np.asarray(share)
    if len(share) == 1:
        return np.ones(1)
    difference = curves[:, 0] - curves[:, 1]
    first = float(np.clip(difference @ (target - curves[:, 1]) / (difference @ difference), 0.0, 1.0))
    return np.array([first, 1.0 - first])
