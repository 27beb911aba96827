"""How well beliefs tell who belongs together: log loss, calibration error and F1 of rows of pairs."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools
from tracking.fitting.belief import PairSample, log_loss

BINS = 15  # Of equal width, between the probabilities 0 and 1.


def belief_scores(sample: PairSample, log_odds: Array) -> dict[str, float]:
    """Returns "pairs" (their number), "log loss", "calibration error" and "F1" (at a probability above 1/2) of beliefs.
    log_odds (R,): the beliefs of the sample's rows. F1 is nan without any pair together on either side."""
    true, weight = sample.together, sample.weight
    bins = reliability(log_odds, true, weight)
    hits, count = int((true & (log_odds > 0)).sum()), int(true.sum() + (log_odds > 0).sum())
    return {
        "pairs": float(sample.pairs),
        "log loss": log_loss(sample, log_odds),
        "calibration error": float(np.abs(bins[:, 0] * (bins[:, 1] - bins[:, 2]))[bins[:, 0] > 0].sum()),
        "F1": 2 * hits / count if count else float("nan"),
    }


def reliability(log_odds: Array, true: Bools, weight: Array) -> Array:
    """Returns for each of 15 bins of probability its share of the weight, the mean probability, and the share of rows
    that are truly together, (15, 3); the two means are nan in an empty bin."""
    probability = 1 / (1 + np.exp(-log_odds))
    place = np.minimum((probability * BINS).astype(np.int64), BINS - 1)
    total = np.bincount(place, weight, BINS)
    means = [np.bincount(place, weight * x, BINS) for x in (probability, true)]
    with np.errstate(invalid="ignore"):
        return np.column_stack([total / weight.sum(), *(m / total for m in means)])
