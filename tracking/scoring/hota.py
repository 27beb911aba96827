"""HOTA (Luiten et al. 2021): detection and association at 19 thresholds of similarity, as TrackEval has them.

One matching serves all thresholds: in each frame the greatest sum of A(i, j) s(i, j), where A is how well two
identities align over the whole sequence. Of its pairs those with s >= alpha count. With TPA(c) the matches of the
identities of match c, AssA = mean over c of TPA / (n_i + m_j - TPA), DetA = TP / (TP + FN + FP),
HOTA = sqrt(DetA AssA).
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.matching import match_as_table
from tracking.scoring.similarity import EPS, Pairs

ALPHAS = np.arange(0.05, 0.99, 0.05)


def hota(pairs: Pairs) -> dict[str, float]:
    """HOTA, DetA, AssA, DetRe, DetPr, AssRe, AssPr, LocA: means over thresholds; LocA is 1 where nothing matches."""
    return {name: float(curve.mean()) for name, curve in curves(pairs).items()}


def curves(pairs: Pairs) -> dict[str, Array]:
    """The same at each of ALPHAS, (19,) each."""
    true_id, est_id, link = pairs.links
    n = np.bincount(pairs.true_ids[1], minlength=len(pairs.true_ids[0]))[true_id]  # frames of the ids of each link
    m = np.bincount(pairs.est_ids[1], minlength=len(pairs.est_ids[0]))[est_id]
    chosen = match_as_table(pairs, alignment(pairs, n + m)[link] * pairs.s)
    s, link = pairs.s[chosen], link[chosen]
    level = np.searchsorted(ALPHAS - EPS, s, side="right")  # of how many thresholds the match counts
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
        "LocA": np.maximum(1e-10, near) / np.maximum(1e-10, found),
    }


def alignment(pairs: Pairs, frames: Ints) -> Array:
    """How well the two identities of each link align over the sequence (U,): the Jaccard index of their frames, each
    common frame counted by s(i, j) / (sum of row i + sum of column j - s(i, j)). frames: n_i + m_j of each link."""
    i, j, s = pairs.i, pairs.j, pairs.s
    of_i = np.bincount(i, weights=s, minlength=len(pairs.true))
    of_j = np.bincount(j, weights=s, minlength=len(pairs.est))
    common = np.bincount(pairs.links[2], weights=s / (of_i[i] + of_j[j] - s), minlength=len(frames))
    return np.asarray(common / (frames - common))
