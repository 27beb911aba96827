"""Maps scores of any detector into [0, 1], in their order, by a map that a few outliers do not move."""

from __future__ import annotations

import numpy as np

from sim.types import Array

FEW = 0.02  # share of scores outside [0, 1] up to which they count as outliers of scores in [0, 1]


def unit_scores(score: Array) -> tuple[Array, str]:
    """Returns the finite scores (N,) in [0, 1], and how they were mapped, "" if they were not.

    A few outliers are clipped. Other scores s become 1 / (1 + exp(-(s - c) / d)), c the lower quartile and d such that
    the median becomes about 0.75.
    """
    outside = (score < 0) | (score > 1)
    count = int(outside.sum())
    if not count:
        return score, ""
    if (score == score[0]).all():
        return np.ones_like(score), ""
    if count <= max(FEW * len(score), 1):
        return np.clip(score, 0, 1), f"{count} of {len(score)} scores outside 0 to 1 are clipped"
    quarter, median = np.quantile(score, (0.25, 0.5))
    # A det.txt holds what its detector takes for people, so that most boxes must be able to start a track.
    # Rounded, so that a few more scores seldom move them.
    c, d = float(f"{quarter:.2g}"), float(f"{(median - quarter) / np.log(3) or 1.0:.1g}")
    mapped = 1 / (1 + np.exp(-np.clip((score - c) / d, -500, 500)))
    span = f"scores from {score.min():g} to {score.max():g}"
    return mapped, f"{span} are mapped into 0 to 1 by 1 / (1 + exp(-(score - {c:g}) / {d:g}))"
