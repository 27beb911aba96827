"""The memory of beliefs: evidence that wavers round 0 does not change groups (ours)."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.grouping.belief import default_belief


def remembered(log_odds: Array, group: Ints, known: Array, share: float) -> Array:
    """Return the log-odds (K, K) of pairs, more for people who were in one group, and less for others."""
    belief = default_belief()
    same = (group[:, None] >= 0) & (group[:, None] == group)
    return np.asarray(log_odds + share * np.outer(known, known) * np.where(same, belief.stay, -belief.come))
