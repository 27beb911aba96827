"""How far boxes are off: bias and spread in proportion to the box, more when half hidden, and how long it lasts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scenarios.schema.sensor import BoxNoise
from sim.detector.box_noise import box_errors
from sim.types import Array
from tracking.fitting.detection_matching import MatchedRecording
from tracking.fitting.error_correlation import correlations, memory

GROWTH = np.concatenate([[0.0], np.geomspace(0.1, 6.0, 40)])  # values of `occluded` that are tried
TAILS = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 9.0, 14.0, 20.0)
HALF = (0.3, 0.9)  # visibilities between which a row tells the visible part from the whole
BARELY = 0.25  # visibility: of who shows less the nearest box is often another's, and no error of his own
FEW = 20  # rows half hidden: with fewer, boxes are taken for those of the whole, and errors for alike


@dataclass(frozen=True)
class ErrorSpread:
    """Errors e = mean + sd (1 + occluded (1 - visibility)) n: mean, sd (4,), occluded, and the log likelihood."""

    mean: Array
    sd: Array
    occluded: float
    likelihood: float


def fit_noise(recordings: Sequence[MatchedRecording]) -> tuple[Literal["visible", "amodal"], BoxNoise]:
    """Whether boxes are of the visible part or of the whole, and their errors against it."""
    kind: Literal["visible", "amodal"] = "visible" if _of_visible_part(recordings) else "amodal"
    best = _spread(recordings, kind)
    lasting, seen = [], []
    for m in recordings:
        z = np.full((len(m.truth.id), 4), np.nan)
        growth = 1.0 + best.occluded * (1.0 - m.truth.visibility[m.hit])
        z[m.hit] = (_errors(m, kind) - best.mean) / np.maximum(best.sd * growth[:, None], 1e-9)
        lasting.append(correlations(m.truth, z, m.hit))
        seen.append(z[m.hit])
    pairs = [(round(float(a), 4), round(float(b), 4)) for a, b in zip(best.mean, best.sd, strict=True)]
    across, foot, top, width = pairs
    grown = round(best.occluded, 3)
    parts = memory(lasting) if best.sd.max() > 1e-6 else ()
    return kind, BoxNoise(
        across=across, foot=foot, top=top, width=width, occluded=grown, tails=_tails(np.concatenate(seen)),
        memory=parts or None,
    )  # fmt: skip


def _tails(z: Array) -> float:
    """The excess kurtosis of the likeliest Student's t of unit variance, out of TAILS; 0 the normal."""
    from scipy.special import gammaln

    def likelihood(tails: float) -> float:
        if not tails:
            return -0.5 * float((z**2 + np.log(2 * np.pi)).sum())
        v = 4.0 + 6.0 / tails
        level = gammaln((v + 1) / 2) - gammaln(v / 2) - 0.5 * np.log(np.pi * (v - 2))
        return float((level - (v + 1) / 2 * np.log1p(z**2 / (v - 2))).sum())

    return max(TAILS, key=likelihood)


def _of_visible_part(recordings: Sequence[MatchedRecording]) -> bool:
    """Whether the edges of people half hidden are nearer to those of the visible part, the usual error taken off."""
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
    """(H, 4) of the rows that were detected."""
    return box_errors(m.box[m.match[m.hit]], _true(m, kind))


def _true(m: MatchedRecording, kind: str) -> Array:
    """(H, 4) boxes of that kind of the rows that were detected."""
    assert m.truth.box is not None
    true = m.truth.box
    if kind == "visible" and m.truth.visible_box is not None:
        true = np.where(np.isfinite(m.truth.visible_box), m.truth.visible_box, true)
    return true[m.hit]


def _spread(recordings: Sequence[MatchedRecording], kind: str) -> ErrorSpread:
    e = np.concatenate([_errors(m, kind) for m in recordings])
    hidden = np.concatenate([1.0 - m.truth.visibility[m.hit] for m in recordings])
    clear = hidden <= 1.0 - BARELY
    e, hidden = e[clear], hidden[clear]
    if not len(e):
        return ErrorSpread(np.zeros(4), np.zeros(4), 0.0, 0.0)
    tried = GROWTH if (hidden > 1.0 - HALF[1]).sum() >= FEW else GROWTH[:1]
    return max((_of_growth(e, hidden, float(k)) for k in tried), key=lambda s: s.likelihood)


def _of_growth(e: Array, hidden: Array, k: float) -> ErrorSpread:
    growth = 1.0 + k * hidden
    weight = 1.0 / growth**2
    mean = weight @ e / weight.sum()
    sd = np.sqrt(np.mean((e - mean) ** 2 * weight[:, None], axis=0))
    near = np.mean(np.abs(e - mean) / growth[:, None], axis=0)  # Laplace's scale: what is far off tells little
    likelihood = -len(e) * float(np.log(np.maximum(near, 1e-6)).sum()) - 4 * float(np.log(growth).sum())
    return ErrorSpread(mean, sd, k, likelihood)


def point_noise(recordings: Sequence[MatchedRecording]) -> float | None:
    """sd per axis of points on the ground, m; None where detections have none of their own."""
    errors = [
        m.pos[m.match[m.hit]] - m.truth.pos[m.hit] for m in recordings if m.pos is not None and m.truth.pos is not None
    ]
    e = np.concatenate([np.zeros((0, 2)), *errors])
    return float(np.sqrt(np.mean(e**2))) if len(e) else None
