"""Identity scores (Ristani et al. 2016): the one assignment of identities over the whole sequence."""

from __future__ import annotations

import numpy as np

from tracking.scoring.matching import match
from tracking.scoring.similarity import Pairs

THRESHOLD = 0.5


def identity(pairs: Pairs) -> dict[str, float]:
    """IDF1, IDP, IDR, IDTP: identities matched one to one so that they share most frames with similarity >= 0.5.

    An identity left alone costs its frames, two matched ones those that they do not share: the cheapest assignment is
    the matching with most shared frames, IDTP.
    """
    true_id, est_id, link = pairs.links
    frames = np.bincount(link[pairs.s >= THRESHOLD], minlength=len(true_id)).astype(float)
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
