"""Groups matched one to one in every frame, by hulls or by members, and what their scores count.

A true group is *found* (`groups_found`) if an estimated group has more than half of the people of both in common. This
needs no matching: of two true groups, which share nobody, at most one has more than half of an estimated group.

Detection follows Bazzani, Cristani & Murino (2012), "Decentralized Particle Filter for Joint Individual-Group
Tracking": 1-FP and 1-FN (1 - false or missed / true groups), GDSR (share of true groups whose match holds 60 % of their
members). MOTP (mean distance of centres) and MOTA follow Bernardin & Stiefelhagen (2008). Sums run over labelled
frames (weighted_group_scores.py).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim.geometry.polygons import iou_pairs, pack
from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import EPS, Pairs, compare
from tracking.scoring.matching import match
from tracking.scoring.people_and_groups import GroupRows

GroupMatch = Literal["hull", "members"]
CORRECT = (3, 5)  # 3/5 of the members must be common for a group to be correct; integers avoid rounding
TIE = 1e-9  # weight of closeness in a matching: decides between equal similarities only


@dataclass(frozen=True, slots=True, eq=False)
class SharedMembers:
    """Number of people that a true and an estimated group (rows of `GroupRows`) have in common, 0 for pairs not listed.

    key (K,): true row * width + estimated row, ascending; count (K,): common people, above 0; width: number of
    estimated groups.
    """

    key: Ints
    count: Ints
    width: int

    def of(self, i: Ints, j: Ints) -> Ints:
        """Returns the number of common people of each of P pairs, (P,); i (P,): rows of true groups, j (P,): of
        estimated ones.

        0 for a pair without common people.
        """
        if not len(self.key):
            return np.zeros(len(i), np.int64)
        sought = i * self.width + j
        place = np.minimum(np.searchsorted(self.key, sought), len(self.key) - 1)
        return np.where(self.key[place] == sought, self.count[place], 0)


def shared_members(true: GroupRows, est: GroupRows, person: Ints, people: int) -> SharedMembers:
    """Returns the numbers of common members of all true and estimated groups.

    true.member: rows of true people. person (K,): row of the true person that each of the K memberships of `est` is
    mapped to, -1 none (never common). people: number of rows of true people. A true person counts for one true group
    only, the last that lists the person.
    """
    i = group_of_person(true, people)[person]  # -1 selects the last element, which is -1
    known = i >= 0
    key, count = np.unique(i[known] * len(est) + est.of[known], return_counts=True)
    return SharedMembers(key, count, len(est))


def groups_found(true: GroupRows, est: GroupRows, shared: SharedMembers) -> Bools:
    """Returns which true groups are found, (G,): the Jaccard index of the members with some estimated group is above
    1/2.

    shared: numbers of common people of `true` and `est`. At 1/2 a pair would be found in a group of twice its size, so
    one group of everybody would be right wherever two pairs walk. Of several estimated groups that find one true group
    (hulls may overlap) one counts, as a true group is found once.
    """
    i, j = np.divmod(shared.key, max(shared.width, 1))
    found = np.zeros(len(true), bool)
    found[i[3 * shared.count > true.count[i] + est.count[j]]] = True
    return found


def group_of_person(groups: GroupRows, people: int) -> Ints:
    """Returns the group (row of `groups`) of each row of people, -1 for a person in no group: (people + 1,).

    The last element is always -1, so that index -1 means no person. people: number of rows of people that groups.member
    refers to. Memberships with member -1 are ignored. Of several groups with one person the last is returned.
    """
    group = np.full(people + 1, -1, np.int64)
    known = groups.member >= 0
    group[groups.member[known]] = groups.of[known]
    return group


def hull_iou(true: Sequence[Array], est: Sequence[Array]) -> Callable[[Ints, Ints], Array]:
    """Returns a function of row indices i, j (K,) that gives the intersection over union (K,) of polygons true[i] and
    est[j].

    true, est: convex polygons (V, 2) of x, y, counter-clockwise, in one unit. A polygon without area has IoU 0.
    """
    width = max(map(len, (*true, *est)), default=1)
    a, b = pack(true, width), pack(est, width)
    return lambda i, j: iou_pairs(a, b, i, j)


def hull_pairs(true: GroupRows, est: GroupRows) -> Pairs:
    """Returns the pairs of true and estimated groups of one frame whose hulls (convex polygons) overlap; similarity:
    the intersection over union of the hulls. A group without a hull has no pairs.
    """
    iou = hull_iou(true.hull, est.hull)

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        s = iou(i, j)
        some = np.flatnonzero(s > EPS)
        return some, s[some]

    return compare(true.rows, est.rows, similarity)


def member_pairs(true: GroupRows, est: GroupRows, shared: SharedMembers) -> Pairs:
    """Returns the pairs of true and estimated groups of one frame with common members; similarity: their Jaccard index.

    It is common / (true members + estimated members - common), common from `shared`. An estimated member who is mapped
    to no true person counts as wrong.
    """
    n, m = true.count, est.count

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        common = shared.of(i, j)
        some = np.flatnonzero(common)
        return some, common[some] / (n[i[some]] + m[j[some]] - common[some])

    return compare(true.rows, est.rows, similarity)


def matched_groups(true_pos: Array, est_pos: Array, pairs: Pairs, least: float = 0.0) -> Pairs:
    """Returns the pairs of the one-to-one matching of each frame with the greatest total similarity.

    pairs: candidate pairs of groups; those of similarity below `least` are not used. true_pos (G, 2), est_pos (H, 2):
    centres x, y of the true and estimated groups in the rows of `pairs`. Of several best matchings (Jaccard indices are
    often equal) the one with the nearer centres is returned, so the order of groups has no influence. A nan centre
    counts as far away.
    """
    near = pairs.keep(pairs.s >= least - EPS)
    apart = np.hypot(*(true_pos[near.i] - est_pos[near.j]).T)
    closeness = np.nan_to_num(1 / (1 + apart), nan=0.0)
    return near.keep(match(near.frame, near.i, near.j, near.s + TIE * closeness))


@dataclass(frozen=True, eq=False)
class GroupComparison:
    """G true and H estimated groups in frames, with their matchings.

    true, est: the groups; shared: numbers of their common people. pairs: all candidate pairs; chosen: the one-to-one
    matching of all pairs. nearest (G,): distance (m or px) of each true group to the group matched by distance alone,
    nan if it has none.
    """

    true: GroupRows
    est: GroupRows
    shared: SharedMembers
    pairs: Pairs
    chosen: Pairs
    nearest: Array


def compare_groups(true: GroupRows, est: GroupRows, shared: SharedMembers, pairs: Pairs) -> GroupComparison:
    """Returns both sides' groups with the matchings of candidate pairs, from `hull_pairs` or `member_pairs`.

    true, est: groups in frames. shared: numbers of their common people, from `shared_members`.
    """
    chosen = matched_groups(true.pos, est.pos, pairs)
    return GroupComparison(true, est, shared, pairs, chosen, nearest_distances(true, est))


def nearest_distances(true: GroupRows, est: GroupRows) -> Array:
    """Returns for each of G true groups the distance to the estimated group it is matched with by distance, (G,), in m
    or px.

    Each frame's one-to-one matching has as many pairs as possible and then the least total distance of centres. nan:
    not matched, or a centre is nan.
    """

    def distance(i: Ints, j: Ints) -> tuple[Ints, Array]:
        d = np.hypot(*(true.pos[i] - est.pos[j]).T)
        known = np.flatnonzero(np.isfinite(d))
        return known, d[known]

    pairs = compare(true.rows, est.rows, distance)
    far = 2 * float(pairs.s.max(initial=0.0)) + 1  # makes one more pair worth more than any saved distance
    kept = match(pairs.frame, pairs.i, pairs.j, far * len(true) - pairs.s) if len(pairs.s) else np.zeros(0, bool)
    out = np.full(len(true), np.nan)
    out[pairs.i[kept]] = pairs.s[kept]
    return out


def correct(compared: GroupComparison, i: Ints, j: Ints) -> tuple[Bools, Bools]:
    """Returns two bool masks (K,) of the K matches of true rows i and estimated rows j: correct for GDSR, and for
    GDSR2.

    GDSR: at least 60 % of the true group's members are in the estimated group. GDSR2: in addition, at least 60 % of the
    estimated members are in the true group. compared: both sides' groups, whose row indices i and j are.
    """
    common = compared.shared.of(i, j)
    part, whole = CORRECT
    right = whole * common >= part * compared.true.count[i]
    pure = right & (whole * common >= part * compared.est.count[j])
    return right, pure


def switch_frames(frame: Ints, true: Ints, est: Ints) -> Ints:
    """Returns the frame number of each switch: a true id is matched with a different estimated id than in its previous
    match.

    frame, true, est (K,): frame number, true id and estimated id of each match, in any order. Frames without a match do
    not count as a switch. A switch belongs to the frame of the later match.
    """
    order = np.lexsort((frame, true))
    f, t, e = frame[order], true[order], est[order]
    return np.asarray(f[1:][(t[1:] == t[:-1]) & (e[1:] != e[:-1])])


def f1(hits: int, n_true: int, n_est: int) -> float:
    """Returns 2 hits / (n_true + n_est), nan if both are 0; hits: matches, n_true, n_est: number on each side."""
    return 2 * hits / (n_true + n_est) if n_true + n_est else float("nan")


def sizes(groups: GroupRows) -> Array:
    """Returns the number of people in each of G groups, (G,) float: reported size, or if nan the number of members."""
    return np.where(np.isfinite(groups.size), groups.size, groups.count)
