"""Fits the probability of detection, by visibility and box height, and how long misses persist.

p = P · c(visibility) · min(1, height / (2 small)). P is the probability for a large person in full view. The factor c
is piecewise linear over 5 evenly spaced visibilities and rises to c(1) = 1. small is half the height in px below which
detection becomes less likely. P and c have the greatest likelihood for each candidate of `small`. Misses of one person
persist, so successive rows (people in frames) carry little new information. `small` is therefore used only if the log
likelihood gains more than 4 times the number of rows that carry as much information as one independent row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.schema.sensor import Memory
from sim.types import Array, Bools
from tracking.fitting.detection_matching import MatchedRecording
from tracking.fitting.error_correlation import correlations, fit_memory, miss_correlations

NODES = 5
SIZES = 16  # number of candidates of `small`
PRIOR = 2.0  # weight, in rows per node, of the prior that c equals the visibility
GAIN = 4.0  # gain in log likelihood per independent row that `small` needs
FEW_MISSES = 10  # with fewer misses in all, no memory is fitted


@dataclass(frozen=True)
class DetectionProbability:
    """Probability that a person is detected, by visibility (visible share, 0 to 1) and box height."""

    best: float  # probability P for a large person in full view, 0 to 1
    # factors c at the visibilities 0, 0.25, 0.5, 0.75 and 1, linear between them; ascending, the last is 1.
    curve: tuple[float, ...]
    small: float  # half the box height in px below which detection becomes less likely; 0: height has no effect

    def at(self, visibility: Array, height: Array) -> Array:
        """Returns best · c(visibility) · min(1, height / (2 small)), (R,); the last factor only if `small` is not 0."""
        c = np.interp(visibility, np.linspace(0.0, 1.0, NODES), self.curve)
        return self.best * c * (np.minimum(1.0, height / (2 * self.small)) if self.small else 1.0)


def fit_misses(recordings: Sequence[MatchedRecording]) -> tuple[DetectionProbability, tuple[Memory, ...]]:
    """Returns the probability of detection, and the parts of the misses' memory, () with fewer than 10 misses."""
    hit = np.concatenate([m.hit for m in recordings])
    visibility = np.concatenate([m.truth.visibility for m in recordings])
    height = np.concatenate([_heights(m) for m in recordings])
    plain, likelihood = _fit_probability(hit, visibility, height, 0.0)
    gain = GAIN * _rows_per_independent_row(recordings, plain)
    # misses persist, so that rows carry little new information: `small` must gain in independent rows
    chosen = plain
    least, most = np.quantile(height, (0.01, 0.9)) / 2
    for small in np.geomspace(least, most, SIZES).round(1):
        other, better = _fit_probability(hit, visibility, height, float(small))
        if better > likelihood + gain:
            chosen, likelihood, gain = other, better, 0.0
    if (~hit).sum() < FEW_MISSES:
        return chosen, ()
    correlated = [
        miss_correlations(m.truth, ~m.hit, 1.0 - chosen.at(m.truth.visibility, _heights(m))) for m in recordings
    ]
    return chosen, fit_memory(correlated)


def _heights(m: MatchedRecording) -> Array:
    """Returns the heights (R,), px, that decide on detection: from above, those that the shoulders stand for."""
    assert m.truth.box is not None
    from sim.scene.body import SHOULDER_SHARE

    if m.camera is not None and m.camera.kind == "top":
        return np.asarray(m.truth.box[:, 2:].max(axis=1) / SHOULDER_SHARE)
    return m.truth.box[:, 3]


def _fit_probability(hit: Bools, visibility: Array, height: Array, small: float) -> tuple[DetectionProbability, float]:
    """Returns the likeliest probability of detection for a given `small`, and its log likelihood with the prior."""
    from scipy.optimize import minimize

    levels = np.linspace(0.0, 1.0, NODES)
    weights = np.stack([np.interp(visibility, levels, row) for row in np.eye(NODES)], axis=1)
    ramp = np.minimum(1.0, height / (2 * small)) if small else np.ones(len(hit))

    def curve(x: Array) -> Array:
        steps = 1.0 / (1.0 + np.exp(-x))  # P, then c[k] / c[k + 1] from the last to the first
        return np.asarray(np.cumprod(steps)[::-1])

    def loss(x: Array) -> float:
        c = curve(x)
        p = np.clip((weights @ c) * ramp, 1e-6, 1.0 - 1e-6)
        believed = np.clip(c / c[-1], 1e-6, 1.0 - 1e-6)[:-1]
        prior = PRIOR * (levels[:-1] * np.log(believed) + (1.0 - levels[:-1]) * np.log(1.0 - believed)).sum()
        return -float(np.where(hit, np.log(p), np.log(1.0 - p)).sum() + prior)

    found = minimize(loss, np.array([2.0, 1.0, 0.5, 0.0, -1.0]), method="L-BFGS-B", bounds=[(-9.0, 9.0)] * NODES)
    c = curve(found.x)
    return DetectionProbability(float(c[-1]), tuple(c / c[-1]), small), -float(found.fun)


def _rows_per_independent_row(recordings: Sequence[MatchedRecording], probability: DetectionProbability) -> float:
    """Returns how many labelled rows carry as much information as one independent row, at least 1."""
    found = []
    for m in recordings:
        p = probability.at(m.truth.visibility, _heights(m))
        z = (m.hit - p) / np.sqrt(np.maximum(p * (1.0 - p), 1e-3))
        over_time = correlations(m.truth, z[:, None], np.ones(len(z), bool))
        if len(over_time.lag):
            area = float(np.trapezoid(np.clip(over_time.rho, 0.0, 1.0), over_time.lag))
            found.append(1.0 + 2.0 * m.truth.fps * area)
    return max(found, default=1.0)
