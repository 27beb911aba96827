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
    """Returns for each frame number 0 … last how many pairs of people are in one group, (last + 1, 3): true pairs,
    estimated pairs, right pairs.

    true, est: true and estimated groups in frames; true.member holds row indices of the true people. person (K,): row
    of the true person that each membership of `est` is mapped to, -1 none. last: the last frame with a group on either
    side; shape (0, 3) without groups.

    An estimated pair is right if both persons are in one true group. An estimated pair with an unmapped member, or with
    both members mapped to one person, is false. A true pair with a person whom no track is mapped to is missed. A pair
    inside several estimated groups counts once.
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
    """Returns the number of unordered pairs of members, n (n - 1) / 2 per group of n, of each frame number: (size,)."""
    pairs = np.zeros(size, np.int64)
    np.add.at(pairs, groups.rows.frame, groups.count * (groups.count - 1) // 2)
    return pairs
