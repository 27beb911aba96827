"""The objective alone, for those who ask for it again and again on the same truth: the number that `evaluate` gives.

What of the truth does not depend on the answers is made once, and of the scores only HOTA and the groups' F1 by hulls
are computed. F1 counts matched hulls whose overlap is at least 0.5. Compiled overlaps, right to rounding, decide where
a hull has one possible partner; where it has several, or an overlap is 0.5 but for rounding, or a tracker's hull is not
convex, the functions of tracking.scoring decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.geometry.footprints import FOOTPRINT
from sim.geometry.polygons import iou_pairs, pack
from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Bools, Ints, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.grouping.tracks_table import boxes_of_rows, tabulate
from tracking.scoring.evaluation import (
    chosen_frames,
    labelled_frames,
    objective_of,
    people_pairs,
    plane_of,
    usual_similarity,
)  # fmt: skip
from tracking.scoring.group_and_event_scores import Labelled, told_groups, true_groups
from tracking.scoring.groups import FOUND, matched
from tracking.scoring.hota import hota
from tracking.scoring.rows import INSIDE, Crowd, People, Surface, people_inside, tracked_people, true_people
from tracking.scoring.similarity import Pairs, Rows

NEAR = 1e-6
"""An overlap so near 0.5 is looked at more closely."""
FLAT = 1e-12
"""Of a polygon's size squared: a right turn smaller than this is rounding."""
DISC = np.roll(FOOTPRINT, -int(FOOTPRINT[:, 1].argmin()), axis=0)
"""A footprint from its lowest vertex on."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """G groups in frames, sorted by frame: frame (G,), pos (G, 2) their middles, area (G,), box (G, 4), regular (G,).

    Polygon g is vertex[ends[g - 1] : ends[g]].
    """

    frame: Ints
    pos: Array
    vertex: Array
    ends: Ints
    area: Array
    box: Array
    regular: Bools

    @classmethod
    def made(cls, frame: Ints, pos: Array, vertex: Array, ends: Ints) -> Shapes:
        """With areas and boxes."""
        from tracking import objective_kernels as kernels

        vertex = np.ascontiguousarray(vertex, float)
        return cls(frame, pos, vertex, ends, *kernels.measure(vertex, ends, FLAT))

    @classmethod
    def of(cls, groups: Crowd) -> Shapes:
        """Those of a crowd."""
        ends = np.cumsum(np.array([len(h) for h in groups.hull], np.int64))
        return cls.made(groups.rows.frame, groups.pos, np.concatenate([np.zeros((0, 2)), *groups.hull]), ends)

    def __len__(self) -> int:
        return len(self.frame)

    def until(self, last: int) -> Shapes:
        """Those in the frames up to `last`."""
        n = int(np.searchsorted(self.frame, last, side="right"))
        return Shapes(
            self.frame[:n], self.pos[:n], self.vertex, self.ends[:n], self.area[:n], self.box[:n], self.regular[:n]
        )

    def polygon(self, g: int) -> Array:
        """The vertices of one."""
        return self.vertex[self.ends[g - 1] if g else 0 : self.ends[g]]


class Judge:
    """A truth, ready to score answers by. State: what was made of the truth so far."""

    def __init__(self, truth: Truth) -> None:
        self.truth = truth
        self.labelled = labelled_frames(truth)
        self._shapes: dict[Surface, Shapes | None] = {}

    @cached_property
    def people(self) -> People:
        """Everybody, in all frames."""
        return true_people(self.truth, chosen_frames(None, self.truth.length))

    def scores(self, answers: Sequence[Tracks], px_per_m: float) -> dict[str, float]:
        """HOTA, group_F1_hull and objective, nan where unknown, of the frames up to the last one answered.

        Those of `evaluate(truth, with_groups(answers, fps, px_per_m), frames=last)`; answers in order.
        """
        last = answers[-1].index if answers else 0
        found = {"HOTA": float("nan"), "group_F1_hull": float("nan")}
        true, est, plane = self._people_until(last), tracked_people(answers), plane_of(self.truth, answers)
        if not any(t.unit == "group" for t in answers):
            pairs = people_pairs(true, est, usual_similarity(self.truth, answers), plane, self.truth.px_per_m)
            found["HOTA"] = hota(pairs)["HOTA"]
        surface: Surface = "image" if plane == "image" else "ground"
        shapes = self._shapes_on(surface) if self.labelled[: last + 1].any() else None
        if shapes is not None:
            told = self._told(answers, true, est, surface, px_per_m)
            found["group_F1_hull"] = f1(shapes.until(last), told)
        return {**found, "objective": objective_of(found)}

    def _people_until(self, last: int) -> People:
        whole = self.people
        cut = slice(int(np.searchsorted(whole.rows.frame, last, side="right")))
        pos, vel, box = (None if a is None else a[cut] for a in (whole.pos, whole.vel, whole.box))
        return People(whole.rows.keep(cut), whole.group[cut], pos, vel, box)

    def _shapes_on(self, surface: Surface) -> Shapes | None:
        """The truth's groups on a surface, None where they have no shapes there."""
        if surface not in self._shapes:
            groups, comparable = true_groups(self._case([], self.people, tracked_people([]), surface))
            self._shapes[surface] = Shapes.of(groups) if comparable else None
        return self._shapes[surface]

    def _case(self, answers: Sequence[Tracks], true: People, est: People, surface: Surface) -> Labelled:
        nobody = np.full(len(est.rows), -1, np.int64)
        return Labelled(self.truth, answers, self.labelled, true, est, nobody, surface)

    def _told(self, answers: Sequence[Tracks], true: People, est: People, surface: Surface, px_per_m: float) -> Shapes:
        """The groups of the answers that count, in labelled frames."""
        px_per_m = px_per_m if np.isfinite(px_per_m) else self.truth.px_per_m
        if not answers:
            return Shapes.of(told_groups(self._case([], true, est, surface)).counted)
        if all(t.unit == "group" for t in answers):
            return self._wholes(answers, true, surface)
        plain = not any(t.unit == "group" or t.derived or t.groups is not None for t in answers)
        if plain and (answers[0].plane != "image" or px_per_m > 0):
            return derived_shapes(answers, self.truth.fps, px_per_m, self.labelled)
        given = with_groups(answers, self.truth.fps, px_per_m)
        return Shapes.of(told_groups(self._case(given, true, est, surface)).counted)

    def _wholes(self, answers: Sequence[Tracks], true: People, surface: Surface) -> Shapes:
        """Groups that are tracked as wholes; one with one person inside counts as little as one person alone."""
        from tracking import objective_kernels as kernels

        some = [t for t in answers if self.labelled[t.index] and t.groups is not None]
        frame = np.repeat(np.array([t.index for t in some], np.int64), [len(t.groups.id) for t in some if t.groups])
        pos = np.concatenate([np.zeros((0, 2)), *(t.groups.pos[:, :2] for t in some if t.groups)])
        hulls = [h for t in some if t.groups for h in t.groups.hull or (np.zeros((0, 2)),) * len(t.groups.id)]
        nobody, n = np.zeros(0, np.int64), len(frame)
        groups = Crowd(Rows(frame, np.arange(n)), pos, np.zeros(n), np.zeros((n, 2, 2)), tuple(hulls), nobody, nobody)
        places = true.places(surface, "ground")
        if places is None:
            return Shapes.of(groups.keep(groups.count != 1))
        shapes, reach = Shapes.of(groups), INSIDE * (self.truth.px_per_m if surface == "image" else 1.0)
        count = kernels.inside(
            frame, shapes.vertex, shapes.ends, shapes.box, shapes.regular, true.rows.frame,
            np.ascontiguousarray(places), reach, NEAR * reach,
        )  # fmt: skip
        unsure = count < 0
        if unsure.any():
            count[unsure] = people_inside(groups.keep(unsure), true.rows, places, reach / INSIDE).count
        return shapes if (count != 1).all() else Shapes.of(groups.keep(count != 1))


