"""Slow, obvious oracles of the scores of groups, membership and events: loops over frames, groups and people."""

from __future__ import annotations

from itertools import combinations, permutations
from math import ceil

import numpy as np
from scipy.optimize import linear_sum_assignment


def polygon_area(polygon):
    return 0.5 * sum(
        x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True)
    )


def clipped(polygon, a, b):
    """The part of a polygon on the left of the line from a to b (Sutherland & Hodgman)."""

    def side(p):
        return (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])

    out = []
    for p, q in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        if side(p) >= 0:
            out.append(p)
        if (side(p) > 0 > side(q)) or (side(p) < 0 < side(q)):
            t = side(p) / (side(p) - side(q))
            out.append((p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])))
    return out


def polygon_iou(a, b):
    a, b = [tuple(p) for p in a], [tuple(p) for p in b]
    common = a
    for p, q in zip(b, [*b[1:], *b[:1]], strict=True):
        common = clipped(common, p, q) if common else []
    area = polygon_area(common) if len(common) > 2 else 0.0
    return max(0.0, area / (polygon_area(a) + polygon_area(b) - area))


def in_or_near(polygon, point, within):
    """Whether a point lies in a convex polygon, or no further than `within` from one of its edges."""
    inside, nearest = True, np.inf
    for a, b in zip(polygon, [*polygon[1:], *polygon[:1]], strict=True):
        a, b, p = np.array(a), np.array(b), np.array(point)
        edge = b - a
        inside &= edge[0] * (p - a)[1] - edge[1] * (p - a)[0] >= 0
        t = np.clip((p - a) @ edge / (edge @ edge), 0, 1)
        nearest = min(nearest, np.linalg.norm(p - a - t * edge))
    return inside or nearest <= within


def best_matching(weight):
    """The one-to-one pairs (i, j) of positive weight with the greatest total, by trying all."""
    n, m = weight.shape
    best, chosen = -1.0, []
    for columns in permutations(range(m + n), n):
        pairs = [(i, j) for i, j in enumerate(columns) if j < m and weight[i, j] > 0]
        total = sum(weight[i, j] for i, j in pairs)
        if total > best:
            best, chosen = total, pairs
    return chosen


def who_is_who(true, est):
    """Estimated id → true id in one frame, both {id: (x, y)}: the best matching of 1 - d / 2 m, at least 0.5."""
    a, b = list(true), list(est)
    weight = np.zeros((len(a), len(b)))
    for i, p in enumerate(a):
        for j, q in enumerate(b):
            s = 1 - np.linalg.norm(np.array(true[p]) - np.array(est[q])) / 2
            weight[i, j] = s if s >= 0.5 else 0.0
    return {b[j]: a[i] for i, j in zip(*linear_sum_assignment(-weight), strict=True) if weight[i, j] > 0}


class Group:
    """One group of one frame: id, its people as true ids (None: a track that is nobody), pos, size, extent, hull."""

    def __init__(self, id, people, pos, size, extent, hull):
        self.id, self.people, self.pos, self.size, self.extent, self.hull = id, people, pos, size, extent, hull

    def common(self, other):
        return len({p for p in self.people if p is not None} & {p for p in other.people if p is not None})

    def jaccard(self, other):
        common = self.common(other)
        return common / (len(self.people) + len(other.people) - common)


def groups_of(groups, name):
    """The groups of 2 or more of one frame; name(member) is a true id or None."""
    return [
        Group(int(g), [name(int(m)) for m in members], pos, size, extent, hull)
        for g, members, pos, size, extent, hull in zip(
            groups.id, groups.members, groups.pos, groups.size, groups.extent, groups.hull, strict=True
        )
        if len(members) > 1
    ]


def groups_without_people(groups, places):
    """Those of a method that names no members: the true people {id: (x, y)} inside are, one alone is no group."""
    found = []
    for g, pos, size, extent, hull in zip(groups.id, groups.pos, groups.size, groups.extent, groups.hull, strict=True):
        people = [p for p, place in places.items() if in_or_near([tuple(v) for v in hull], place, 0.3)]
        if len(people) != 1:
            found.append(Group(int(g), people, pos, size, extent, hull))
    return found


