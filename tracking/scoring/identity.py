"""Identity scores IDF1, IDP, IDR and IDTP: ids are assigned one to one for the whole sequence, equal to TrackEval.

Ristani et al. (2016), "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking". IDTP is the number
of frames that assigned true and estimated ids share with a similarity of 0.5 or more; IDP is its share in the estimated
rows (one row per person and frame), IDR its share in the true rows, IDF1 the harmonic mean of both.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.scoring.frame_weights import WeightedScores, bin_sums, ratio
from tracking.scoring.matching import match
from tracking.scoring.similarity import FOUND, Pairs


def weighted_identity(pairs: Pairs, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to IDF1, IDP, IDR and IDTP, (D,) by key. True and estimated ids are
    assigned to each other anew for each of the D draws."""
    near = pairs.s >= FOUND
    true_id, est_id, link = pairs.links
    common = bin_sums(pairs.frame[near], link[near], len(true_id), size)
    true, est = (np.bincount(rows.frame, minlength=size).astype(float) for rows in (pairs.true, pairs.est))

    def assigned(frames: Array) -> float:
        some = frames > 0
        i, j, weight = true_id[some], est_id[some], frames[some]
        return float(weight[match(np.zeros_like(i), i, j, weight)].sum())

    def score(weights: Array) -> dict[str, Array]:
        n, m, found = weights @ true, weights @ est, np.array([assigned(frames) for frames in common(weights)])
        return {
            "IDF1": ratio(2 * found, n + m, 0.0), "IDP": ratio(found, m, 0.0), "IDR": ratio(found, n, 0.0),
            "IDTP": found,
        }  # fmt: skip

    return score
