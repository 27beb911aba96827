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
    """Returns L^-1 e, shape (K, n), for K errors e (K, n) with covariances (K, n, n) = L L', L the lower Cholesky
    factor.

    For a consistent filter the n components are uncorrelated with variance 1. Raises numpy.linalg.LinAlgError if a
    covariance is not positive definite. K = 0 gives an empty array.
    """
    return np.asarray(np.linalg.solve(np.linalg.cholesky(covariances), errors[..., None])[..., 0])


def normalised_square(errors: Array, covariances: Array) -> Array:
    """Returns e' C^-1 e, shape (K,), for K errors e (K, n) with covariances C (K, n, n).

    This is NEES for estimation errors and NIS for innovations (measurement minus prediction). Its mean is n for a
    consistent filter. Raises numpy.linalg.LinAlgError if a covariance is not positive definite. K = 0 gives an empty
    array.
    """
    return np.asarray(np.square(normalised(errors, covariances)).sum(axis=1))


def mean_band(runs: int, dims: int, level: float = LEVEL) -> tuple[float, float]:
    """Returns the interval (low, high) that contains the mean of NEES or NIS of a consistent filter with probability
    `level`.

    NEES, NIS: squared estimation errors or innovations, normalised by their covariance. runs: number of independent
    values in the mean, at least 1. dims: length n of one error vector. level: between 0 and 1. The limits are
    chi-square quantiles with runs * dims degrees of freedom, divided by runs. NEES values of one run are not
    independent over frames, so take the mean over runs at one frame. NIS values of one run may be averaged over frames
    if the innovations are white.
    """
    from scipy.stats import chi2

    low, high = chi2.ppf(((1 - level) / 2, (1 + level) / 2), runs * dims) / runs
    return float(low), float(high)


def whiteness(innovations: Array, lags: int = LAGS) -> Array:
    """Returns the autocorrelation r of one track's normalised innovations: (lags,), r at lags 1, 2, … `lags` in frames.

    innovations (T, n): measurement minus prediction, divided by its Cholesky factor, one row v(t) per frame. r(l) = sum
    v(t)' v(t + l) / (sum |v(t)|^2 sum |v(t + l)|^2)^1/2, all sums over the same T - l frames. It is nan at lags of T or
    more, and where a sum of squares is 0 or nan.
    """
    found = np.full(lags, np.nan)
    for lag in range(1, min(lags, len(innovations) - 1) + 1):
        a, b = innovations[:-lag], innovations[lag:]
        scale = np.sqrt(np.square(a).sum() * np.square(b).sum())
        if scale > 0:
            found[lag - 1] = (a * b).sum() / scale
    return found


def whiteness_band(frames: int, dims: int, lag: int = 1, level: float = LEVEL) -> float:
    """Returns the bound that the size of the autocorrelation |r(lag)| of white innovations stays below with probability
    `level`.

    frames: number T of frames, above `lag`; dims: length n of one innovation; lag: in frames; level: 0 to 1, default
    0.95. r is approximately normal with mean 0 and variance 1 / (n (T - lag)).
    """
    from scipy.stats import norm

    return float(norm.ppf((1 + level) / 2) / np.sqrt(dims * (frames - lag)))
