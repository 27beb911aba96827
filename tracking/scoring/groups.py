"""Scores of groups: matched one to one in every frame by their hulls or by their members.

After Bazzani, Cristani & Murino (2012): detection by false and missed groups, GDSR; tracking by MOTP and MOTA.
Sums run over the frames that are labelled; a score that divides by nothing is nan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim.geometry.polygons import iou_pairs, pack
from sim.types import Array, Bools, Ints
from tracking.scoring.errors import gaussian_wasserstein
from tracking.scoring.hota import hota
from tracking.scoring.matching import match
from tracking.scoring.rows import Crowd
from tracking.scoring.similarity import EPS, Pairs, compare

GroupMatch = Literal["hull", "members"]
CORRECT = (3, 5)  # share of members (of either side) that makes a group a right one: 60 %, without rounding
FOUND = 0.5  # similarity from which a group counts as found in F1
TIE = 1e-9  # of similarity: what being near is worth: decides between equals, outweighs nothing else


@dataclass(frozen=True, slots=True, eq=False)
class Shared:
    """How many people a true and an estimated group have in common: sorted keys (K,) of true row times G_est plus
    estimated row, and counts (K,)."""

    key: Ints
    count: Ints
    width: int

    def of(self, i: Ints, j: Ints) -> Ints:
        """For pairs of rows."""
        if not len(self.key):
            return np.zeros(len(i), np.int64)
        sought = i * self.width + j
        place = np.minimum(np.searchsorted(self.key, sought), len(self.key) - 1)
        return np.where(self.key[place] == sought, self.count[place], 0)


def shared_members(true: Crowd, est: Crowd, stands_for: Ints, people: int) -> Shared:
    """stands_for: the true person's row of each of est's members (K,), -1 unmapped; people: how many true rows."""
    i = group_of(true, people)[stands_for]  # -1 takes the last, which is nobody's
    known = i >= 0
    key, count = np.unique(i[known] * len(est) + est.of[known], return_counts=True)
    return Shared(key, count, len(est))


def group_of(groups: Crowd, people: int) -> Ints:
    """The group's row of each row of the people (people + 1,), -1 for who is in none, and for the last, nobody."""
    group = np.full(people + 1, -1, np.int64)
    known = groups.who >= 0
    group[groups.who[known]] = groups.of[known]
    return group


def hull_pairs(true: Crowd, est: Crowd) -> Pairs:
    """Pairs by intersection over union of hulls."""
    width = max(map(len, (*true.hull, *est.hull)), default=1)
    a, b = pack(true.hull, width), pack(est.hull, width)

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        s = iou_pairs(a, b, i, j)
        some = np.flatnonzero(s > EPS)
        return some, s[some]

    return compare(true.rows, est.rows, similarity)


def member_pairs(true: Crowd, est: Crowd, shared: Shared) -> Pairs:
    """Pairs by Jaccard index of members; who is unmapped is in nobody's true group."""
    n, m = true.count, est.count

    def similarity(i: Ints, j: Ints) -> tuple[Ints, Array]:
        common = shared.of(i, j)
        some = np.flatnonzero(common)
        return some, common[some] / (n[i[some]] + m[j[some]] - common[some])

    return compare(true.rows, est.rows, similarity)


def matched(true: Crowd, est: Crowd, pairs: Pairs, least: float = 0.0) -> Pairs:
    """The pairs of the one-to-one matching of each frame with the greatest total similarity, each at least `least`.

    Of several best matchings (Jaccard indices are often equal) the one whose middles are nearer, so that the order of
    groups decides nothing.
    """
    near = pairs.keep(pairs.s >= least - EPS)
    apart = np.hypot(*(true.pos[near.i] - est.pos[near.j]).T)
    closeness = np.nan_to_num(1 / (1 + apart), nan=0.0)
    return near.keep(match(near.frame, near.i, near.j, near.s + TIE * closeness))


@dataclass(frozen=True, eq=False)
class Compared:
    """Two crowds side by side. pairs: all possible; chosen: those of the matching; found: of the matching among those
    of similarity 0.5 and more. nearest (G_true,): distance to the group matched by distance alone, nan where none is.
    """

    true: Crowd
    est: Crowd
    shared: Shared
    pairs: Pairs
    chosen: Pairs
    found: Pairs
    nearest: Array


def compare_groups(true: Crowd, est: Crowd, shared: Shared, by: GroupMatch) -> Compared:
    """Crowds compared by hulls or by members."""
    pairs = hull_pairs(true, est) if by == "hull" else member_pairs(true, est, shared)
    chosen, found = matched(true, est, pairs), matched(true, est, pairs, FOUND)
    return Compared(true, est, shared, pairs, chosen, found, nearest(true, est))


