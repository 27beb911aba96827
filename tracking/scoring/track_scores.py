"""HOTA: detection and association accuracy at 19 similarity thresholds, equal to TrackEval.

Luiten et al. (2021), "HOTA: A Higher Order Metric for Evaluating Multi-object Tracking". One matching serves all
thresholds alpha. In each frame it maximises the sum of A(i, j) s(i, j), where s is the similarity of two rows and A the
alignment of their two ids over the sequence. Matches with s >= alpha count as true positives (TP). Other true rows are
false negatives (FN), other estimated rows false positives (FP). For a match c of true id i and estimated id j, TPA(c)
is the number of matches of these two ids, n_i and m_j their numbers of frames:

    DetA = TP / (TP + FN + FP),  AssA = mean over c of TPA(c) / (n_i + m_j - TPA(c)),  HOTA = sqrt(DetA AssA)

Also here: CLEAR MOT scores (MOTA, MOTP, switches, fragments) at similarity 0.5, equal to TrackEval.

Bernardin & Stiefelhagen (2008), "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics". Matches of
the previous frame are kept. The previous frame is the last one with people on both sides.

TrackEval adds a bonus of 1000 to pairs that were matched in the previous frame and takes the matching with the greatest
total. Such kept pairs share no row and no column, and each outweighs any two rivals of at most 1. They are therefore in
every best matching (tracking.scoring.matching), and only pairs that share nothing with them remain to be matched. Pairs
without rivals are matched whatever happened before. Frames are processed in order, but few need a solver.

Also here: identity scores IDF1, IDP, IDR and IDTP: ids are assigned one to one for the whole sequence.

Ristani et al. (2016), "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking". IDTP is the number
of frames that assigned true and estimated ids share with a similarity of 0.5 or more; IDP is its share in the estimated
rows (one row per person and frame), IDR its share in the true rows, IDF1 the harmonic mean of both. Equal to TrackEval.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import EPS, FOUND, Pairs
from tracking.scoring.matching import match, match_as_table, solve_frame, solve_rest
from tracking.scoring.weighted_sums import FrameScores, WeightedScores, bin_sums, ratio

ALPHAS = np.arange(0.05, 0.99, 0.05)
CELLS = 2_000_000  # numbers of matches held at once
LEAST = 1e-10  # keeps LocA at 1 where nothing is matched


def weighted_hota(pairs: Pairs, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to the scores of `hota_scores`, (D,) by key. Arguments as of
    `hota_sums`."""
    sums = hota_sums(pairs, size)
    return lambda weights: hota_scores(sums(weights))


