"""Consistency of a filter: NEES, NIS and whiteness of innovations.

Bar-Shalom, Li & Kirubarajan (2001), "Estimation with Applications to Tracking and Navigation", section 5.4. NEES, the
normalised estimation error squared, is e' P^-1 e for an estimation error e with covariance P. NIS, the normalised
innovation squared, is v' S^-1 v for an innovation v (measurement minus prediction) with covariance S. For a consistent
filter both follow a chi-square distribution with n degrees of freedom, n being the length of e or v, and the normalised
innovations are white: uncorrelated over time.

NIS can lie within its band although the filter is wrong. Errors that persist over time (a person's gait, a limb that is
part of the blob) show only in the autocorrelation.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array

LEVEL = 0.95  # probability of the bands
LAGS = 5  # frames


def normalised(errors: Array, covariances: Array) -> Array:
    """Returns L^-1 e (K, n) of errors e (K, n) with covariances (K, n, n) = L L': white if consistent."""
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariances), errors[..., None])[..., 0])


def normalised_square(errors: Array, covariances: Array) -> Array:
    """Returns e' C^-1 e, shape (K,), for K errors e (K, n) with covariances C (K, n, n)."""
    return np.asarray(np.square(normalised(errors, covariances)).sum(axis=1))


def mean_band(runs: int, dims: int, level: float = LEVEL) -> tuple[float, float]:
    """Returns the interval (low, high) that holds the mean of NEES or NIS of a consistent filter with probability
    `level`.

    runs: number of independent values in the mean; dims: length of one error vector. NEES values of one run depend on
    each other, so take the mean over runs at one frame; NIS values may be averaged over frames if they are white.
    """
    from scipy.stats import chi2

    low, high = chi2.ppf(((1 - level) / 2, (1 + level) / 2), runs * dims) / runs
    return float(low), float(high)


def whiteness(innovations: Array, lags: int = LAGS) -> Array:
    """Returns the autocorrelation (lags,) of one track's normalised innovations (T, n) at lags 1, 2, …"""
    found = np.full(lags, np.nan)
    for lag in range(1, min(lags, len(innovations) - 1) + 1):
        a, b = innovations[:-lag], innovations[lag:]
        scale = np.sqrt(np.square(a).sum() * np.square(b).sum())
        if scale > 0:
            found[lag - 1] = (a * b).sum() / scale
    return found


def whiteness_band(frames: int, dims: int, lag: int = 1, level: float = LEVEL) -> float:
    """Returns the bound below which |r(lag)| of white innovations stays with probability `level`."""
    from scipy.stats import norm

    return float(norm.ppf((1 + level) / 2) / np.sqrt(dims * (frames - lag)))