def nearest(true: Crowd, est: Crowd) -> Array:
    """Distances (G_true,) when as many groups as possible are matched in each frame, so that they sum to least."""

    def apart(i: Ints, j: Ints) -> tuple[Ints, Array]:
        d = np.hypot(*(true.pos[i] - est.pos[j]).T)
        known = np.flatnonzero(np.isfinite(d))
        return known, d[known]

    pairs = compare(true.rows, est.rows, apart)
    far = 2 * float(pairs.s.max(initial=0.0)) + 1  # one pair more is worth more than any distances saved
    kept = match(pairs.frame, pairs.i, pairs.j, far * len(true) - pairs.s) if len(pairs.s) else np.zeros(0, bool)
    out = np.full(len(true), np.nan)
    out[pairs.i[kept]] = pairs.s[kept]
    return out


def group_scores(compared: Compared, frames: Bools) -> dict[str, float]:
    """Scores over the frames f with frames[f]; keys as in the catalogue, without their prefix; HOTA's are missing where
    there is no group on either side."""
    true, est, chosen = compared.true, compared.est, compared.chosen
    kept = frames[true.rows.frame[chosen.i]]
    i, j = chosen.i[kept], chosen.j[kept]
    there, said, hits = int(frames[true.rows.frame].sum()), int(frames[est.rows.frame].sum()), len(i)
    misses, false = there - hits, said - hits
    switches = switched(true.rows.frame[i], true.rows.id[i], est.rows.id[j])
    right, clean = _correct(compared, i, j)
    distance = np.hypot(*(true.pos[i] - est.pos[j]).T)
    return {
        "1-FP": _share(there - false, there),
        "1-FN": _share(there - misses, there),
        **_by_frame(compared, frames, i),
        "GDSR": _share(int(right.sum()), there),
        "GDSR2": _share(int(clean.sum()), there),
        "MOTP": _mean(distance),
        "MSE": _mean(distance**2),
        "MOTP_ungated": _mean(compared.nearest[frames[true.rows.frame]]),
        "MOTA": _share(there - misses - false - switches, there),
        "IDSW": float(switches),
        "TP": float(hits),
        "FP": float(false),
        "FN": float(misses),
        **detection(compared, frames),
        **(hota(compared.pairs.in_frames(frames)) if there + said else {}),
        "size_error": _mean(np.abs(_sizes(true)[i] - _sizes(est)[j])),
        "extent_error": _mean(gaussian_wasserstein(true.pos[i], true.extent[i], est.pos[j], est.extent[j])),
    }


def _share(part: float, whole: int) -> float:
    return part / whole if whole else float("nan")


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")


def _correct(compared: Compared, i: Ints, j: Ints) -> tuple[Bools, Bools]:
    """Which matches have enough of the true members inside, and which of these enough right ones among their own."""
    common = compared.shared.of(i, j)
    part, whole = CORRECT
    right = whole * common >= part * compared.true.count[i]
    clean = right & (whole * common >= part * compared.est.count[j])
    return right, clean


def _by_frame(compared: Compared, frames: Bools, i: Ints) -> dict[str, float]:
    """Means over frames of what the paper may have meant: each frame's false and missed groups by its true ones."""
    size = len(frames)
    n, m = (np.bincount(side.rows.frame, minlength=size)[frames] for side in (compared.true, compared.est))
    hits = np.bincount(compared.true.rows.frame[i], minlength=size)[frames]
    if not len(n):
        return {"1-FP_frames": float("nan"), "1-FN_frames": float("nan")}
    return {
        "1-FP_frames": float(1 - ((m - hits) / np.maximum(n, 1)).mean()),
        "1-FN_frames": float(1 - ((n - hits) / np.maximum(n, 1)).mean()),
    }


def switched(frame: Ints, true: Ints, est: Ints) -> int:
    """How often a true id is matched with another estimated id than the last time; K matches."""
    order = np.lexsort((frame, true))
    t, e = true[order], est[order]
    return int(((t[1:] == t[:-1]) & (e[1:] != e[:-1])).sum())


def detection(compared: Compared, frames: Bools) -> dict[str, float]:
    """F1, precision, recall at a similarity of 0.5."""
    f = compared.found
    hits = int(frames[f.true.frame[f.i]].sum())
    there, said = (int(frames[side.rows.frame].sum()) for side in (compared.true, compared.est))
    return {
        "F1": _share(2 * hits, there + said),
        "precision": _share(hits, said),
        "recall": _share(hits, there),
    }


def _sizes(groups: Crowd) -> Array:
    """People in each group: as it says, else its members."""
    return np.where(np.isfinite(groups.size), groups.size, groups.count)
