"""HOTA: detection and association accuracy at 19 similarity thresholds, equal to TrackEval.

Luiten et al. (2021), "HOTA: A Higher Order Metric for Evaluating Multi-object Tracking". One matching serves all
thresholds alpha. In each frame it maximises the sum of A(i, j) s(i, j), where s is the similarity of two rows and A the
alignment of their two ids over the sequence. Matches with s >= alpha count as true positives (TP). Other true rows are
false negatives (FN), other estimated rows false positives (FP). For a match c of true id i and estimated id j, TPA(c)
is the number of matches of these two ids, n_i and m_j their numbers of frames:

    DetA = TP / (TP + FN + FP),  AssA = mean over c of TPA(c) / (n_i + m_j - TPA(c)),  HOTA = sqrt(DetA AssA)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.frame_weights import WeightedScores, bin_sums, ratio
from tracking.scoring.matching import match_as_table
from tracking.scoring.similarity import EPS, Pairs

ALPHAS = np.arange(0.05, 0.99, 0.05)
BINS = len(ALPHAS) + 1  # numbers of thresholds at which a match can count
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
    found = Matches(pairs)
    frame, s, level, bins = found.frame, found.s, found.level, BINS
    true_rows = bin_sums(pairs.true.frame, pairs.true_ids[1], len(pairs.true_ids[0]), size)
    est_rows = bin_sums(pairs.est.frame, pairs.est_ids[1], len(pairs.est_ids[0]), size)
    met = bin_sums(frame, found.link * bins + level, len(found.true_id) * bins, size)
    # The sums of similarity at each threshold.
    near = np.column_stack([np.bincount(frame, np.where(level >= k, s, 0.0), size) for k in range(1, bins)])

    def sums(weights: Array) -> Array:
        rows = max(1, CELLS // max(1, len(found.true_id) * bins))
        parts = [of_part(weights[k : k + rows]) for k in range(0, len(weights), rows)]
        return np.concatenate([np.zeros((0, 7, len(ALPHAS))), *parts])

    def of_part(weights: Array) -> Array:
        similar = found.similar + (weights - 1) @ near
        return found.sums(true_rows(weights), est_rows(weights), met(weights), similar)

    return sums


def unweighted_hota(pairs: Pairs) -> float:
    """Returns HOTA if every frame has the weight 1, to the last bit as `weighted_hota` does. Its time does not
    depend on the length of the sequence."""
    found = Matches(pairs)
    n, m = (
        np.bincount(place, minlength=len(ids))[None].astype(float) for ids, place in (pairs.true_ids, pairs.est_ids)
    )
    met = np.bincount(found.link * BINS + found.level, minlength=len(found.true_id) * BINS)[None].astype(float)
    return float(hota_scores(found.sums(n, m, met, found.similar[None]))["HOTA"][0])


class Matches:
    """The matches of true and estimated rows, K of them, of U combinations of ids.

    State: frame, s, level (K,), frame number, similarity and number of thresholds, the lowest, at which a match counts;
    link (K,), its combination; true_id, est_id (U,), indices of the ids of each combination; similar (19,), sum of the
    similarities at each threshold.
    """

    def __init__(self, pairs: Pairs) -> None:
        true_id, est_id, link = pairs.links
        n = np.bincount(pairs.true_ids[1], minlength=len(pairs.true_ids[0]))[true_id]  # n_i of each link
        m = np.bincount(pairs.est_ids[1], minlength=len(pairs.est_ids[0]))[est_id]
        chosen = match_as_table(pairs, alignment(pairs, n + m)[link] * pairs.s)
        self.frame, self.s = pairs.frame[chosen], pairs.s[chosen]
        self.level = np.searchsorted(ALPHAS - EPS, self.s, side="right")
        used, self.link = np.unique(link[chosen], return_inverse=True)
        self.true_id, self.est_id = true_id[used], est_id[used]
        self.similar = _reached(np.bincount(self.level, weights=self.s, minlength=BINS).astype(float))

    def sums(self, n: Array, m: Array, met: Array, similar: Array) -> Array:
        """Returns the sums (D, 7, 19) of `hota_sums` from the weighted numbers of rows of each true id (D, N), of each
        estimated id (D, M), and of matches by combination and level (D, U * 20), and the similarities (D, 19)."""
        together = _reached(met.reshape(len(met), len(self.true_id), BINS))  # (D, U, 19): matches of each link
        own, other = n[:, self.true_id, None], m[:, self.est_id, None]
        ass = [_share(together * together, of).sum(axis=1) for of in (own + other - together, own, other)]
        rows = np.broadcast_arrays(n.sum(axis=1)[:, None], m.sum(axis=1)[:, None], similar)
        return np.stack([together.sum(axis=1), *rows[:2], *ass, similar], axis=1)


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
