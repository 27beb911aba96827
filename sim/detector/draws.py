"""Random draws that true detections and false alarms share: uniforms of a frame, normals, Poisson counts, scores.

Everything is drawn as uniforms; all other numbers are quantiles at them. A changed setting therefore leaves all draws
as they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.types import Array, Ints

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

HIGHEST_FALSE_SCORE = 0.7  # of a false alarm whose detector has no measured scores; the mean is a third of it


def uniforms(generator: np.random.Generator, first: int, frames: int, per_frame: int) -> Array:
    """Return uniforms, (frames, per_frame), for frames `first` to `first` + frames - 1 (frames from 1 on).

    They are above 0 and at most 1; a value may round to 1. The generator must be new, and is advanced: past the numbers
    of the frames before `first` and those returned. It spends `per_frame` numbers on each frame, so that a frame's
    draws do not depend on `first`. Raises AttributeError if the generator's bit generator cannot be advanced; numpy's
    default can.
    """
    generator.bit_generator.advance((first - 1) * per_frame)  # type: ignore[attr-defined]
    return np.asarray(generator.random((frames, per_frame)) + 2.0**-54)


def normals(u: Array) -> Array:
    """Return the standard normal quantiles at u, any shape, with 0 < u <= 1: always finite, as u = 1 is lowered a
    little.

    u = 0 gives -inf, nan or a negative u gives nan, u above 1 counts as 1.
    """
    from scipy.special import ndtri

    return np.asarray(ndtri(np.minimum(u, 1.0 - 2.0**-53)))


def poisson_counts(rate: float, u: Array) -> Ints:
    """Return the quantiles (N,) int64 of a Poisson distribution of mean `rate` at uniforms u (N,); zeros if the rate is
    0.

    A quantile is the smallest number whose cumulative probability is at least u; it is at most rate + 12 √rate + 20,
    also at u = 1. For a fixed u below 1 it never falls when the rate rises. Raises ValueError for a negative or nan
    rate.
    """
    if not rate:
        return np.zeros(len(u), np.int64)
    from scipy.special import pdtr

    k = np.arange(int(rate + 12 * np.sqrt(rate) + 20))
    return np.searchsorted(pdtr(k, rate), u).astype(np.int64)


def interpolated_quantiles(curve: tuple[float, ...], u: Array) -> Array:
    """Return the quantiles (N,) at u (N,), 0 to 1, of a distribution given by evenly spaced quantiles, linear between
    them.

    curve: the quantiles from u = 0 to u = 1, at least one number, in ascending order; a single one is the result for
    every u. u outside 0 to 1 gives the first or last of them. Raises ValueError for an empty curve.
    """
    return np.interp(u, np.linspace(0.0, 1.0, len(curve)), curve)


def true_scores(u: Array, visibility: Array, sensor: Sensor) -> Array:
    """Return the scores (N,) in [0, 1] of N true detections at uniforms u (N,), 0 to 1, by their visibility (N,), 0 to
    1.

    If `sensor.true_scores` is given, they are its quantiles at u, whatever the visibility. Else they are 1 for a
    detector without misses and false alarms (`sensor.detect_prob` 1, `sensor.clutter_rate` 0). Otherwise the score is
    (0.4 + 0.6 √u)(0.5 + 0.5 visibility): its mean is 0.8 in full view, and half as much at visibility 0.
    """
    if sensor.true_scores is not None:
        return interpolated_quantiles(sensor.true_scores, u)
    if sensor.detect_prob == 1.0 and sensor.clutter_rate == 0.0:
        return np.ones(len(u))
    return np.asarray((0.4 + 0.6 * np.sqrt(u)) * (0.5 + 0.5 * visibility))


def false_scores(u: Array, sensor: Sensor) -> Array:
    """Return the scores (N,) in [0, 1] of N false alarms at uniforms u (N,), 0 to 1.

    They are the quantiles of `sensor.false_scores` at u if given, else 0.7 u², with a mean of 0.23.
    """
    curve = sensor.false_scores
    return HIGHEST_FALSE_SCORE * u**2 if curve is None else interpolated_quantiles(curve, u)