def group_scores(true, est, by):
    """The scores of groups, without HOTA's; true, est: lists of Group, frame by frame."""
    n_true = n_est = hits = switches = right = clean = found = overlapping = 0
    distance, last = [], {}
    for a, b in zip(true, est, strict=True):
        s = np.array([[similarity(p, q, by) for q in b] for p in a]).reshape(len(a), len(b))
        nearer = np.array([[1e-9 / (1 + np.linalg.norm(p.pos - q.pos)) for q in b] for p in a]).reshape(s.shape)
        pairs = best_matching(np.where(s > 0, s + nearer, 0.0))
        alike = np.array([[p.jaccard(q) for q in b] for p in a]).reshape(s.shape)
        found += len(best_matching(np.where(alike > 0.5, alike, 0.0)))
        shapes = np.array([[polygon_iou(p.hull, q.hull) for q in b] for p in a]).reshape(s.shape)
        overlapping += len(best_matching(np.where(shapes >= 0.5, shapes + nearer, 0.0)))
        n_true, n_est, hits = n_true + len(a), n_est + len(b), hits + len(pairs)
        for i, j in pairs:
            common = a[i].common(b[j])
            inside = common >= 0.6 * len(a[i].people)
            right += inside
            clean += inside and common > 0 and common >= 0.6 * len(b[j].people)
            switches += last.get(a[i].id, b[j].id) != b[j].id
            last[a[i].id] = b[j].id
            distance.append(np.linalg.norm(a[i].pos - b[j].pos))
    misses, false = n_true - hits, n_est - hits
    return {
        "1-FP": ratio(n_true - false, n_true), "1-FN": ratio(n_true - misses, n_true),
        "GDSR": ratio(right, n_true), "GDSR2": ratio(clean, n_true),
        "MOTP": mean(distance), "MSE": mean([d**2 for d in distance]),
        "MOTA": ratio(n_true - misses - false - switches, n_true),
        "IDSW": switches, "TP": hits, "FP": false, "FN": misses,
        "F1": ratio(2 * found, n_true + n_est), "precision": ratio(found, n_est), "recall": ratio(found, n_true),
        "F1_hull": ratio(2 * overlapping, n_true + n_est),
    }  # fmt: skip


def similarity(a, b, by):
    return a.jaccard(b) if by == "members" else polygon_iou(a.hull, b.hull)


def pairwise_scores(true, est):
    there = [{frozenset(p) for g in frame for p in combinations(g.people, 2)} for frame in true]
    hits = said = 0
    for pairs, frame in zip(there, est, strict=True):
        named = {frozenset(p) for g in frame for p in combinations(g.people, 2) if None not in p}
        nameless = sum(None in p for g in frame for p in combinations(g.people, 2))
        hits, said = hits + len(pairs & named), said + len(named) + nameless
    total = sum(map(len, there))
    return {
        "pairwise_F1": ratio(2 * hits, total + said),
        "pairwise_precision": ratio(hits, said),
        "pairwise_recall": ratio(hits, total),
    }


def right_group_scores(true, est, name, tolerance):
    """Setti et al. (2015), one to one by trying all; tolerance: a Fraction."""
    precision, recall = [], []
    for a, b in zip(true, est, strict=True):
        fits = np.zeros((len(a), len(b)))
        for i, g in enumerate(a):
            for j, h in enumerate(b):
                n, found = len(g.people), g.common(h)
                false = len(h.people) - found
                fits[i, j] = found >= ceil(tolerance * n) and false <= ceil((1 - tolerance) * n)
        hits = len(best_matching(fits))
        precision.append(hits / len(b) if b else 1.0)
        recall.append(hits / len(a) if a else 1.0)
    p, r = mean(precision), mean(recall)
    return {f"{name}_F1": 2 * p * r / (p + r) if p + r else 0.0, f"{name}_precision": p, f"{name}_recall": r}


def event_hits(true, told, fps):
    """How many events are told: true, told are (start, set of true people, how many more) of one kind."""
    can = np.zeros((len(true), len(told)))
    for i, (start, people, _) in enumerate(true):
        for j, (other, those, wrong) in enumerate(told):
            same = len(people & those) / (len(people | those) + wrong) >= 0.5
            can[i, j] = abs(start - other) <= fps * 1.0 and same
    return len(best_matching(can))


def ratio(part, whole):
    return part / whole if whole else float("nan")


def mean(values):
    return float(np.mean(values)) if values else float("nan")
