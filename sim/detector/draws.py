"""Random draws that true detections and false alarms share: uniforms of a frame, normals, Poisson counts, scores.

Everything is drawn as uniforms; all other numbers are quantiles at them. A changed setting therefore leaves all draws
as they were.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.rng import uniforms
from sim.types import Array

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

HIGHEST_FALSE_SCORE = 0.7  # of a false alarm whose detector has no measured scores; the mean is a third of it


def frame_uniforms(generator: np.random.Generator, first: int, frames: int, per_frame: int) -> Array:
    """Returns uniforms, (frames, per_frame), for frames `first` to `first` + frames - 1 (frames from 1 on).

    They are above 0 and at most 1; a value may round to 1. The generator must be new, and is advanced: past the numbers
    of the frames before `first` and those returned. It spends `per_frame` numbers on each frame, so that a frame's
    draws do not depend on `first`. Raises AttributeError if the generator's bit generator cannot be advanced; numpy's
    default can.
    """
    generator.bit_generator.advance((first - 1) * per_frame)  # type: ignore[attr-defined]
    return uniforms(generator, (frames, per_frame))


def interpolated_quantiles(curve: tuple[float, ...], u: Array) -> Array:
    """Returns the quantiles (N,) at u (N,), 0 to 1, of a distribution given by evenly spaced quantiles, linear between
    them.

    curve: the quantiles from u = 0 to u = 1, at least one number, in ascending order; a single one is the result for
    every u. u outside 0 to 1 gives the first or last of them. Raises ValueError for an empty curve.
    """
    values = np.array(curve)
    if len(values) == 1:
        return np.full(len(u), values[0])
    place = np.clip(u, 0.0, 1.0) * (len(values) - 1)
    k = np.minimum(place.astype(np.int64), len(values) - 2)
    return np.asarray(values[k] + (place - k) * (values[k + 1] - values[k]))


def true_scores(u: Array, visibility: Array, sensor: Sensor) -> Array:
    """Returns the scores (N,) in [0, 1] of N true detections at uniforms u (N,), 0 to 1, by their visibility (N,), 0 to
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
    """Returns the scores (N,) in [0, 1] of N false alarms at uniforms u (N,), 0 to 1.

    They are the quantiles of `sensor.false_scores` at u if given, else 0.7 u², with a mean of 0.23.
    """
    curve = sensor.false_scores
    return HIGHEST_FALSE_SCORE * u * u if curve is None else interpolated_quantiles(curve, u)
