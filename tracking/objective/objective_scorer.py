"""`ObjectiveScorer`: HOTA, group_F1_hull and their mean, for tuning and rewards that score one truth again and again.

The scores equal those of `tracking.scoring.evaluate`. The truth's side comes from the same `Scorer` and is prepared
once. Pairs of people, HOTA and the matching of groups are functions of tracking.scoring. Only three steps are replaced
by compiled ones: shapes of derived groups (`derived_outlines`), overlaps of hulls and people inside hulls
(`hull_overlaps`). Where rounding could change a result, the exact functions of tracking.scoring decide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from sim.types import Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.objective.derived_outlines import derived_outlines
from tracking.objective.hull_overlaps import GroupOutlines, count_inside, found_pairs
from tracking.scoring.candidate_pairs import FOUND
from tracking.scoring.evaluation import Scorer, objective_of
from tracking.scoring.group_and_event_scores import ComparedSides, tracked_groups
from tracking.scoring.group_scores import f1, matched_groups
from tracking.scoring.hota import hota
from tracking.scoring.one_plane import in_one_plane
from tracking.scoring.people_and_groups import Surface, bare_groups, hulls_of
from tracking.scoring.people_comparison import Similarity, people_pairs
from tracking.scoring.rows import FrameRows


class ObjectiveScorer:
    """Computes the objective (mean of HOTA and group_F1_hull) of any number of trackers against one truth.

    Made from that Truth and the similarity of people, None by the data. State: scorer, a `Scorer` of the truth, which
    must not change; _outlines, a dict of the
    outlines of the true groups by surface ("ground" or "image") used so far, None where the truth has no group shapes.
    """

    def __init__(self, truth: Truth, similarity: Similarity | None = None) -> None:
        self.scorer, self.similarity = Scorer(truth), similarity
        self._outlines: dict[Surface, GroupOutlines | None] = {}

    def scores(self, tracks: Sequence[Tracks], px_per_m: float, pixels: bool = False) -> dict[str, float]:
        """Returns a dict of HOTA, group_F1_hull and objective over the frames 1 … last, the frame of the last `Tracks`.

        The objective is the mean of the other two; if one is nan the other, if both are nan nan. tracks: one tracker's,
        sorted by frame, no id twice in a frame (not checked); without any, HOTA and objective are 0 and group_F1_hull
        is nan. px_per_m: scale for deriving groups in the image; nan takes the truth's. pixels: the tracker works on
        pictures. The result equals `evaluate(truth, with_groups(tracks, fps, px_per_m), frames=last)` under these keys.
        A score is nan where it is nan there: HOTA for a tracker of whole groups, group_F1_hull without labelled groups
        or shapes.

        Raises IncomparableError if boxes or positions to be compared are missing, and InputError if groups must be
        derived in the image and the scale is 0 or less.
        """
        truth = self.scorer.truth
        (moved,), similarity = in_one_plane(truth, [tracks], [pixels], self.similarity)
        if moved is not tracks:
            judge = self if self.scorer.judge(tracks, moved) is self.scorer else self.of_feet
            (tracks,), _ = in_one_plane(truth, [with_groups(tracks, truth.fps, px_per_m)], [pixels], similarity)
            return judge._compared(tracks, similarity, px_per_m)
        return self._compared(tracks, similarity, px_per_m)

    @cached_property
    def of_feet(self) -> ObjectiveScorer:
        """The scorer of tracks that were moved to the ground by their boxes."""
        return ObjectiveScorer(self.scorer.of_feet.truth, self.similarity)

    def _compared(self, tracks: Sequence[Tracks], similarity: Similarity, px_per_m: float) -> dict[str, float]:
        last = tracks[-1].index if tracks else 0
        inside = self.scorer.scored(last)
        sides = self.scorer.sides([t for t in tracks if inside[t.index]], inside)
        found = {"HOTA": float("nan"), "group_F1_hull": float("nan")}
        if not sides.groups_only:
            found["HOTA"] = hota(people_pairs(sides, similarity))["HOTA"]
        true = self._true_outlines(sides.surface) if sides.frames.any() else None
        if true is not None:
            true, est = true.until(last), _tracked_outlines(sides, tracks, px_per_m)
            matched = matched_groups(true.pos, est.pos, found_pairs(true, est), FOUND)
            found["group_F1_hull"] = f1(len(matched.i), len(true), len(est))
        return {**found, "objective": objective_of(found)}

    def _true_outlines(self, surface: Surface) -> GroupOutlines | None:
        """Returns the outlines of all true groups of labelled frames, None if the truth has no group shapes on the
        surface. Computed once per surface ("ground" or "image") and kept."""
        if surface not in self._outlines:
            true = self.scorer.groups(surface)
            self._outlines[surface] = GroupOutlines.of(true.groups) if true.comparable else None
        return self._outlines[surface]


def _tracked_outlines(sides: ComparedSides, tracks: Sequence[Tracks], px_per_m: float) -> GroupOutlines:
    """Returns the outlines of the tracker's groups that are scored, in labelled frames; groups are derived if the
    tracker reports none.

    sides: the truth's and the tracker's data in the scored frames. tracks: of all frames up to the last. px_per_m:
    scale for deriving groups in the image; if not finite the truth's is taken. Derived groups have two or more people.
    Raises InputError if groups must be derived in the image and the scale is 0 or less.
    """
    fps = sides.truth.fps
    px_per_m = px_per_m if np.isfinite(px_per_m) else sides.truth.px_per_m
    if not tracks:
        return GroupOutlines.of(tracked_groups(sides).counted)
    if all(t.unit == "group" for t in tracks):
        return _whole_outlines(sides)
    people_only = not any(t.unit == "group" or t.derived or t.groups is not None for t in tracks)
    people_only = people_only and len({t.box is None for t in tracks if len(t.id)}) < 2
    if people_only and (tracks[0].plane != "image" or px_per_m > 0):
        return derived_outlines(tracks, fps, px_per_m, sides.frames)
    return GroupOutlines.of(tracked_groups(replace(sides, tracks=with_groups(tracks, fps, px_per_m))).counted)


def _whole_outlines(sides: ComparedSides) -> GroupOutlines:
    """Returns the outlines of groups that are tracked as wholes (unit "group"), in labelled frames.

    sides: the truth's and the tracker's data in the scored frames. Groups with exactly one true person inside the hull
    or within 0.3 m of it are left out; groups with nobody inside stay. If the truth has no positions on the surface,
    all groups stay.
    """
    reported = [(t.index, t.groups) for t in sides.tracks if sides.frames[t.index] and t.groups is not None]
    frame = np.repeat(np.array([index for index, _ in reported], np.int64), [len(g.id) for _, g in reported])
    pos = np.concatenate([np.zeros((0, 2)), *(g.pos[:, :2] for _, g in reported)])
    groups = bare_groups(
        FrameRows(frame, np.arange(len(frame))), pos, tuple(h for _, g in reported for h in hulls_of(g))
    )
    positions = sides.true.positions_on(sides.surface, "ground")
    if positions is None:
        return GroupOutlines.of(groups.keep(groups.count != 1))
    outlines = GroupOutlines.of(groups)
    count = count_inside(outlines, groups, sides.true.rows, positions, sides.scale)
    return outlines if (count != 1).all() else GroupOutlines.of(groups.keep(count != 1))
