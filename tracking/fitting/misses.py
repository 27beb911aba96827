"""Who is missed: by visibility and size, and for how long.

p = P · c(visibility) · min(1, height / (2 small)), c rising piecewise linearly to 1 over evenly spaced visibilities, by
the greatest likelihood. A person's luck lasts, so that neighbouring rows say little that is new: `small` is kept only
if the likelihood gains more than rows as alike as these give by chance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.schema.sensor import Memory
from sim.types import Array, Bools
from tracking.fitting.detection_matching import MatchedRecording
from tracking.fitting.error_correlation import correlations, hidden_correlations, memory

NODES = 5
SIZES = 16  # of `small` that are tried
PRIOR = 2.0  # rows' worth of belief at each node that the chance goes with the visibility
GAIN = 4.0  # in log likelihood, per row that is new


@dataclass(frozen=True)
class DetectionProbability:
    """The fitted chance to be detected: P, c (NODES,) with c[-1] = 1, small px (0: no effect)."""

    best: float
    curve: tuple[float, ...]
    small: float

    def at(self, visibility: Array, height: Array) -> Array:
        """(R,)."""
        c = np.interp(visibility, np.linspace(0.0, 1.0, NODES), self.curve)
        return self.best * c * (np.minimum(1.0, height / (2 * self.small)) if self.small else 1.0)


def fit_misses(recordings: Sequence[MatchedRecording]) -> tuple[DetectionProbability, tuple[Memory, ...]]:
    """The chance to be detected, and how long a person's luck lasts."""
    hit = np.concatenate([m.hit for m in recordings])
    visibility = np.concatenate([m.truth.visibility for m in recordings])
    height = np.concatenate([_heights(m) for m in recordings])
    plain, likelihood = _chance(hit, visibility, height, 0.0)
    gain = GAIN * _alike(recordings, plain)
    chosen = plain
    least, most = np.quantile(height, (0.01, 0.9)) / 2
    for small in np.geomspace(least, most, SIZES).round(1):
        other, better = _chance(hit, visibility, height, float(small))
        if better > likelihood + gain:
            chosen, likelihood, gain = other, better, 0.0
    if (~hit).sum() < 10:
        return chosen, ()
    lasting = [
        hidden_correlations(m.truth, ~m.hit, 1.0 - chosen.at(m.truth.visibility, _heights(m))) for m in recordings
    ]
    return chosen, memory(lasting)


def _heights(m: MatchedRecording) -> Array:
    """What decides on size: the boxes' heights, from above what sim.detector.sense takes for them."""
    assert m.truth.box is not None
    from sim.scene.body import SHOULDER_SHARE

    if m.camera is not None and m.camera.kind == "top":
        return np.asarray(m.truth.box[:, 2:].max(axis=1) / SHOULDER_SHARE)
    return m.truth.box[:, 3]


def _chance(hit: Bools, visibility: Array, height: Array, small: float) -> tuple[DetectionProbability, float]:
    """The chance of greatest likelihood for a given `small`, and its log likelihood."""
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


def _alike(recordings: Sequence[MatchedRecording], chance: DetectionProbability) -> float:
    """How many rows say as much as one that is new: 1 + 2 Σ correlation of misses, up to the longest lag."""
    alike = []
    for m in recordings:
        p = chance.at(m.truth.visibility, _heights(m))
        z = (m.hit - p) / np.sqrt(np.maximum(p * (1.0 - p), 1e-3))
        found = correlations(m.truth, z[:, None], np.ones(len(z), bool))
        if len(found.lag):
            alike.append(1.0 + 2.0 * m.truth.fps * float(np.trapezoid(np.clip(found.rho, 0.0, 1.0), found.lag)))
    return max(alike, default=1.0)
