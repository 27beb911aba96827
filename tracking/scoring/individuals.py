"""Scores of individuals: HOTA (Luiten 2021), CLEAR (Bernardin 2008), Identity (Ristani 2016), as TrackEval has them.

Input is one similarity matrix per frame and the ids of both sides; any similarity in [0, 1] will do.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

from sim.types import Array, Ints

ALPHAS = np.arange(0.05, 0.99, 0.05)
THRESHOLD = 0.5
EPS = float(np.finfo(float).eps)


def scores(true: Sequence[Ints], est: Sequence[Ints], similarity: Sequence[Array]) -> dict[str, float]:
    """All three families; true[t] (N,), est[t] (M,) ids and similarity[t] (N, M) of each frame."""
    true_ids, true = _numbered(true)
    est_ids, est = _numbered(est)
    return {
        **hota(true, est, similarity, len(true_ids), len(est_ids)),
        **clear(true, est, similarity, len(true_ids)),
        **identity(true, est, similarity, len(true_ids), len(est_ids)),
    }


def _numbered(ids: Sequence[Ints]) -> tuple[Ints, list[Ints]]:
    counts = [len(i) for i in ids]
    known, index = np.unique(np.concatenate([*ids, np.zeros(0, np.int64)]), return_inverse=True)
    return known, np.split(index.astype(np.int64), np.cumsum(counts)[:-1]) if counts else []


def hota(true: Sequence[Ints], est: Sequence[Ints], similarity: Sequence[Array], n: int, m: int) -> dict[str, float]:
    """HOTA, DetA, AssA, LocA: means over 19 thresholds; 0 where nothing can match, as TrackEval."""
    together, n_count, m_count = np.zeros((n, m)), np.zeros(n), np.zeros(m)
    for i, j, s in zip(true, est, similarity, strict=True):
        total = s.sum(0)[None] + s.sum(1)[:, None] - s
        together[i[:, None], j[None]] += np.where(total > EPS, s / np.maximum(total, EPS), 0)
        n_count[i] += 1
        m_count[j] += 1
    aligned = together / np.maximum(n_count[:, None] + m_count[None] - together, EPS)
    matches = np.zeros((len(ALPHAS), n, m))
    found, similar = np.zeros(len(ALPHAS)), np.zeros(len(ALPHAS))
    for i, j, s in zip(true, est, similarity, strict=True):
        rows, columns = linear_sum_assignment(aligned[i[:, None], j[None]] * s, maximize=True)
        value = s[rows, columns]
        for a, alpha in enumerate(ALPHAS):
            good = value >= alpha - EPS
            found[a] += good.sum()
            similar[a] += value[good].sum()
            matches[a, i[rows[good]], j[columns[good]]] += 1
    pairs = matches / np.maximum(1, n_count[None, :, None] + m_count[None, None] - matches)
    ass = (matches * pairs).sum((1, 2)) / np.maximum(1, found)
    det = found / np.maximum(1, n_count.sum() + m_count.sum() - found)
    local = np.where(found > 0, similar / np.maximum(1e-10, found), 1.0)
    both = np.sqrt(det * ass)
    return {
        "HOTA": float(both.mean()),
        "DetA": float(det.mean()),
        "AssA": float(ass.mean()),
        "LocA": float(local.mean()),
    }


def clear(true: Sequence[Ints], est: Sequence[Ints], similarity: Sequence[Array], n: int) -> dict[str, float]:
    """MOTA, MOTP and counts at a similarity of 0.5; matches of the frame before are kept while they can be."""
    last, before = np.full(n, -1), np.full(n, -1)
    hits = misses = false = switches = 0
    total = 0.0
    for i, j, s in zip(true, est, similarity, strict=True):
        if s.size == 0:  # TrackEval remembers the matches before an empty frame
            misses, false = misses + len(i), false + len(j)
            continue
        weight = np.where(before[i][:, None] == j[None], 1000.0, 0.0) + s
        weight[s < THRESHOLD - EPS] = 0
        rows, columns = linear_sum_assignment(weight, maximize=True)
        good = weight[rows, columns] > EPS
        rows, columns = rows[good], columns[good]
        who, by = i[rows], j[columns]
        switches += int(((last[who] >= 0) & (last[who] != by)).sum())
        before[:] = -1
        last[who], before[who] = by, by
        hits, total = hits + len(rows), total + float(s[rows, columns].sum())
        misses, false = misses + len(i) - len(rows), false + len(j) - len(rows)
    labelled = hits + misses
    return {
        "MOTA": (hits - false - switches) / max(1.0, labelled),
        "MOTP": total / max(1.0, hits),
        "TP": float(hits),
        "FN": float(misses),
        "FP": float(false),
        "IDSW": float(switches),
    }


def identity(
    true: Sequence[Ints], est: Sequence[Ints], similarity: Sequence[Array], n: int, m: int
) -> dict[str, float]:
    """IDF1, IDP, IDR: the one assignment of identities over the whole sequence that explains most frames."""
    together, n_count, m_count = np.zeros((n, m)), np.zeros(n), np.zeros(m)
    for i, j, s in zip(true, est, similarity, strict=True):
        a, b = np.nonzero(s >= THRESHOLD)
        together[i[a], j[b]] += 1
        n_count[i] += 1
        m_count[j] += 1
    miss, false = np.full((n + m, n + m), 0.0), np.full((n + m, n + m), 0.0)
    miss[n:, :m], false[:n, m:] = 1e10, 1e10
    miss[:n, :m], false[:n, :m] = n_count[:, None] - together, m_count[None] - together
    miss[np.arange(n), m + np.arange(n)] = n_count
    false[n + np.arange(m), np.arange(m)] = m_count
    miss[:n, m:] = np.where(np.eye(n, dtype=bool), miss[:n, m:], 1e10)
    false[n:, :m] = np.where(np.eye(m, dtype=bool), false[n:, :m], 1e10)
    miss[n:, :m], false[:n, m:] = 0.0, 0.0
    rows, columns = linear_sum_assignment(miss + false)
    fn, fp = miss[rows, columns].sum(), false[rows, columns].sum()
    tp = n_count.sum() - fn
    return {
        "IDF1": float(tp / max(1.0, tp + 0.5 * (fp + fn))),
        "IDP": float(tp / max(1.0, tp + fp)),
        "IDR": float(tp / max(1.0, tp + fn)),
    }