def derived_shapes(answers: Sequence[Tracks], fps: float, px_per_m: float, labelled: Bools) -> Shapes:
    """The groups of people, where the tracker named none or by `group` alone, as `derive` has them: shapes only."""
    from tracking import objective_kernels as kernels

    rule = LinkRule()
    rows = tabulate(answers, fps, px_per_m, rule)
    group = rows.group
    if not (group >= 0).any():
        links = find_links(rows.frame, rows.column, rows.pos, rows.vel, rows.length, fps, rule)
        group = kernels.partition(
            rows.frame, rows.column, rows.length, len(rows.ids), frames_of(rule.memory, fps),
            links.frame, links.a, links.b, links.on,
        )  # fmt: skip
    order = np.lexsort((group, rows.frame))
    order = order[(group[order] >= 0) & labelled[rows.frame[order] + 1]]
    frame, name = rows.frame[order], group[order]
    new = np.diff(frame, prepend=-1).astype(bool) | np.diff(name, prepend=-1).astype(bool)
    number = np.cumsum(new) - 1
    several = np.bincount(number)[number] > 1 if len(order) else np.zeros(0, bool)
    order, first = order[several], np.flatnonzero(new[several])
    ends = np.append(first[1:], len(order)) if len(first) else first
    pos = rows.pos[order] * rows.scale
    middle = np.add.reduceat(pos, first) / np.diff(first, append=len(order))[:, None] if len(first) else pos[:0]
    box = boxes_of_rows(answers)
    if box is None:
        vertex, ends = kernels.footprints(pos, ends, DISC * rows.scale)
    else:
        left, top, wide, high = box[order].T
        corners = np.stack([left, top, left + wide, top, left + wide, top + high, left, top + high], 1).reshape(-1, 2)
        vertex, ends = kernels.footprints(corners, 4 * ends, np.zeros((1, 2)))
    return Shapes.made(rows.frame[order][first] + 1, middle, vertex, ends)


