"""HOTA: detection and association accuracy at 19 similarity thresholds, equal to TrackEval.

Luiten et al. (2021), "HOTA: A Higher Order Metric for Evaluating Multi-object Tracking". One matching serves all
thresholds alpha. In each frame it maximises the sum of A(i, j) s(i, j), where s is the similarity of two rows and A the
alignment of their two ids over the sequence. Matches with s >= alpha count as true positives (TP). Other true rows are
false negatives (FN), other estimated rows false positives (FP). For a match c of true id i and estimated id j, TPA(c)
is the number of matches of these two ids, n_i and m_j their numbers of frames:

    DetA = TP / (TP + FN + FP),  AssA = mean over c of TPA(c) / (n_i + m_j - TPA(c)),  HOTA = sqrt(DetA AssA)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.candidate_pairs import EPS, Pairs
from tracking.scoring.matching import match_as_table
from tracking.scoring.weighted_sums import BinSums, FrameSums, WeightedScores, ratio

ALPHAS = np.arange(0.05, 0.99, 0.05)
CELLS = 2_000_000  # numbers of matches held at once
LEAST = 1e-10  # keeps LocA at 1 where nothing is matched


@dataclass(frozen=True, slots=True, eq=False)
class HotaMatches:
    """The K matches of HOTA, and the U links, a link being a combination of a true and an estimated id."""

    # true_id, est_id (U,): the ids of each link, as indices into `Pairs.true_ids[0]` and `Pairs.est_ids[0]`.
    true_id: Ints
    est_id: Ints
    link: Ints  # (K,): link of each match
    frame: Ints  # (K,): its frame number
    s: Array  # (K,): its similarity
    level: Ints  # (K,): number of thresholds at which the match counts, 0 to 19; these are the lowest ones


def hota_matches(pairs: Pairs) -> HotaMatches:
    """Returns the matches that serve all thresholds: in each frame the greatest sum of A(i, j) s(i, j)."""
    true_id, est_id, link = pairs.links
    n = np.bincount(pairs.true_ids[1], minlength=len(pairs.true_ids[0]))[true_id]  # n_i of each link
    m = np.bincount(pairs.est_ids[1], minlength=len(pairs.est_ids[0]))[est_id]
    chosen = match_as_table(pairs, alignment(pairs, n + m)[link] * pairs.s)
    s = pairs.s[chosen]
    level = np.searchsorted(ALPHAS - EPS, s, side="right")
    return HotaMatches(true_id, est_id, link[chosen], pairs.frame[chosen], s, level)


def hota(pairs: Pairs) -> dict[str, float]:
    """Returns HOTA, DetA, AssA, DetRe, DetPr, AssRe, AssPr and LocA by key, each the mean over `ALPHAS`."""
    matches, bins = hota_matches(pairs), len(ALPHAS) + 1
    frames_of = (pairs.true_ids[1], matches.true_id), (pairs.est_ids[1], matches.est_id)
    n, m = (np.bincount(ids).astype(float)[of] for ids, of in frames_of)
    together = (
        np.bincount(matches.link * bins + matches.level, minlength=len(n) * bins).astype(float).reshape(1, -1, bins)
    )
    near: Array = np.bincount(matches.level, weights=matches.s, minlength=bins).astype(float)[None]
    rows = np.array([float(len(pairs.true))]), np.array([float(len(pairs.est))])
    return {key: float(value[0]) for key, value in _scores(_reached(together), _reached(near), n, m, *rows).items()}


def weighted_hota(pairs: Pairs, size: int) -> WeightedScores:
    """Returns the eight weighted scores of `hota`, with its matches kept."""
    matches, bins = hota_matches(pairs), len(ALPHAS) + 1
    used, link = np.unique(matches.link, return_inverse=True)
    true_id, est_id = matches.true_id[used], matches.est_id[used]
    true_rows = BinSums(pairs.true.frame, pairs.true_ids[1], len(pairs.true_ids[0]), size)
    est_rows = BinSums(pairs.est.frame, pairs.est_ids[1], len(pairs.est_ids[0]), size)
    met = BinSums(matches.frame, link * bins + matches.level, len(used) * bins, size)
    near = FrameSums(size)
    for k in range(1, bins):  # the sums of similarity at each threshold
        near.add(str(k), matches.frame, np.where(matches.level >= k, matches.s, 0.0))

    def score(weights: Array) -> dict[str, Array]:
        rows = max(1, CELLS // max(1, len(used) * bins))
        parts = [of_part(weights[k : k + rows]) for k in range(0, len(weights), rows)]
        return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]} if parts else {}

    def of_part(weights: Array) -> dict[str, Array]:
        n, m = true_rows.of(weights), est_rows.of(weights)
        together = _reached(met.of(weights).reshape(len(weights), len(used), bins))
        similar = np.column_stack(list(near.of(weights).values()))
        return _scores(together, similar, n[:, true_id], m[:, est_id], n.sum(axis=1), m.sum(axis=1))

    return score


def _reached(by_level: Array) -> Array:
    """Returns sums at each threshold (…, 19) from those of the items that reach just so many (…, 20)."""
    return np.cumsum(by_level[..., :0:-1], axis=-1)[..., ::-1]


def _scores(together: Array, near: Array, n: Array, m: Array, true: Array, est: Array) -> dict[str, Array]:
    """Returns the eight scores, (D,) by key.

    At each threshold: together (D, U, 19), matches of each link; near (D, 19), sum of similarities. n, m (D, U) or
    (U,): frames of the two ids of each link. true, est (D,): rows of both sides.
    """
    found = together.sum(axis=1)
    n, m, true, est = n[..., None], m[..., None], true[:, None], est[:, None]

    def share(part: Array, whole: Array) -> Array:
        return ratio(part, np.broadcast_to(whole, part.shape), 0.0)

    def mean_share(of: Array) -> Array:
        return share(share(together * together, of).sum(axis=1), found)

    det, ass = share(found, true + est - found), mean_share(n + m - together)
    curves = {
        "HOTA": np.sqrt(det * ass), "DetA": det, "AssA": ass, "DetRe": share(found, true), "DetPr": share(found, est),
        "AssRe": mean_share(n), "AssPr": mean_share(m),
        "LocA": np.maximum(LEAST, near) / np.maximum(LEAST, found),
    }  # fmt: skip
    return {key: curve.mean(axis=1) for key, curve in curves.items()}


def alignment(pairs: Pairs, frames: Ints) -> Array:
    """Returns the alignment A in [0, 1] of each of U links (U,); frames (U,): rows of its two ids together."""
    i, j, s = pairs.i, pairs.j, pairs.s
    of_i = np.bincount(i, weights=s, minlength=len(pairs.true))
    of_j = np.bincount(j, weights=s, minlength=len(pairs.est))
    common = np.bincount(pairs.links[2], weights=s / (of_i[i] + of_j[j] - s), minlength=len(frames))
    return np.asarray(common / (frames - common))
