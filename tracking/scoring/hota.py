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

ALPHAS = np.arange(0.05, 0.99, 0.05)
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
    return {name: float(curve.mean()) for name, curve in curves(pairs).items()}


def curves(pairs: Pairs) -> dict[str, Array]:
    """Returns the eight scores of `hota` by key, (19,) each, over the similarity thresholds `ALPHAS`."""
    matches = hota_matches(pairs)
    n = np.bincount(pairs.true_ids[1], minlength=len(pairs.true_ids[0]))[matches.true_id]  # n_i of each link
    m = np.bincount(pairs.est_ids[1], minlength=len(pairs.est_ids[0]))[matches.est_id]
    s, link, level = matches.s, matches.link, matches.level
    bins = len(ALPHAS) + 1
    together = np.bincount(link * bins + level, minlength=len(n) * bins).reshape(-1, bins)
    together = np.cumsum(together[:, :0:-1], axis=1)[:, ::-1]  # matches of each link at each threshold
    found = together.sum(axis=0)
    near = np.cumsum(np.bincount(level, weights=s, minlength=bins)[:0:-1])[::-1]

    def mean_share(of: Ints) -> Array:
        return np.asarray((together * together / np.maximum(1, of)).sum(axis=0) / np.maximum(1, found))

    n, m = n[:, None], m[:, None]
    det = found / np.maximum(1, len(pairs.true) + len(pairs.est) - found)
    ass = mean_share(n + m - together)
    return {
        "HOTA": np.sqrt(det * ass),
        "DetA": det,
        "AssA": ass,
        "DetRe": found / max(1, len(pairs.true)),
        "DetPr": found / max(1, len(pairs.est)),
        "AssRe": mean_share(n),
        "AssPr": mean_share(m),
        "LocA": np.maximum(LEAST, near) / np.maximum(LEAST, found),
    }


def alignment(pairs: Pairs, frames: Ints) -> Array:
    """Returns the alignment A in [0, 1] of each of U links (U,); frames (U,): rows of the true id plus those of the
    other."""
    i, j, s = pairs.i, pairs.j, pairs.s
    of_i = np.bincount(i, weights=s, minlength=len(pairs.true))
    of_j = np.bincount(j, weights=s, minlength=len(pairs.est))
    common = np.bincount(pairs.links[2], weights=s / (of_i[i] + of_j[j] - s), minlength=len(frames))
    return np.asarray(common / (frames - common))
