"""Who each estimated person is: the true person it stands for in a frame, if any."""

from __future__ import annotations

import numpy as np

from sim.types import Ints
from tracking.scoring.matching import match
from tracking.scoring.similarity import EPS, Pairs

LEAST = 0.5
"""Similarity from which somebody counts as found: 1 m apart on the ground, half the union of two boxes."""


def mapped(pairs: Pairs, least: float = LEAST) -> Ints:
    """For each row of pairs.est the row of pairs.true, or -1: the one-to-one matching of each frame with the greatest
    total similarity among the pairs of at least `least`."""
    near = pairs.keep(pairs.s >= least - EPS)
    chosen = match(near.true.frame[near.i], near.i, near.j, near.s)
    found = np.full(len(pairs.est), -1, np.int64)
    found[near.j[chosen]] = near.i[chosen]
    return found
