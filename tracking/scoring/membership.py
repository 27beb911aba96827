"""Scores of who is in one group: pairwise membership, G-MITRE, and the groups that are right up to a tolerance T.

Pairwise membership: F1 over pairs of people who are in one group, independent of ids and shapes. Estimated pairs are
pairs of tracked people, mapped to true people; a pair is right if the two are in one true group.

G-MITRE: Solera, Calderara & Cucchiara (2016), "Socially Constrained Structural Learning for Groups Detection in Crowd",
IEEE TPAMI 38(5). It is the MITRE score of Vilain et al. (1995), "A Model-Theoretic Coreference Scoring Scheme", after
each person alone is joined to a fictitious person, and each other person's fictitious one is left alone. A group S of
one partition then holds |S| - 1 links, of which |S| - p(S) are right, p(S) being the number of parts into which the
other partition divides S.

Groups right at T: Setti, Russell, Bassetti & Cristani (2015), "F-Formation Detection: Individuating Free-Standing
Conversational Groups in Images", PLoS ONE 10(5), after Cristani et al. (2011), BMVC. A true group of n members is right
if some estimated group holds at least ceil(T n) of them and at most ceil((1 - T) n) others.

G-MITRE and right groups are means over frames. A precision or recall of a frame whose denominator is 0 is 1, as in the
authors' programs. Departure: people who are missed, and tracks mapped to nobody, are parts of their own in G-MITRE.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.frame_weights import F1_AND_PARTS, FrameScores, WeightedScores, ratio
from tracking.scoring.group_rows import GroupRows, TrackedGroups
from tracking.scoring.groups import SharedMembers, group_of_person
from tracking.scoring.people import ComparedSides, PersonRows
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import compare

# Numerator and denominator of T, by the name of the scores; integers avoid rounding.
TOLERANCES = {"right_groups": (2, 3), "exact_groups": (1, 1)}


def link_counts(sides: ComparedSides, true: GroupRows, est: GroupRows) -> Array:
    """Returns the numbers of links of G-MITRE by frame number, (3, size): true, estimated and right links in order."""
    size = len(sides.frames)
    group, found = (group_of_person(g, len(p.rows))[:-1] for g, p in ((true, sides.true), (est, sides.est)))
    mapped = np.flatnonzero(sides.mapping >= 0)
    a, b, frame = group[sides.mapping[mapped]], found[mapped], sides.est.rows.frame[mapped]
    common = (a >= 0) & (b >= 0)
    first = np.unique(a[common] * len(est) + b[common], return_index=True)[1]
    right = np.bincount(frame[(a < 0) == (b < 0)], minlength=size) - np.bincount(frame[common][first], minlength=size)
    return np.array([_links(true, sides.true, group, size), _links(est, sides.est, found, size), right], float)


def _links(groups: GroupRows, people: PersonRows, group: Ints, size: int) -> Array:
    inside = np.bincount(groups.rows.frame, groups.count - 1, minlength=size)
    return np.asarray(inside + np.bincount(people.rows.frame[group < 0], minlength=size), float)


def groups_right(true: GroupRows, est: GroupRows, shared: SharedMembers, tolerance: tuple[int, int]) -> Bools:
    """Returns which true groups are right at T, (G,) bool, as the module defines it. tolerance: numerator and
    denominator of T."""
    part, whole = tolerance
    i, j = np.divmod(shared.key, max(shared.width, 1))
    n = true.count[i]
    enough = shared.count >= -(-part * n // whole)
    pure = est.count[j] - shared.count <= -((part - whole) * n // whole)
    right = np.zeros(len(true), bool)
    right[i[enough & pure]] = True
    return right


def pair_counts(true: GroupRows, est: GroupRows, person: Ints) -> Ints:
    """Returns how many pairs of people are in one group in each frame, (last + 1, 3): true, estimated, right pairs.

    person (K,): row of the true person of each membership of `est`, -1 none. An estimated pair is right if its two
    people are in one true group. A pair that is in several estimated groups counts once.
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


def weighted_membership(
    scores: FrameScores, sides: ComparedSides, true: GroupRows, tracked: TrackedGroups, shared: SharedMembers
) -> list[WeightedScores]:
    """Adds pairwise membership to `scores`, and returns functions from weights (D, size) to the others, (D,) by key.
    There are none if it is unknown who is in the tracker's groups, and no G-MITRE if the tracker names no members."""
    if not tracked.known:
        return []
    est = tracked.counted
    pairs = pair_counts(true, est, tracked.person)
    of_true, of_est, common = (scores.column(np.arange(len(pairs)), column) for column in pairs.T)
    scores.add_f1("pairwise", of_true, of_est, common)
    n, m = (scores.column(groups.rows.frame) for groups in (true, est))
    parts: list[WeightedScores] = []
    if tracked.named:
        parts.append(_means_over_frames("GMITRE", sides.frames, link_counts(sides, true, est)))
    for name, tolerance in TOLERANCES.items():
        right = scores.column(true.rows.frame[groups_right(true, est, shared, tolerance)])
        means = _means_over_frames(name, sides.frames, np.stack([n, m, right]))
        means.add_further(partial(_f1_of_means, name))
        parts.append(means)
    return parts


def _means_over_frames(name: str, frames: Bools, counts: Array) -> FrameScores:
    (n, m, hits), every, scores = counts, np.flatnonzero(frames), FrameScores(len(frames))
    for key, part, whole in zip(F1_AND_PARTS, (2 * hits, hits, hits), (n + m, m, n), strict=True):
        scores.add_mean(f"{name}_{key}", every, ratio(part, whole, empty=1.0)[every])
    return scores


def _f1_of_means(name: str, means: dict[str, Array], _: object) -> dict[str, Array]:
    p, r = means[f"{name}_precision"], means[f"{name}_recall"]
    return {f"{name}_F1": np.where(p + r > 0, ratio(2 * p * r, p + r), p + r)}
