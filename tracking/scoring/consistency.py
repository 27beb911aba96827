"""Does a filter know how wrong it is? NEES, NIS and whiteness of innovations (Bar-Shalom, Li & Kirubarajan 2001, 5.4).

NEES is e' P^-1 e of an estimate's error e and covariance P, NIS is v' S^-1 v of an innovation v and its covariance S.
In a filter that is right both are chi-square with n degrees of freedom, n being the length of e or v, and normalised
innovations are white. NIS can lie in its band while the filter is wrong: errors that last (a gait, a limb in the blob)
show in the autocorrelation only.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array

LEVEL = 0.95
LAGS = 5


def normalised(errors: Array, covariances: Array) -> Array:
    """L^-1 e of errors (K, n), covariances (K, n, n) being L L': white, of variance 1, if the filter is right.

    LinAlgError where a covariance is not positive definite.
    """
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariances), errors[..., None])[..., 0])


def normalised_square(errors: Array, covariances: Array) -> Array:
    """e' C^-1 e (K,) of errors (K, n) and covariances (K, n, n): NEES of estimates, NIS of innovations."""
    return np.asarray(np.square(normalised(errors, covariances)).sum(axis=1))


def mean_band(runs: int, dims: int, level: float = LEVEL) -> tuple[float, float]:
    """Where the mean of NEES or NIS over independent runs lies with probability `level`: chi-square quantiles / runs.

    Frames of one run are not independent in NEES: take the mean over runs of one frame. NIS of one run may be taken
    over its frames, where innovations are white.
    """
    from scipy.stats import chi2

    low, high = chi2.ppf(((1 - level) / 2, (1 + level) / 2), runs * dims) / runs
    return float(low), float(high)


def whiteness(innovations: Array, lags: int = LAGS) -> Array:
    """Autocorrelation at lags 1 … of normalised innovations (T, n) of one track: nan where T is too short.

    r(l) = sum v(t)' v(t + l) / (sum |v(t)|^2 sum |v(t + l)|^2)^1/2, both sums over the same T - l frames.
    """
    found = np.full(lags, np.nan)
    for lag in range(1, min(lags, len(innovations) - 1) + 1):
        a, b = innovations[:-lag], innovations[lag:]
        scale = np.sqrt(np.square(a).sum() * np.square(b).sum())
        if scale > 0:
            found[lag - 1] = (a * b).sum() / scale
    return found


def whiteness_band(frames: int, dims: int, lag: int = 1, level: float = LEVEL) -> float:
    """|r(lag)| of white innovations stays below this with probability `level`: normal, variance 1 / (n (T - lag))."""
    from scipy.stats import norm

    return float(norm.ppf((1 + level) / 2) / np.sqrt(dims * (frames - lag)))
