"""A warning if most detections can start no track because of their score.

A detector whose scores lie below a tracker's `score_start` makes a run without tracks, though nothing is wrong.
"""

from __future__ import annotations

import math

import numpy as np

from tracking.prepare import PreparedTracker

MOST = 0.5
"""Share of the detections from which on the warning is given."""


def weak_detections(prepared: PreparedTracker) -> str | None:
    """Returns a warning if over half of the given detections score below the tracker's parameter `score_start`."""
    least = getattr(prepared.config, "score_start", None)
    found = [f.detections.score for f in prepared.frames_given or () if f.detections is not None]
    score = np.concatenate([np.zeros(0), *found])
    if least is None or not len(score):
        return None
    weak = int((score < least).sum())
    if weak <= MOST * len(score):
        return None
    low, quarter, half, high = np.quantile(score, (0, 0.25, 0.5, 1))
    return (
        f"{prepared.sequence.name}: {weak} of {len(score)} detections score below score_start = {least:g}, so that "
        f"they start no track. Scores are {low:.3g} to {high:.3g}, with median {half:.3g}, after any map named above. "
        f"Lower it, as with --set score_start={math.floor(100 * quarter) / 100:g}, or give other scores"
    )