def hota_sums(pairs: Pairs, size: int) -> Callable[[Array], Array]:
    """Returns a function from weights (D, size) to sums (D, 7, 19) at the thresholds `ALPHAS`, which `hota_scores`
    takes.

    The rows are TP, true rows, estimated rows, the sums over matches of AssA, AssRe and AssPr, and the sum of
    similarities. Sums of several sequences add up. One matching serves all thresholds and all weights: in each frame
    the one with the greatest sum of A(i, j) s(i, j)."""
    true_id, est_id, link = pairs.links
    n = np.bincount(pairs.true_ids[1], minlength=len(pairs.true_ids[0]))[true_id]  # n_i of each link
    m = np.bincount(pairs.est_ids[1], minlength=len(pairs.est_ids[0]))[est_id]
    chosen = match_as_table(pairs, alignment(pairs, n + m)[link] * pairs.s)
    frame, s, bins = pairs.frame[chosen], pairs.s[chosen], len(ALPHAS) + 1
    level = np.searchsorted(ALPHAS - EPS, s, side="right")  # number of thresholds, the lowest, at which a match counts
    used, link = np.unique(link[chosen], return_inverse=True)
    true_id, est_id = true_id[used], est_id[used]
    true_rows = bin_sums(pairs.true.frame, pairs.true_ids[1], len(pairs.true_ids[0]), size)
    est_rows = bin_sums(pairs.est.frame, pairs.est_ids[1], len(pairs.est_ids[0]), size)
    met = bin_sums(frame, link * bins + level, len(used) * bins, size)
    # The sums of similarity at each threshold.
    near = np.column_stack([np.bincount(frame, np.where(level >= k, s, 0.0), size) for k in range(1, bins)])
    total = _reached(np.bincount(level, weights=s, minlength=bins).astype(float))

    def sums(weights: Array) -> Array:
        rows = max(1, CELLS // max(1, len(used) * bins))
        parts = [of_part(weights[k : k + rows]) for k in range(0, len(weights), rows)]
        return np.concatenate([np.zeros((0, 7, len(ALPHAS))), *parts])

    def of_part(weights: Array) -> Array:
        n, m = true_rows(weights), est_rows(weights)
        together = _reached(met(weights).reshape(len(weights), len(used), bins))  # (D, U, 19): matches of each link
        similar = total + (weights - 1) @ near
        own, other = n[:, true_id, None], m[:, est_id, None]
        ass = [_share(together * together, of).sum(axis=1) for of in (own + other - together, own, other)]
        rows = np.broadcast_arrays(n.sum(axis=1)[:, None], m.sum(axis=1)[:, None], similar)
        return np.stack([together.sum(axis=1), *rows[:2], *ass, similar], axis=1)

    return sums


def _reached(by_level: Array) -> Array:
    """Returns sums at each threshold (…, 19) from those of the items that reach just so many (…, 20)."""
    return np.cumsum(by_level[..., :0:-1], axis=-1)[..., ::-1]


def hota_scores(sums: Array) -> dict[str, Array]:
    """Returns HOTA, DetA, AssA, DetRe, DetPr, AssRe, AssPr and LocA, (D,) by key, each the mean over `ALPHAS`. sums (D,
    7, 19): as of `hota_sums`."""
    found, true, est, *parts, similar = np.moveaxis(sums, 1, 0)
    det = _share(found, true + est - found)
    ass, ass_re, ass_pr = (_share(part, found) for part in parts)
    curves = {
        "HOTA": np.sqrt(det * ass), "DetA": det, "AssA": ass, "DetRe": _share(found, true), "DetPr": _share(found, est),
        "AssRe": ass_re, "AssPr": ass_pr, "LocA": np.maximum(LEAST, similar) / np.maximum(LEAST, found),
    }  # fmt: skip
    return {key: curve.mean(axis=1) for key, curve in curves.items()}


def _share(part: Array, whole: Array) -> Array:
    return ratio(part, np.broadcast_to(whole, part.shape), 0.0)


def alignment(pairs: Pairs, frames: Ints) -> Array:
    """Returns the alignment A in [0, 1] of each of the U combinations of ids in `pairs.links`, (U,). frames (U,):
    number of rows of the true id plus number of rows of the estimated id."""
    i, j, s = pairs.i, pairs.j, pairs.s
    of_i = np.bincount(i, weights=s, minlength=len(pairs.true))
    of_j = np.bincount(j, weights=s, minlength=len(pairs.est))
    common = np.bincount(pairs.links[2], weights=s / (of_i[i] + of_j[j] - s), minlength=len(frames))
    return np.asarray(common / (frames - common))


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


def weighted_identity(pairs: Pairs, size: int) -> WeightedScores:
    """Returns a function from weights (D, size) to IDF1, IDP, IDR and IDTP, (D,) by key. True and estimated ids are
    assigned to each other anew for each of the D draws."""
    near = pairs.s >= FOUND
    true_id, est_id, link = pairs.links
    common = bin_sums(pairs.frame[near], link[near], len(true_id), size)
    true, est = (np.bincount(rows.frame, minlength=size).astype(float) for rows in (pairs.true, pairs.est))

    def assigned(frames: Array) -> float:
        some = frames > 0
        i, j, weight = true_id[some], est_id[some], frames[some]
        return float(weight[match(np.zeros_like(i), i, j, weight)].sum())

    def score(weights: Array) -> dict[str, Array]:
        n, m, found = weights @ true, weights @ est, np.array([assigned(frames) for frames in common(weights)])
        return {
            "IDF1": ratio(2 * found, n + m, 0.0), "IDP": ratio(found, m, 0.0), "IDR": ratio(found, n, 0.0),
            "IDTP": found,
        }  # fmt: skip

    return score
