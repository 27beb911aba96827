"""GOSPA: a distance between a set of true and a set of estimated positions, with its three parts.

Rahmathullah, García-Fernández & Svensson (2017), "Generalized optimal sub-pattern assignment metric", definition 1 with
alpha = 2 in the form of proposition 1. For true positions x and estimated positions y of one frame, minimised over all
one-to-one assignments theta of some x to some y:

    d(x, y)^p = min over theta of  sum over (i, j) in theta of |x_i - y_j|^p  +  c^p / 2 (|x| + |y| - 2 |theta|)

c is the cut-off distance, p the exponent; |x|, |y| and |theta| are the numbers of positions and of assigned pairs. A
pair farther apart than c counts as one missed person and one false track. The parts are localisation (the sum over
pairs), missed (c^p / 2 per missed person) and false (c^p / 2 per false track).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.scoring.candidate_pairs import Pairs
from tracking.scoring.matching import match

POWER = 2.0


def gospa(pairs: Pairs, cutoff: float, frames: int, power: float = POWER) -> dict[str, float]:
    """Returns GOSPA and its parts by key, in the unit of `cutoff`: p-th roots of means over `frames` frames, nan
    without.

    pairs: from `point_pairs` with reach = cutoff.
    """
    if frames == 0:
        return dict.fromkeys(("GOSPA", "GOSPA_localisation", "GOSPA_missed", "GOSPA_false"), float("nan"))
    parts = gospa_parts(pairs, cutoff, power).sum(axis=0) / frames
    whole, localisation, missed, false = (float(v ** (1 / power)) for v in (parts.sum(), *parts))
    return {"GOSPA": whole, "GOSPA_localisation": localisation, "GOSPA_missed": missed, "GOSPA_false": false}


def gospa_parts(pairs: Pairs, cutoff: float, power: float = POWER) -> Array:
    """Returns localisation, missed and false parts of d^p for each frame number 0 … last, (last + 1, 3)."""
    end = 1 + max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=-1)
    cost = (cutoff * (1 - pairs.s)) ** power
    frame = pairs.frame
    chosen = match(frame, pairs.i, pairs.j, cutoff**power - cost)
    n, m, hits = (np.bincount(f, minlength=end) for f in (pairs.true.frame, pairs.est.frame, frame[chosen]))
    near = np.bincount(frame[chosen], weights=cost[chosen], minlength=end)
    half = cutoff**power / 2
    return np.column_stack([near, half * (n - hits), half * (m - hits)])
