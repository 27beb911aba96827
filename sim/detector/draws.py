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
    """Return uniforms in (0, 1), (frames, per_frame), for frames `first`, `first` + 1, … (from 1 on).

    The generator must be new. It spends `per_frame` numbers on each frame, so that a frame's draws do not depend on
    `first`.
    """
    generator.bit_generator.advance((first - 1) * per_frame)  # type: ignore[attr-defined]
    return np.asarray(generator.random((frames, per_frame)) + 2.0**-54)


def normals(u: Array) -> Array:
    """Return the standard normal quantiles at uniforms u of any shape; always finite, also where u was rounded to 1."""
    from scipy.special import ndtri

    return np.asarray(ndtri(np.minimum(u, 1.0 - 2.0**-53)))


def poisson_counts(rate: float, u: Array) -> Ints:
    """Return the Poisson quantiles (N,) at uniforms u (N,); for a fixed u they never fall when the rate rises."""
    if not rate:
        return np.zeros(len(u), np.int64)
    from scipy.special import pdtr

    k = np.arange(int(rate + 12 * np.sqrt(rate) + 20))
    return np.searchsorted(pdtr(k, rate), u).astype(np.int64)


def interpolated_quantiles(curve: tuple[float, ...], u: Array) -> Array:
    """Return the quantiles at u (N,) of a distribution given by evenly spaced quantiles, linear between them."""
    return np.interp(u, np.linspace(0.0, 1.0, len(curve)), curve)


def true_scores(u: Array, visibility: Array, sensor: Sensor) -> Array:
    """Return the scores (N,) in [0, 1] of true detections at uniforms u (N,), by their visibility (N,).

    If `sensor.true_scores` is given, they are its quantiles, whatever the visibility. Else they are 1 for a detector
    without misses and false alarms (detect_prob 1, clutter_rate 0). Otherwise the mean is 0.8 in full view, and half as
    much at visibility 0.
    """
    if sensor.true_scores is not None:
        return interpolated_quantiles(sensor.true_scores, u)
    if sensor.detect_prob == 1.0 and sensor.clutter_rate == 0.0:
        return np.ones(len(u))
    return np.asarray((0.4 + 0.6 * np.sqrt(u)) * (0.5 + 0.5 * visibility))


def false_scores(u: Array, sensor: Sensor) -> Array:
    """Return the scores (N,) in [0, 1] of false alarms at uniforms u (N,).

    They are the quantiles of `sensor.false_scores` if given, else HIGHEST_FALSE_SCORE u².
    """
    curve = sensor.false_scores
    return HIGHEST_FALSE_SCORE * u**2 if curve is None else interpolated_quantiles(curve, u)
