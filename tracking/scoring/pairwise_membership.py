"""Pairwise membership: F1 over pairs of people who are in one group, independent of group ids and shapes.

Estimated pairs are pairs of tracked people, mapped to true people; a pair is right if the two are in one true group.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.scoring.candidate_pairs import compare
from tracking.scoring.group_scores import group_of_person
from tracking.scoring.people_and_groups import GroupRows
from tracking.scoring.rows import FrameRows


def pair_counts(true: GroupRows, est: GroupRows, person: Ints) -> Ints:
    """Returns how many pairs of people are in one group in each frame, (last + 1, 3): true, estimated, right pairs.

    person (K,): row of the true person of each membership of `est`, -1 none. An estimated pair is right if both are in
    one true group; a pair inside several estimated groups counts once.
    """
    group = group_of_person(true, int(max(true.member.max(initial=-1), person.max(initial=-1))) + 1)
    order = np.argsort(est.of, kind="stable")
    mapped = person[order]
    inside = FrameRows(est.of[order], order)  # the group takes the place of the frame

    def ordered(a: Ints, b: Ints) -> tuple[Ints, Array]:
        kept = np.flatnonzero((mapped[a] >= 0) & (mapped[a] < mapped[b]))
        return kept, np.ones(len(kept))

    both = compare(inside, inside, ordered)
    frame = est.rows.frame[est.of[order][both.i]]
    pairs = np.stack([mapped[both.i], mapped[both.j]])
    (p, q), first = np.unique(pairs, axis=1, return_index=True)  # hulls may overlap: a pair inside two of them is one
    size = 1 + int(max(true.rows.frame.max(initial=-1), est.rows.frame.max(initial=-1)))
    distinct = np.bincount(frame[first], minlength=size)
    repeated = np.bincount(frame, minlength=size) - distinct
    right = np.bincount(frame[first][(group[p] >= 0) & (group[p] == group[q])], minlength=size)
    return np.column_stack([_pairs_in(true, size), _pairs_in(est, size) - repeated, right])


def _pairs_in(groups: GroupRows, size: int) -> Ints:
    pairs = np.zeros(size, np.int64)
    np.add.at(pairs, groups.rows.frame, groups.count * (groups.count - 1) // 2)
    return pairs
