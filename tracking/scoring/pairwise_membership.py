"""Pairwise membership: F1 over pairs of people who are in one group, independent of group ids and shapes.

Estimated pairs are pairs of tracked people, mapped to true people; a pair is right if the two are in one true group.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.candidate_pairs import compare
from tracking.scoring.group_scores import f1, group_of_person, ratio
from tracking.scoring.people_and_groups import GroupRows
from tracking.scoring.rows import FrameRows


def pairwise_scores(true: GroupRows, est: GroupRows, person: Ints) -> dict[str, float]:
    """Returns a dict of pairwise_precision (right / estimated pairs), pairwise_recall (right / true pairs) and
    pairwise_F1 (2 right / both together). A pair is two people of one frame in one group.

    Pairs of all frames are counted together. true, est: true and estimated groups in frames; true.member holds row
    indices of the true people. person (K,): row of the true person that each membership of `est` is mapped to, -1 none.

    An estimated pair is right if both persons are in one true group. An estimated pair with an unmapped member, or with
    both members mapped to one person, is false. A true pair with a person whom no track is mapped to is missed. A pair
    inside several estimated groups counts once. A score whose denominator is 0 is nan.
    """
    n_true = _pairs_in(true)
    group = group_of_person(true, int(max(true.member.max(initial=-1), person.max(initial=-1))) + 1)
    order = np.argsort(est.of, kind="stable")
    mapped = person[order]
    inside = FrameRows(est.of[order], order)  # the group takes the place of the frame

    def ordered(a: Ints, b: Ints) -> tuple[Ints, Array]:
        kept = np.flatnonzero((mapped[a] >= 0) & (mapped[a] < mapped[b]))
        return kept, np.ones(len(kept))

    both = compare(inside, inside, ordered)
    pairs = np.stack([mapped[both.i], mapped[both.j]])
    distinct = np.unique(pairs, axis=1)  # hulls may overlap: a pair inside two of them is one pair
    n_est = _pairs_in(est) - (pairs.shape[1] - distinct.shape[1])
    p, q = distinct
    hits = int(((group[p] >= 0) & (group[p] == group[q])).sum())
    return {
        "pairwise_F1": f1(hits, n_true, n_est),
        "pairwise_precision": ratio(hits, n_est),
        "pairwise_recall": ratio(hits, n_true),
    }


def _pairs_in(groups: GroupRows) -> int:
    """Returns the number of unordered pairs of members, n (n - 1) / 2 per group of n, summed over groups."""
    n = groups.count
    return int((n * (n - 1) // 2).sum())
