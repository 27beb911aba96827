"""CLEAR (Bernardin & Stiefelhagen 2008): misses, false ones and switches at a similarity of 0.5, as TrackEval has them.

TrackEval gives a pair that was matched in the frame before a bonus of 1000 and takes the matching of greatest total.
Kept pairs share no row and no column (they were matched) and outweigh any two rivals (at most 1 each), so all of them
are in every best matching (tracking.scoring.matching); what remains to be matched is the pairs that share nothing with
them. Pairs without rivals are matched whatever was before. So frames are followed one by one, but cheaply: few have
anything left to solve. The frame before is the last one with somebody on both sides.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sim.types import Bools, Ints
from tracking.scoring.matching import solve_frame
from tracking.scoring.similarity import EPS, Pairs

THRESHOLD = 0.5
BONUS = 1000.0  # of a pair that was matched in the frame before
MOSTLY, LOST = 0.8, 0.2
"""Shares of its frames above which a person is mostly tracked, below which mostly lost."""


def clear(pairs: Pairs) -> dict[str, float]:
    """MOTA, MOTP, TP, FN, FP, IDSW, MT, PT, ML (people), Frag; MOTA is 0 where there is nobody true, or no answer."""
    near = pairs.keep(pairs.s >= THRESHOLD - EPS)
    turn = turns(pairs)
    near = near.keep(follow(near, turn))
    who, by, when = near.true_ids[1][near.i], near.est_ids[1][near.j], turn[near.frame]
    order = np.argsort(who, kind="stable")
    who, by, when = who[order], by[order], when[order]
    same = who[1:] == who[:-1]
    n, m, hits = len(pairs.true), len(pairs.est), len(who)
    switches = int((same & (by[1:] != by[:-1])).sum())
    share = np.bincount(who, minlength=len(pairs.true_ids[0])) / np.bincount(pairs.true_ids[1])
    mostly, tracked = int((share > MOSTLY).sum()), int((share >= LOST).sum())
    return {
        "MOTA": (hits - (m - hits) - switches) / n if n and m else 0.0,
        "MOTP": float(near.s.sum()) / max(1, hits),
        "TP": float(hits),
        "FN": float(n - hits),
        "FP": float(m - hits),
        "IDSW": float(switches),
        "MT": float(mostly),
        "PT": float(tracked - mostly),
        "ML": float(len(share) - tracked),
        "Frag": float((same & (when[1:] > when[:-1] + 1)).sum()),
    }


def turns(pairs: Pairs) -> Ints:
    """For each frame number how many frames up to it have somebody on both sides."""
    end = 1 + max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=0)
    true, est = (np.bincount(rows.frame, minlength=end) > 0 for rows in (pairs.true, pairs.est))
    return np.cumsum(true & est)


def follow(near: Pairs, turn: Ints) -> Bools:
    """Which of the pairs (K,), all of them similar enough, are matched when matches of the frame before are kept."""
    i, j, frame = near.i, near.j, near.frame
    before = _before(near.links[2], turn[frame])
    chosen = np.zeros(len(i) + 1, bool)  # one more, which those point at that have nothing before
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
            start, end = np.searchsorted(frame, (frame[places[0]], frame[places[0]] + 1)).tolist()
            weight = near.s[start:end] + BONUS * chosen[before[start:end]]
            chosen[start:end] = solve_frame(near, start, end, weight)
        else:
            chosen[places] = True
    return chosen[:-1]


def _before(link: Ints, turn: Ints) -> Ints:
    """For each pair (K,) the place of the one of the same two identities a turn before, or K."""
    order = np.argsort(link, kind="stable")
    follows = (np.diff(link[order]) == 0) & (np.diff(turn[order]) == 1)
    before = np.full(len(link), len(link))
    before[order[1:][follows]] = order[:-1][follows]
    return before
