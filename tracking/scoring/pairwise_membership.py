"""Pairwise membership: which two people of a frame are in one group, whatever the groups are called or shaped."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.groups import group_of
from tracking.scoring.rows import Crowd
from tracking.scoring.similarity import Rows, compare


def pairwise_scores(true: Crowd, est: Crowd, stands_for: Ints) -> dict[str, float]:
    """F1, precision, recall of pairs, those of all frames together.

    stands_for: the true person's row of each of est's members, -1 unmapped: such pairs are false, and those of a true
    person whom nobody stands for are missed.
    """
    there = _pairs_in(true)
    group = group_of(true, int(max(true.who.max(initial=-1), stands_for.max(initial=-1))) + 1)
    order = np.argsort(est.of, kind="stable")
    person = stands_for[order]
    inside = Rows(est.of[order], order)  # what lies in one "frame" here is in one group

    def ordered(a: Ints, b: Ints) -> tuple[Ints, Array]:
        kept = np.flatnonzero((person[a] >= 0) & (person[a] < person[b]))
        return kept, np.ones(len(kept))

    both = compare(inside, inside, ordered)
    pairs = np.stack([person[both.i], person[both.j]])
    distinct = np.unique(pairs, axis=1)  # groups without members may overlap: a pair inside both is one pair
    said = _pairs_in(est) - (pairs.shape[1] - distinct.shape[1])
    p, q = distinct
    hits = int(((group[p] >= 0) & (group[p] == group[q])).sum())
    return {
        "pairwise_F1": 2 * hits / (there + said) if there + said else float("nan"),
        "pairwise_precision": hits / said if said else float("nan"),
        "pairwise_recall": hits / there if there else float("nan"),
    }


def _pairs_in(groups: Crowd) -> int:
    n = groups.count
    return int((n * (n - 1) // 2).sum())
