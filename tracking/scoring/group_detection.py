"""Group detection as papers measure it: G-MITRE, and the groups that are right up to a tolerance T.

G-MITRE: Solera, Calderara & Cucchiara (2016), "Socially Constrained Structural Learning for Groups Detection in Crowd",
IEEE TPAMI 38(5). It is the MITRE score of Vilain et al. (1995), "A Model-Theoretic Coreference Scoring Scheme", after
each person alone is joined to a fictitious person, and each other person's fictitious one is left alone. A group S of
one partition then holds |S| - 1 links, of which |S| - p(S) are right, p(S) being the number of parts into which the
other partition divides S.

Groups right at T: Setti, Russell, Bassetti & Cristani (2015), "F-Formation Detection: Individuating Free-Standing
Conversational Groups in Images", PLoS ONE 10(5), after Cristani et al. (2011), BMVC. A true group of n members is right
if some estimated group holds at least ceil(T n) of them and at most ceil((1 - T) n) others.

Both are means over frames. A precision or recall of a frame whose denominator is 0 is 1, as in the authors' programs.
Departure: people who are missed, and tracks mapped to nobody, are parts of their own in G-MITRE.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.group_and_event_scores import ComparedSides, TrackedGroups
from tracking.scoring.group_scores import SharedMembers, group_of_person
from tracking.scoring.people_and_groups import GroupRows, PersonRows
from tracking.scoring.weighted_sums import FrameSums, WeightedScores, mean, ratio

TOLERANCES = {"right_groups": (2, 3), "exact_groups": (1, 1)}
"""Numerator and denominator of T, by the name of the scores; integers avoid rounding."""


def weighted_detection(
    sides: ComparedSides, true: GroupRows, tracked: TrackedGroups, shared: SharedMembers
) -> list[WeightedScores]:
    """Returns functions from weights (D, size) by frame number to F1, precision and recall of G-MITRE ("GMITRE_F1" …)
    and of the groups right at T = 2/3 ("right_groups_F1" …) and T = 1 ("exact_groups_F1" …), (D,) by key.

    sides: both sides' people in the scored frames; true, tracked: their groups of two or more in labelled frames;
    shared: numbers of common people, from `shared_members`. G-MITRE is missing if the tracker names no members.
    """
    size, est = len(sides.frames), tracked.counted
    n, m = (np.bincount(groups.rows.frame, minlength=size) for groups in (true, est))
    parts = []
    if tracked.named:
        parts.append(_means_over_frames("GMITRE", sides.frames, link_counts(sides, true, est), f1_of_means=False))
    for name, tolerance in TOLERANCES.items():
        hits = np.bincount(true.rows.frame[groups_right(true, est, shared, tolerance)], minlength=size)
        parts.append(_means_over_frames(name, sides.frames, np.stack([n, m, hits]), f1_of_means=True))
    return parts


def link_counts(sides: ComparedSides, true: GroupRows, est: GroupRows) -> Array:
    """Returns the links of G-MITRE by frame number, (3, size): true, estimated, right ones. The numbers of unlabelled
    frames have no meaning.

    sides: both sides' people, mapped. true, est: groups of two or more in labelled frames, members being rows of
    sides.true and of sides.est. Everybody in no group is alone. A person in several groups is in the last of them, but
    counts as a member of each.

    Right links are the same seen from either side: in each pair of a true and an estimated group the common people less
    one, and each person who is alone on both sides.
    """
    size = len(sides.frames)
    group, found = (group_of_person(g, len(p.rows))[:-1] for g, p in ((true, sides.true), (est, sides.est)))
    mapped = np.flatnonzero(sides.mapping >= 0)
    a, b, frame = group[sides.mapping[mapped]], found[mapped], sides.est.rows.frame[mapped]
    common = (a >= 0) & (b >= 0)
    first = np.unique(a[common] * len(est) + b[common], return_index=True)[1]
    right = np.bincount(frame[(a < 0) == (b < 0)], minlength=size) - np.bincount(frame[common][first], minlength=size)
    return np.array([_links(true, sides.true, group, size), _links(est, sides.est, found, size), right], float)


def _links(groups: GroupRows, people: PersonRows, group: Ints, size: int) -> Array:
    """Returns the number of links of one side by frame number, (size,): members - 1 of each group, and 1 of each of the
    R people who is in none. group (R,): the group of each, -1 none.
    """
    inside = np.bincount(groups.rows.frame, groups.count - 1, minlength=size)
    return np.asarray(inside + np.bincount(people.rows.frame[group < 0], minlength=size), float)


def groups_right(true: GroupRows, est: GroupRows, shared: SharedMembers, tolerance: tuple[int, int]) -> Bools:
    """Returns which true groups are right, (G,): an estimated group holds at least ceil(T n) of the n members and at
    most ceil((1 - T) n) others.

    shared: numbers of common people of `true` and `est`, which have two or more members. tolerance: numerator and
    denominator of T, 2/3 or more: then no estimated group fits two true ones, and the pairs are one to one.
    """
    part, whole = tolerance
    i, j = np.divmod(shared.key, max(shared.width, 1))
    n = true.count[i]
    enough = shared.count >= -(-part * n // whole)
    pure = est.count[j] - shared.count <= -((part - whole) * n // whole)
    right = np.zeros(len(true), bool)
    right[i[enough & pure]] = True
    return right


def _means_over_frames(name: str, frames: Bools, counts: Array, f1_of_means: bool) -> WeightedScores:
    """Returns a function from weights (D, size) to F1, precision and recall, (D,) by key, which begins with `name`.

    Precision and recall are means over the frames f where frames[f] is true. counts (3, size): true, estimated and
    right items by frame number. F1 is the harmonic mean of the two means (0 if both are 0), or else a mean over frames,
    too.
    """
    n, m, hits = counts
    sums, every = FrameSums(len(frames)), np.flatnonzero(frames)
    for key, part, whole in (("F1", 2 * hits, n + m), ("precision", hits, m), ("recall", hits, n)):
        sums.add_mean(key, every, ratio(part, whole, empty=1.0)[every])

    def score(weights: Array) -> dict[str, Array]:
        s = sums.of(weights)
        found = {f"{name}_{key}": mean(s, key) for key in ("F1", "precision", "recall")}
        if f1_of_means:
            p, r = found[f"{name}_precision"], found[f"{name}_recall"]
            found[f"{name}_F1"] = np.where(p + r > 0, ratio(2 * p * r, p + r), p + r)
        return found

    return score
