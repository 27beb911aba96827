"""Identity scores IDF1, IDP, IDR and IDTP: ids are assigned one to one for the whole sequence.

Ristani et al. (2016), "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking". IDTP is the number
of frames that assigned true and estimated ids share with a similarity of 0.5 or more; IDP is its share in the estimated
rows (one row per person and frame), IDR its share in the true rows, IDF1 the harmonic mean of both. Equal to TrackEval.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.scoring.candidate_pairs import FOUND, Pairs
from tracking.scoring.matching import match
from tracking.scoring.weighted_sums import BinSums, FrameSums, WeightedScores, ratio


def weighted_identity(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the weighted IDF1, IDP, IDR and IDTP; ids are assigned anew for each draw of weights."""
    near = pairs.s >= FOUND
    true_id, est_id, link = pairs.links
    common = BinSums(pairs.frame[near], link[near], len(true_id), size)
    sums = FrameSums(size)
    sums.add("true", pairs.true.frame)
    sums.add("est", pairs.est.frame)

    def assigned(frames: Array) -> float:
        some = frames > 0
        i, j, weight = true_id[some], est_id[some], frames[some]
        return float(weight[match(np.zeros_like(i), i, j, weight)].sum())

    def score(weights: Array) -> dict[str, Array]:
        s, found = sums.of(weights), np.array([assigned(frames) for frames in common.of(weights)])
        n, m = s["true"], s["est"]
        return {
            "IDF1": ratio(2 * found, n + m, 0.0), "IDP": ratio(found, m, 0.0), "IDR": ratio(found, n, 0.0),
            "IDTP": found,
        }  # fmt: skip

    return score
