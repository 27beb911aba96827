"""GOSPA: the error of a set of places against another, with its parts: how far off, how many missed, how many false.

Rahmathullah, García-Fernández & Svensson (2017), "Generalized optimal sub-pattern assignment metric", definition 1 with
alpha = 2, as proposition 1 writes it: between true places x and estimated y of one frame, over all assignments theta of
some of x to some of y, one to one,

    d(x, y)^p = min over theta of  sum over (i, j) in theta of |x_i - y_j|^p  +  c^p / 2 (|x| + |y| - 2 |theta|)

c is the distance from which somebody counts as missed and a track as false rather than as one pair far apart. The three
parts are the sum over pairs, c^p / 2 for each missed and c^p / 2 for each false.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array
from tracking.scoring.matching import match
from tracking.scoring.similarity import Pairs

POWER = 2.0


def gospa(pairs: Pairs, cutoff: float, frames: int, power: float = POWER) -> dict[str, float]:
    """GOSPA over `frames` frames, those with nobody on either side among them, and its parts, in the unit of cutoff.

    pairs: by place (point_pairs) with reach = cutoff. Power mean over frames, so that GOSPA^p = localisation^p +
    missed^p + false^p; with p = 2 the RMS GOSPA. nan where there are no frames.
    """
    if frames == 0:
        return dict.fromkeys(("GOSPA", "GOSPA_localisation", "GOSPA_missed", "GOSPA_false"), float("nan"))
    parts = gospa_parts(pairs, cutoff, power).sum(axis=0) / frames
    whole, localisation, missed, false = (float(v ** (1 / power)) for v in (parts.sum(), *parts))
    return {"GOSPA": whole, "GOSPA_localisation": localisation, "GOSPA_missed": missed, "GOSPA_false": false}


def gospa_parts(pairs: Pairs, cutoff: float, power: float = POWER) -> Array:
    """d^p of each frame number 0 … last as its parts, (F, 3): localisation, missed, false. pairs as for `gospa`."""
    end = 1 + max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=-1)
    cost = (cutoff * (1 - pairs.s)) ** power
    frame = pairs.frame
    chosen = match(frame, pairs.i, pairs.j, cutoff**power - cost)
    n, m, hits = (np.bincount(f, minlength=end) for f in (pairs.true.frame, pairs.est.frame, frame[chosen]))
    near = np.bincount(frame[chosen], weights=cost[chosen], minlength=end)
    half = cutoff**power / 2
    return np.column_stack([near, half * (n - hits), half * (m - hits)])
