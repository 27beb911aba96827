"""Fits the errors of detected boxes: mean and standard deviation, growth with occlusion, tails, and memory over time.

Input: recordings whose detections are matched to labelled people. Errors are the four of
`sim.detector.box_noise.box_errors`: of a box's middle (to the right), foot and top (downwards), in heights of the
labelled box, and the logarithm of detected over labelled width. Their standard deviation is sd (1 + occluded (1 -
visibility)): sd that of a person in full view, occluded its growth with the hidden share, visibility the visible share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenarios.schema.sensor import BoxNoise
from sim.detector.box_noise import box_errors, seen_shift
from sim.scene.camera import foot_points
from sim.types import Array
from tracking.fitting.detection_matching import MatchedRecording
from tracking.fitting.error_correlation import correlations, fit_memory

GROWTH = np.concatenate([[0.0], np.geomspace(0.1, 6.0, 40)])  # values of `occluded` to choose from
TAILS = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 20.0)  # excess kurtoses to choose from
HALF = (0.3, 0.9)  # a row counts as half hidden if its visibility is between these
BARELY = 0.25  # visibility: rows below it are left out, as their nearest box often belongs to someone else
POINTS: tuple[Literal["own", "seen", "foot"], ...] = ("own", "seen", "foot")  # in order of preference
FEW = 20  # with fewer half hidden rows, boxes are taken as amodal and errors as independent of visibility


@dataclass(frozen=True)
class ErrorSpread:
    """A model of the errors of a box: mean + sd (1 + occluded (1 - visibility)) n, n random of variance 1."""

    # (4,): mean error of middle, foot, top (box heights) and logarithm of the width, the same at any visibility
    mean: Array
    sd: Array  # (4,): standard deviation of the same errors for a person in full view (visibility 1)
    occluded: float  # growth of the standard deviation with the hidden share 1 - visibility, 0 or more
    likelihood: float  # log likelihood of the data the model was fitted to, up to a constant; 0 without data


def fit_box_noise(recordings: Sequence[MatchedRecording]) -> tuple[Literal["visible", "amodal"], BoxNoise]:
    """Returns whether detected boxes are of the visible part or of the whole person, and their errors.

    If no detected row is a quarter visible, means, standard deviations and `occluded` are 0, and `memory` is None.
    """
    kind: Literal["visible", "amodal"] = "visible" if _of_visible_part(recordings) else "amodal"
    best = _fit_spread(recordings, kind)
    correlated, standardised = [], []
    for m in recordings:
        z = np.full((len(m.truth.id), 4), np.nan)
        growth = 1.0 + best.occluded * (1.0 - m.truth.visibility[m.hit])
        z[m.hit] = (_errors(m, kind) - best.mean) / np.maximum(best.sd * growth[:, None], 1e-9)
        correlated.append(correlations(m.truth, z, m.hit))
        standardised.append(z[m.hit])
    pairs = [(round(float(a), 4), round(float(b), 4)) for a, b in zip(best.mean, best.sd, strict=True)]
    across, foot, top, width = pairs
    grown = round(best.occluded, 3)
    parts = fit_memory(correlated) if best.sd.max() > 1e-6 else ()
    heights = np.concatenate([_true(m, kind)[:, 3] for m in recordings])
    least = float(best.sd[:3].min() * np.median(heights)) if len(heights) else 0.0
    return kind, BoxNoise(
        across=across, foot=foot, top=top, width=width, occluded=grown, tails=_tails(np.concatenate(standardised)),
        floor_px=round(min(BoxNoise().floor_px, least), 4), memory=parts or None,
    )  # fmt: skip


def _tails(z: Array) -> float:
    """Returns the likeliest excess kurtosis of TAILS for Student-t errors of variance 1."""
    from scipy.special import gammaln

    def likelihood(tails: float) -> float:
        if not tails:
            return -0.5 * float((z**2 + np.log(2 * np.pi)).sum())
        # the excess kurtosis of a Student-t distribution is 6 / (v - 4)
        v = 4.0 + 6.0 / tails
        level = gammaln((v + 1) / 2) - gammaln(v / 2) - 0.5 * np.log(np.pi * (v - 2))
        return float((level - (v + 1) / 2 * np.log1p(z**2 / (v - 2))).sum())

    return max(TAILS, key=likelihood)


def _of_visible_part(recordings: Sequence[MatchedRecording]) -> bool:
    """True if detected boxes of half hidden people are nearer to the visible part than to the whole box."""
    away: dict[str, list[Array]] = {"visible": [], "amodal": []}
    for m in recordings:
        visibility = m.truth.visibility[m.hit]
        half, whole = (visibility > HALF[0]) & (visibility < HALF[1]), visibility >= HALF[1]
        for kind, errors in away.items():
            e = _errors(m, kind)
            usual = np.median(e[whole], axis=0) if whole.any() else np.zeros(4)
            errors.append(np.abs(e[half] - usual)[:, :3] * _true(m, kind)[half, 3:])
    both = {kind: np.concatenate(errors) for kind, errors in away.items()}
    return len(both["visible"]) >= FEW and float(both["visible"].mean()) < float(both["amodal"].mean())


def _errors(m: MatchedRecording, kind: str) -> Array:
    """Returns the errors (H, 4) of the H detected rows against their labelled boxes of a kind."""
    return box_errors(m.box[m.match[m.hit]], _true(m, kind))


def _true(m: MatchedRecording, kind: str) -> Array:
    assert m.truth.box is not None
    true = m.truth.box
    if kind == "visible" and m.truth.visible_box is not None:
        true = np.where(np.isfinite(m.truth.visible_box), m.truth.visible_box, true)
    return true[m.hit]


def _fit_spread(recordings: Sequence[MatchedRecording], kind: str) -> ErrorSpread:
    e = np.concatenate([_errors(m, kind) for m in recordings])
    hidden = np.concatenate([1.0 - m.truth.visibility[m.hit] for m in recordings])
    clear = hidden <= 1.0 - BARELY
    e, hidden = e[clear], hidden[clear]
    if not len(e):
        return ErrorSpread(np.zeros(4), np.zeros(4), 0.0, 0.0)
    tried = GROWTH if (hidden > 1.0 - HALF[1]).sum() >= FEW else GROWTH[:1]
    return max((_spread_of_growth(e, hidden, float(k)) for k in tried), key=lambda s: s.likelihood)


def _spread_of_growth(e: Array, hidden: Array, k: float) -> ErrorSpread:
    """Returns the spread of errors e (H, 4) if `occluded` is k; hidden (H,): 1 - visibility."""
    growth = 1.0 + k * hidden
    weight = 1.0 / growth**2
    mean = weight @ e / weight.sum()
    sd = np.sqrt(np.mean((e - mean) ** 2 * weight[:, None], axis=0))
    near = np.mean(np.abs(e - mean) / growth[:, None], axis=0)  # scale of the Laplace distribution
    # of a Laplace distribution, which large errors influence little
    likelihood = -len(e) * float(np.log(np.maximum(near, 1e-6)).sum()) - 4 * float(np.log(growth).sum())
    return ErrorSpread(mean, sd, k, likelihood)


def fit_points(
    recordings: Sequence[MatchedRecording], kind: str
) -> tuple[Literal["own", "seen", "foot"], float | None]:
    """Returns the setting `points` that explains the detections' ground positions best, and its deviation, m."""
    found = [_point_errors(m, kind) for m in recordings if m.pos is not None and m.truth.pos is not None]
    e = np.concatenate([np.zeros((3, 0, 2)), *found], axis=1)
    best = int(np.abs(e).sum(axis=(1, 2)).argmin())
    if best == POINTS.index("foot") or not e.shape[1]:
        return "foot", None
    return POINTS[best], float(np.sqrt(np.mean(e[best] ** 2)))


def _point_errors(m: MatchedRecording, kind: str) -> Array:
    assert m.pos is not None
    assert m.truth.pos is not None
    pos = m.pos[m.match[m.hit]]
    own = pos - m.truth.pos[m.hit]
    if m.camera is None:
        return np.stack([own, own, own])
    z = np.zeros(len(own)) if m.truth.z is None else m.truth.z[m.hit]
    seen = own - seen_shift(_true(m, kind), _true(m, "amodal"), z, m.camera)
    foot = pos - foot_points(m.box[m.match[m.hit]], z, m.camera)
    return np.stack([own, seen, np.where(np.isfinite(foot), foot, own)])