def f1(true: Shapes, est: Shapes) -> float:
    """F1 at an overlap of 0.5; nan without any group."""
    if not len(true) + len(est):
        return float("nan")
    from tracking import objective_kernels as kernels

    i, j = kernels.candidates(true.frame, true.box, true.area, est.frame, est.box, est.area, FOUND - NEAR)
    s = kernels.overlaps(true.vertex, true.ends, true.area, est.vertex, est.ends, est.area, i, j)
    odd = ~(true.regular[i] & est.regular[j])
    kept = odd | (s >= FOUND - NEAR)
    i, j, s, odd = i[kept], j[kept], s[kept], odd[kept]
    several = (np.bincount(i, minlength=1)[i] > 1) | (np.bincount(j, minlength=1)[j] > 1)
    open_ = several | odd | (s <= FOUND + NEAR)
    hits = len(i) - int(open_.sum()) + _matched(true, est, i[open_], j[open_])
    return 2 * hits / (len(true) + len(est))


def _matched(true: Shapes, est: Shapes, i: Ints, j: Ints) -> int:
    """How many of these pairs the matching has, among those of overlap 0.5 and more."""
    if not len(i):
        return 0
    (rows, a), (columns, b) = np.unique(i, return_inverse=True), np.unique(j, return_inverse=True)
    ours, theirs = [true.polygon(g) for g in rows.tolist()], [est.polygon(g) for g in columns.tolist()]
    width = max(map(len, (*ours, *theirs)))
    s = iou_pairs(pack(ours, width), pack(theirs, width), a, b)
    sides = _bare(true.frame[rows], true.pos[rows]), _bare(est.frame[columns], est.pos[columns])
    return len(matched(*sides, Pairs(sides[0].rows, sides[1].rows, a, b, s), FOUND).i)


def _bare(frame: Ints, pos: Array) -> Crowd:
    """Groups of which nothing is known but where they are."""
    n, nobody = len(frame), np.zeros(0, np.int64)
    return Crowd(Rows(frame, np.arange(n)), pos, np.zeros(n), np.zeros((n, 2, 2)), (), nobody, nobody)
