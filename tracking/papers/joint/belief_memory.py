"""The memory of beliefs: evidence that wavers round 0 does not change groups (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.grouping.belief import default_belief


def remembered(log_odds: Array, group: Ints, known: Array, share: float) -> Array:
    """Return the log-odds (K, K) of pairs, more for people who were in one group, and less for others.

    Added is `share` of the belief's `stay`, or taken of `come`, as the belief does in making groups: evidence that
    wavers round 0 does not change groups. log_odds (K, K); group (K,): of the last frame, -1 for alone; known (K,): 1.0
    for people reported then, 0.0 for new ones, whose pairs stay as they are.
    """
    belief = default_belief()
    same = (group[:, None] >= 0) & (group[:, None] == group)
    return np.asarray(log_odds + share * np.outer(known, known) * np.where(same, belief.stay, -belief.come))
