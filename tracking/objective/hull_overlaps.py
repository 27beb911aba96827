"""Fast overlaps of group hulls: candidate pairs of an IoU of 0.5 or more, and the people inside each hull.

Compiled kernels are exact up to rounding. Whenever rounding could change the outcome, the value is recomputed by the
functions of tracking.scoring: where a hull has several partners, where an IoU is within `NEAR` of 0.5, where a person
is within `NEAR` of the limit, and where a reported hull is not convex, clockwise or without area.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.scoring.candidate_pairs import FOUND, Pairs
from tracking.scoring.group_scores import hull_iou
from tracking.scoring.people_and_groups import INSIDE, GroupRows, people_inside
from tracking.scoring.rows import FrameRows

NEAR = 1e-6  # an IoU this near 0.5, or a distance this near the limit (as a share of it), is recomputed exactly
FLAT = 1e-12  # share of a polygon's squared size: a right turn smaller than this is a rounding error


@dataclass(frozen=True, eq=False)
class GroupOutlines:
    """G groups in frames, sorted by frame, with their hulls in flat arrays, in m on the ground or px in the image.

    - rows: frame number (from 1) and id of each group.
    - pos (G, 2): centres x, y.
    - vertex (V, 2), ends (G,): polygon g is vertex[ends[g - 1] : ends[g]] (polygon 0 begins at 0), counter-clockwise.
    - area (G,): signed area, above 0 if counter-clockwise (y up, also for px), 0 without vertices.
    - box (G, 4): min x, min y, max x, max y, nan without vertices.
    - regular (G,): True if the polygon has a positive area and is convex up to rounding.
    """

    rows: FrameRows
    pos: Array
    vertex: Array
    ends: Ints
    area: Array
    box: Array
    regular: Bools

    @classmethod
    def measured(cls, rows: FrameRows, pos: Array, vertex: Array, ends: Ints) -> GroupOutlines:
        """Returns the outlines with area, box and regularity of each polygon computed.

        rows: frame number and id of G groups; pos (G, 2): centres; vertex (V, 2): all polygons one after the other;
        ends (G,): index at which each polygon ends (exclusive).
        """
        from tracking.objective import hull_overlaps_kernels as kernels

        vertex = np.ascontiguousarray(vertex, float)
        return cls(rows, pos, vertex, ends, *kernels.measure(vertex, ends, FLAT))

    @classmethod
    def of(cls, groups: GroupRows) -> GroupOutlines:
        """Returns the outlines of G groups in their order, which must be by frame. A group without a hull gets a
        polygon without vertices."""
        ends = np.cumsum(np.array([len(h) for h in groups.hull], np.int64))
        return cls.measured(groups.rows, groups.pos, np.concatenate([np.zeros((0, 2)), *groups.hull]), ends)

    def __len__(self) -> int:
        return len(self.rows)

    def until(self, last: int) -> GroupOutlines:
        """Returns the groups of the frames up to and including frame number `last`. The vertices of all groups are
        kept.
        """
        n = slice(int(np.searchsorted(self.rows.frame, last, side="right")))
        return GroupOutlines(
            self.rows.keep(n), self.pos[n], self.vertex, self.ends[n], self.area[n], self.box[n], self.regular[n]
        )

    def polygons(self, groups: Ints) -> list[Array]:
        """Returns the polygons (V, 2) of the groups with these row indices, in their order; V is 0 for a group without
        a hull.
        """
        return [self.vertex[self.ends[g - 1] if g else 0 : self.ends[g]] for g in groups.tolist()]


def found_pairs(true: GroupOutlines, est: GroupOutlines) -> Pairs:
    """Returns the pairs of groups of one frame that may have an IoU of 0.5 or more, with their IoU as similarity.

    true, est: outlines in one unit. Pairs are sorted by row of `true`, then of `est`. Pairs below 0.5 - 1e-6 are left
    out, unless a polygon is not regular (convex with positive area); a polygon without area is in no pair. An IoU is
    exact where it decides about 0.5 or competes with another pair of the same group; elsewhere it may differ from the
    exact value by rounding.
    """
    from tracking.objective import hull_overlaps_kernels as kernels

    i, j = kernels.candidates(
        true.rows.frame, true.box, true.area, est.rows.frame, est.box, est.area, FOUND - NEAR
    )  # fmt: skip
    s = kernels.overlaps(true.vertex, true.ends, true.area, est.vertex, est.ends, est.area, i, j)
    irregular = ~(true.regular[i] & est.regular[j])
    kept = irregular | (s >= FOUND - NEAR)
    i, j, s, irregular = i[kept], j[kept], s[kept], irregular[kept]
    rivals = (np.bincount(i, minlength=1)[i] > 1) | (np.bincount(j, minlength=1)[j] > 1)
    unsure = np.flatnonzero(rivals | irregular | (s <= FOUND + NEAR))
    if len(unsure):
        (a, of_a), (b, of_b) = (np.unique(rows[unsure], return_inverse=True) for rows in (i, j))
        s[unsure] = hull_iou(true.polygons(a), est.polygons(b))(of_a, of_b)
    return Pairs(true.rows, est.rows, i, j, s)


def count_inside(outlines: GroupOutlines, groups: GroupRows, people: FrameRows, positions: Array, scale: float) -> Ints:
    """Returns how many people of the frame are inside each of G hulls or within 0.3 m of it, (G,); 2 stands for two or
    more.

    outlines, groups: the same G groups twice. people, positions (R, 2): the people in frames, sorted by frame, and
    their x, y in the unit of the hulls. scale: this unit per metre. A group without a hull has 0.
    """
    from tracking.objective import hull_overlaps_kernels as kernels

    reach = INSIDE * scale
    count = kernels.inside(
        outlines.rows.frame, outlines.vertex, outlines.ends, outlines.box, outlines.regular, people.frame,
        np.ascontiguousarray(positions), reach, NEAR * reach,
    )  # fmt: skip
    unsure = count < 0
    if unsure.any():
        count[unsure] = people_inside(groups.keep(unsure), people, positions, scale).count
    return np.asarray(np.minimum(count, 2))
