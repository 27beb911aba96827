"""CLEAR MOT scores (MOTA, MOTP, switches, fragments) at similarity 0.5, equal to TrackEval.

Bernardin & Stiefelhagen (2008), "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics". Matches of
the previous frame are kept. The previous frame is the last one with people on both sides.

TrackEval adds a bonus of 1000 to pairs that were matched in the previous frame and takes the matching with the greatest
total. Such kept pairs share no row and no column, and each outweighs any two rivals of at most 1. They are therefore in
every best matching (tracking.scoring.matching), and only pairs that share nothing with them remain to be matched. Pairs
without rivals are matched whatever happened before. Frames are processed in order, but few need a solver.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import EPS, FOUND, Pairs
from tracking.scoring.matching import solve_frame
from tracking.scoring.weighted_sums import FrameSums, WeightedScores, ratio

BONUS = 1000.0  # added to the weight of a pair that was matched in the previous frame
# A person matched in more than 80 % of its frames is mostly tracked, in less than 20 % mostly lost.
MOSTLY, LOST = 0.8, 0.2


@dataclass(frozen=True, slots=True, eq=False)
class ClearMatches:
    """The matches of CLEAR: `found`, the matched pairs of similarity 0.5 or more."""

    found: Pairs
    switched: Ints  # frame number of each identity switch, the frame of the later match
    resumed: Ints  # frame number of each match that follows a pause of its true id
    share: Array  # (N,): matched frames / frames of each of the N true ids, in the order of `Pairs.true_ids[0]`.


def clear_matches(pairs: Pairs) -> ClearMatches:
    """Returns the matches of CLEAR; pairs: candidate pairs of any similarity above 0, no id twice in a frame."""
    near = pairs.keep(pairs.s >= FOUND - EPS)
    turn = turns(pairs)
    near = near.keep(follow(near, turn))
    frame = near.frame
    who, by, when = near.true_ids[1][near.i], near.est_ids[1][near.j], turn[frame]
    share = np.bincount(who, minlength=len(pairs.true_ids[0])) / np.bincount(pairs.true_ids[1])
    order = np.argsort(who, kind="stable")
    who, by, when, frame = who[order], by[order], when[order], frame[order]
    same = who[1:] == who[:-1]
    switched, resumed = same & (by[1:] != by[:-1]), same & (when[1:] > when[:-1] + 1)
    return ClearMatches(near, frame[1:][switched], frame[1:][resumed], share)


def weighted_clear(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the weighted MOTA, MOTP, TP, FN, FP, IDSW, MT, PT, ML, Frag, with the matches kept.

    A switch and a resumed match have the weight of the later match. MT, PT and ML sum up the mean weights of their
    people's frames.
    """
    matches, sums = clear_matches(pairs), FrameSums(size)
    sums.add("true", pairs.true.frame)
    sums.add("est", pairs.est.frame)
    sums.add("TP", matches.found.frame)
    sums.add("similarity", matches.found.frame, matches.found.s, float(matches.found.s.sum()))
    sums.add("IDSW", matches.switched)
    sums.add("Frag", matches.resumed)
    who, share = pairs.true_ids[1], matches.share
    part = 1 / np.bincount(who)[who]
    kinds = {"MT": share > MOSTLY, "PT": (share >= LOST) & (share <= MOSTLY), "ML": share < LOST}
    for key, inside in kinds.items():
        sums.add(key, pairs.true.frame, part * inside[who], float(inside.sum()))

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        n, m, hits = s["true"], s["est"], s["TP"]
        quality = ratio(hits - (m - hits) - s["IDSW"], n, 0.0)
        return {
            "MOTA": np.where(m > 0, quality, 0.0), "MOTP": ratio(s["similarity"], hits, 0.0),
            "TP": hits, "FN": n - hits, "FP": m - hits,
            **{key: s[key] for key in ("IDSW", "MT", "PT", "ML", "Frag")},
        }  # fmt: skip

    return score


def turns(pairs: Pairs) -> Ints:
    """Returns for each frame number 0 … last how many frames up to it have rows on both sides, (last + 1,)."""
    end = 1 + max((int(rows.frame[-1]) for rows in (pairs.true, pairs.est) if len(rows)), default=0)
    true, est = (np.bincount(rows.frame, minlength=end) > 0 for rows in (pairs.true, pairs.est))
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
            start, end = np.searchsorted(frame, (frame[places[0]], frame[places[0]] + 1)).tolist()
            weight = near.s[start:end] + BONUS * chosen[before[start:end]]
            chosen[start:end] = solve_frame(near, start, end, weight)
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
