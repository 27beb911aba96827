"""Scores of groups that are matched one to one in every frame, by hulls or by members.

A true group is *found* (`groups_found`) if an estimated group has more than half of the people of both in common. This
needs no matching: of two true groups, which share nobody, at most one has more than half of an estimated group.

Detection follows Bazzani, Cristani & Murino (2012), "Decentralized Particle Filter for Joint Individual-Group
Tracking": 1-FP and 1-FN (1 - false or missed / true groups), GDSR (share of true groups whose match holds 60 % of their
members). MOTP (mean distance of centres) and MOTA follow Bernardin & Stiefelhagen (2008), HOTA of groups is that of
`hota`. Scores come twice: strict (all labelled frames) and core (without frames up to 1 s from a true merge or split).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim.geometry.polygons import iou_pairs, pack
from sim.types import Array, Bools, Ints, Truth
from tracking.scoring.event_members import CHANGES
from tracking.scoring.frame_weights import FrameScores, WeightedScores
from tracking.scoring.group_rows import GroupRows, TrackedGroups, TrueGroups
from tracking.scoring.hota import weighted_hota
from tracking.scoring.matching import match
from tracking.scoring.people import ComparedSides
from tracking.scoring.similarity import EPS, FOUND, Pairs, compare

GroupMatch = Literal["hull", "members"]
CORRECT = (3, 5)  # 3/5 of the members must be common for a group to be correct; integers avoid rounding
TIE = 1e-9  # weight of closeness in a matching: decides between equal similarities only
CORE = 1.0  # s around the start of each true merge or split that the core scores leave out


@dataclass(frozen=True, slots=True, eq=False)
class SharedMembers:
    """Numbers of people that true and estimated groups have in common, 0 for pairs not listed."""

    key: Ints  # (K,): true row * width + estimated row, ascending
    count: Ints  # (K,): common people, above 0; width: number of estimated groups
    width: int

    def of(self, i: Ints, j: Ints) -> Ints:
        """Returns the number of common people of the true groups i and the estimated groups j, (P,) each."""
        if not len(self.key):
            return np.zeros(len(i), np.int64)
        sought = i * self.width + j
        place = np.minimum(np.searchsorted(self.key, sought), len(self.key) - 1)
        return np.where(self.key[place] == sought, self.count[place], 0)


def shared_members(true: GroupRows, est: GroupRows, person: Ints, people: int) -> SharedMembers:
    """Returns the numbers of common members of true and estimated groups. person (K,): row of the true person of each
    of the K memberships of `est`, -1 none. people: number of true rows."""
    i = group_of_person(true, people)[person]  # -1 selects the last element, which is -1
    known = i >= 0
    key, count = np.unique(i[known] * len(est) + est.of[known], return_counts=True)
    return SharedMembers(key, count, len(est))


def groups_found(true: GroupRows, est: GroupRows, shared: SharedMembers) -> Bools:
    """Returns which true groups are found, (G,) bool: those with a Jaccard index above 1/2 with an estimated group."""
    i, j = np.divmod(shared.key, max(shared.width, 1))
    found = np.zeros(len(true), bool)
    # Above 1/2 no matching is needed: two true groups share nobody, so that at most one has most of an estimated group.
    # At 1/2 a pair would be found in a group of twice its size, and one group of everybody would be right wherever two
    # pairs walk. Integers avoid rounding.
    found[i[3 * shared.count > true.count[i] + est.count[j]]] = True
    return found


def group_of_person(groups: GroupRows, people: int) -> Ints:
    """Returns the index of the group row of each person row, -1 for none; a last element of -1 is added. people: number
    of person rows. The result has the shape (people + 1,), so that index -1 gives -1."""
    group = np.full(people + 1, -1, np.int64)
    known = groups.member >= 0
    group[groups.member[known]] = groups.of[known]
    return group


def hull_pairs(true: GroupRows, est: GroupRows) -> Pairs:
    """Returns the pairs of a true and an estimated group of one frame with overlapping hulls, with the IoU of hulls."""
    width = max(map(len, (*true.hull, *est.hull)), default=1)
    a, b = pack(true.hull, width), pack(est.hull, width)

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        s = iou_pairs(a, b, i, j)
        some = np.flatnonzero(s > EPS)
        return some, s[some]

    return compare(true.rows, est.rows, similarity)


def member_pairs(true: GroupRows, est: GroupRows, shared: SharedMembers) -> Pairs:
    """Returns the pairs of a true and an estimated group of one frame with common members, with their Jaccard index."""
    n, m = true.count, est.count

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        common = shared.of(i, j)
        some = np.flatnonzero(common)
        return some, common[some] / (n[i[some]] + m[j[some]] - common[some])

    return compare(true.rows, est.rows, similarity)


def matched_groups(true_pos: Array, est_pos: Array, pairs: Pairs, least: float = 0.0) -> Pairs:
    """Returns the matched pairs: one to one in each frame, with the greatest total similarity.

    Of equal matchings the one with nearer centres is taken. true_pos (G, 2), est_pos (H, 2): centres of the groups.
    Pairs of similarity below `least` are not matched.
    """
    near = pairs.keep(pairs.s >= least - EPS)
    apart = np.hypot(*(true_pos[near.i] - est_pos[near.j]).T)
    closeness = np.nan_to_num(1 / (1 + apart), nan=0.0)
    # Jaccard indices are often equal: the nearer centres decide, so that the order of groups has no influence
    return near.keep(match(near.frame, near.i, near.j, near.s + TIE * closeness))


def switch_frames(frame: Ints, true: Ints, est: Ints) -> Ints:
    """Returns the frames in which a true id is matched with another estimated id than in its previous match. frame,
    true, est (K,): frame, true id and estimated id of each match. A frame occurs once per switch."""
    order = np.lexsort((frame, true))
    f, t, e = frame[order], true[order], est[order]
    return np.asarray(f[1:][(t[1:] == t[:-1]) & (e[1:] != e[:-1])])


def f1(hits: int, n_true: int, n_est: int) -> float:
    """Returns 2 hits / (n_true + n_est), nan if both are 0; hits: matches, n_true, n_est: number on each side."""
    return 2 * hits / (n_true + n_est) if n_true + n_est else float("nan")


def near_changes(truth: Truth) -> Bools:
    """Returns which of the frame numbers 0 … length are at most 1 s from the start of a true merge or split. The result
    is bool, (length + 1,). `form` counts as a merge and `dissolve` as a split."""
    starts = np.array([e.start for e in truth.events or () if e.kind in CHANGES], float)
    away = np.abs(np.arange(truth.length + 1)[:, None] - starts).min(axis=1, initial=np.inf)
    return np.asarray(away <= CORE * truth.fps + 1e-9)


def weighted_groups(
    scores: FrameScores, sides: ComparedSides, true: TrueGroups, tracked: TrackedGroups, shared: SharedMembers,
    by: GroupMatch,
) -> list[WeightedScores]:  # fmt: skip
    """Adds F1 of groups to `scores`, and returns functions from weights (D, size) to the others, (D,) by key.

    by: matches groups by "hull" (IoU) or by "members" (Jaccard index). The keys are those of the catalogue. Keys with
    "_core" leave out frames up to 1 s from the start of a true merge or split. Keys are missing where the truth or the
    tracker lacks data.
    """
    core = sides.frames & ~near_changes(sides.truth)
    groups, est = true.groups, tracked.counted
    n, m = (scores.column(side.rows.frame, within=sides.frames) for side in (groups, est))
    hulls = hull_pairs(groups, est) if true.comparable else None
    pairs = hulls if by == "hull" else member_pairs(groups, est, shared) if tracked.known else None
    parts: list[WeightedScores] = []
    if tracked.known:
        found = groups.rows.frame[groups_found(groups, est, shared)]
        scores.add_f1("group", n, m, scores.column(found, within=sides.frames))
        scores.add_f1("group", n * core, m * core, scores.column(found, within=core), "_core")
    if hulls is not None:
        overlapping = matched_groups(groups.pos, est.pos, hulls, FOUND).frame
        scores.add_ratio("group_F1_hull", 2 * scores.column(overlapping, within=sides.frames), n + m)
    if pairs is not None:
        chosen = matched_groups(groups.pos, est.pos, pairs)
        for frames, end in ((sides.frames, ""), (core, "_core")):
            parts.append(_matched_scores(groups, est, shared, chosen.keep(frames[chosen.frame]), frames, end))
            parts.append(_group_hota(pairs.in_frames(frames), (n + m) * frames, end))
    return parts


def _matched_scores(
    true: GroupRows, est: GroupRows, shared: SharedMembers, chosen: Pairs, frames: Bools, end: str
) -> WeightedScores:
    i, j, frame, (part, whole), scores = chosen.i, chosen.j, chosen.frame, CORRECT, FrameScores(len(frames))
    distance = np.hypot(*(true.pos[i] - est.pos[j]).T)
    scores.add_mean(f"group_MOTP{end}", frame, distance)
    scores.add_mean(f"group_MSE{end}", frame, distance**2)
    common = shared.of(i, j)
    right = whole * common >= part * true.count[i]
    pure = right & (whole * common >= part * est.count[j])
    n, m = (scores.column(rows.frame, within=frames) for rows in (true.rows, est.rows))
    hits, switches = scores.column(frame), scores.column(switch_frames(frame, true.rows.id[i], est.rows.id[j]))
    false = m - hits
    ratios = {
        "1-FP": n - false, "1-FN": hits, "MOTA": hits - false - switches,
        "GDSR": scores.column(frame[right]), "GDSR2": scores.column(frame[pure]),
    }  # fmt: skip
    for key, column in ratios.items():
        scores.add_ratio(f"group_{key}{end}", column, n)
    for key, column in {"TP": hits, "FP": false, "FN": n - hits, "IDSW": switches}.items():
        scores.add(f"group_{key}{end}", column)
    return scores


def _group_hota(pairs: Pairs, rows: Array, end: str) -> WeightedScores:
    hota = weighted_hota(pairs, len(rows))

    def score(weights: Array) -> dict[str, Array]:
        some = weights @ rows > 0
        return {f"group_{key}{end}": np.where(some, values, np.nan) for key, values in hota(weights).items()}

    return score
