"""CLEAR MOT scores (MOTA, MOTP, switches, fragments) at similarity 0.5, equal to TrackEval.

Bernardin & Stiefelhagen (2008), "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics". Matches of
the previous frame are kept. The previous frame is the last one with people on both sides.

TrackEval adds a bonus of 1000 to pairs that were matched in the previous frame and takes the matching with the greatest
total. Such kept pairs share no row and no column, and each outweighs any two rivals of at most 1. They are therefore in
every best matching (tracking.scoring.matching), and only pairs that share nothing with them remain to be matched. Pairs
without rivals are matched whatever happened before. Frames are processed in order, but few need a solver.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sim.types import Bools, Ints
from tracking.scoring.frame_weights import FrameScores, WeightedScores
from tracking.scoring.matching import solve_frame, solve_rest
from tracking.scoring.similarity import EPS, FOUND, Pairs

BONUS = 1000.0  # added to the weight of a pair that was matched in the previous frame
# A person matched in more than 80 % of its frames is mostly tracked, in less than 20 % mostly lost.
MOSTLY, LOST = 0.8, 0.2


def weighted_clear(pairs: Pairs, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to MOTA, MOTP, TP, FN, FP, IDSW, MT, PT, ML, Frag, (D,) by key.

    The matches do not depend on the weights, nor does who is in MT, PT or ML. These three are numbers of people: a
    person with n frames counts 1 / n times the weight in each of them.
    """
    near, turn = clear_matches(pairs), turns(pairs)
    who = near.true_ids[1][near.i]
    share = np.bincount(who, minlength=len(pairs.true_ids[0])) / np.bincount(pairs.true_ids[1])
    order = np.argsort(who, kind="stable")
    who, by, frame = who[order], near.est_ids[1][near.j][order], near.frame[order]
    same, when = who[1:] == who[:-1], turn[frame]
    scores = FrameScores(size)
    n, m, hits = (scores.column(frames) for frames in (pairs.true.frame, pairs.est.frame, near.frame))
    switches = scores.column(frame[1:][same & (by[1:] != by[:-1])])
    pauses = scores.column(frame[1:][same & (when[1:] > when[:-1] + 1)])  # matched again after a pause
    scores.add_ratio("MOTA", hits - (m - hits) - switches, n, 0.0)
    scores.add_ratio("MOTP", scores.column(near.frame, near.s), hits, 0.0, float(near.s.sum()))
    for key, column in {"TP": hits, "FN": n - hits, "FP": m - hits, "IDSW": switches, "Frag": pauses}.items():
        scores.add(key, column)
    who = pairs.true_ids[1]
    part = 1 / np.bincount(who)[who]
    kinds = {"MT": share > MOSTLY, "PT": (share >= LOST) & (share <= MOSTLY), "ML": share < LOST}
    for key, inside in kinds.items():
        scores.add(key, scores.column(pairs.true.frame, part * inside[who]), float(inside.sum()))
    return scores


def clear_matches(pairs: Pairs) -> Pairs:
    """Returns the pairs that CLEAR matches, of similarity 0.5 or more; no id may be twice in a frame of a side."""
    near = pairs.keep(pairs.s >= FOUND - EPS)
    return near.keep(follow(near, turns(pairs)))


def turns(pairs: Pairs) -> Ints:
    """Returns for each frame number 0 … last how many frames up to it have rows on both sides, (last + 1,)."""
    true, est = (np.bincount(rows.frame, minlength=pairs.size) > 0 for rows in (pairs.true, pairs.est))
    return np.cumsum(true & est)


def follow(near: Pairs, turn: Ints) -> Bools:
    """Returns which of the K pairs of `near` are matched, (K,) bool, where matches of the previous frame are kept."""
    i, j, frame = near.i, near.j, near.frame
    before = _before(near.links[2], turn[frame])
    chosen = np.zeros(len(i) + 1, bool)  # the last element stands for "no previous pair"
    chosen[:-1] = (np.bincount(i)[i] == 1) & (np.bincount(j)[j] == 1)
    taken_i, taken_j = np.zeros(len(near.true), bool), np.zeros(len(near.est), bool)
    rivals = np.flatnonzero(~chosen[:-1])
    cuts = np.flatnonzero(np.diff(frame[rivals], prepend=-1, append=-1))
    for a, b in pairwise(cuts.tolist()):
        places = rivals[a:b]
        kept = places[chosen[before[places]]]
        if len(kept):
            chosen[kept] = taken_i[i[kept]] = taken_j[j[kept]] = True
            places = places[~(taken_i[i[places]] | taken_j[j[places]])]
        if len(places) > 1:
            found = solve_rest(i[places], j[places], near.s[places])
            if found is not None:
                chosen[places] = found
                continue
            whole = slice(*np.searchsorted(frame, (frame[places[0]], frame[places[0]] + 1)))
            chosen[whole] = solve_frame(near, whole, near.s[whole] + BONUS * chosen[before[whole]])
        else:
            chosen[places] = True
    return chosen[:-1]


def _before(link: Ints, turn: Ints) -> Ints:
    """Returns for each of K pairs the index of the pair of the same two ids one turn earlier, K if there is none."""
    order = np.argsort(link, kind="stable")
    follows = (np.diff(link[order]) == 0) & (np.diff(turn[order]) == 1)
    before = np.full(len(link), len(link))
    before[order[1:][follows]] = order[:-1][follows]
    return before
