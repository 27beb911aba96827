"""Errors of positions and velocities: RMSE of mapped people, GOSPA.

RMSE, the root mean square error, counts only people of the tracker that are mapped (matched one to one) to true people.
It rewards a tracker that drops difficult people. So read it together with GOSPA.

Rahmathullah, García-Fernández & Svensson (2017), "Generalized optimal sub-pattern assignment metric", definition 1 with
alpha = 2 in the form of proposition 1. For true positions x and estimated positions y of one frame, minimised over all
one-to-one assignments theta of some x to some y:

    d(x, y)^p = min over theta of  sum over (i, j) in theta of |x_i - y_j|^p  +  c^p / 2 (|x| + |y| - 2 |theta|)

c is the cut-off distance, p the exponent; |x|, |y| and |theta| are the numbers of positions and of assigned pairs. A
pair farther apart than c counts as one missed person and one false track. The parts are localisation (the sum over
pairs), missed (c^p / 2 per missed person) and false (c^p / 2 per false track).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from sim.types import Array
from tracking.scoring.frame_weights import FrameScores, WeightedScores
from tracking.scoring.matching import match
from tracking.scoring.people import ComparedSides
from tracking.scoring.similarity import REACH, Pairs, point_pairs

POWER = 2.0
PARTS = ("GOSPA_localisation", "GOSPA_missed", "GOSPA_false")


def weighted_positions(sides: ComparedSides) -> WeightedScores:
    """Returns a function from weights (D, size) of frames to RMSE_pos, RMSE_vel, GOSPA and its parts, (D,) by key.

    The function returns {} if a side has no positions on the surface of comparison, or the image scale is unknown.
    RMSE_vel is nan in the image, or without velocities.
    """
    true, est = sides.true, sides.est
    true_pos, est_pos = true.positions_on(sides.surface, "ground"), est.positions_on(sides.surface, sides.plane)
    if true_pos is None or est_pos is None or not 0 < sides.scale < np.inf:
        return lambda weights: {}
    scores, reach = FrameScores(len(sides.inside)), REACH * sides.scale
    j = np.flatnonzero(sides.mapping >= 0)
    i = sides.mapping[j]
    off = np.full((len(i), 2), np.nan)
    if sides.surface == "ground" and true.vel is not None and est.vel is not None:
        off = est.vel[j] - true.vel[i]
    for key, error in (("RMSE_pos", est_pos[j] - true_pos[i]), ("RMSE_vel", off)):
        squares = np.square(error).sum(axis=1)
        scores.add_mean(key, true.rows.frame[i], squares, float(squares[np.isfinite(squares)].sum()))
    parts = gospa_parts(point_pairs(true.rows, est.rows, true_pos, est_pos, reach), reach)
    frames = sides.inside.astype(float)
    for name, values, total in zip(PARTS, parts.T, parts.sum(axis=0).tolist(), strict=True):
        scores.add_ratio(name, scores.column(np.arange(len(parts)), values), frames, total=total)
    scores.add_further(lambda found, *_: {key: np.sqrt(found[key]) for key in ("RMSE_pos", "RMSE_vel")})
    scores.add_further(lambda found, *_: gospa_of(found))
    return scores


def gospa_of(means: Mapping[str, Array], power: float = POWER) -> dict[str, Array]:
    """Returns GOSPA and its parts by key, (D,) each: the p-th roots of means over frames. means: by the names of
    `PARTS`, the mean over frames of each part of d^p, (D,). power: p."""
    localisation, missed, false = parts = [means[name] for name in PARTS]
    powers = {**dict(zip(PARTS, parts, strict=True)), "GOSPA": localisation + missed + false}
    # float by float: numpy takes another root of arrays, which differs in the last bit
    return {key: np.array([v ** (1 / power) for v in values.tolist()]) for key, values in powers.items()}


def gospa_parts(pairs: Pairs, cutoff: float, power: float = POWER) -> Array:
    """Returns the localisation, missed and false part of d^p for each frame number 0 … last, (last + 1, 3). pairs:
    their similarity must be 1 - distance / cutoff. power: p."""
    end = 1 + max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=-1)
    cost = (cutoff * (1 - pairs.s)) ** power
    frame = pairs.frame
    chosen = match(frame, pairs.i, pairs.j, cutoff**power - cost)
    n, m, hits = (np.bincount(f, minlength=end) for f in (pairs.true.frame, pairs.est.frame, frame[chosen]))
    near = np.bincount(frame[chosen], weights=cost[chosen], minlength=end)
    half = cutoff**power / 2
    return np.column_stack([near, half * (n - hits), half * (m - hits)])
