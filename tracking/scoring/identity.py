"""Identity scores IDF1, IDP, IDR and IDTP: ids are assigned one to one for the whole sequence.

Ristani et al. (2016), "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking". IDTP is the number
of frames that assigned true and estimated ids share with a similarity of 0.5 or more; IDP is its share in the estimated
rows (one row per person and frame), IDR its share in the true rows, IDF1 the harmonic mean of both. Equal to TrackEval.
"""

from __future__ import annotations

import numpy as np

from tracking.scoring.candidate_pairs import FOUND, Pairs
from tracking.scoring.matching import match


def identity(pairs: Pairs) -> dict[str, float]:
    """Returns a dict of IDF1, IDP, IDR and IDTP."""
    true_id, est_id, link = pairs.links
    frames = np.bincount(link[pairs.s >= FOUND], minlength=len(true_id)).astype(float)
    some = frames > 0
    true_id, est_id, frames = true_id[some], est_id[some], frames[some]
    found = float(frames[match(np.zeros_like(true_id), true_id, est_id, frames)].sum())
    n, m = len(pairs.true), len(pairs.est)
    return {
        "IDF1": 2 * found / max(1, n + m),
        "IDP": found / max(1, m),
        "IDR": found / max(1, n),
        "IDTP": found,
    }
