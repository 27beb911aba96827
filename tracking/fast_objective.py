"""The objective computed quickly and repeatedly on one truth, for tuning; equal to that of tracking.scoring.evaluation.

`ObjectiveScorer`: HOTA, group_F1 and their mean, for tuning and rewards that score one truth again and again.

The scores equal those of `tracking.scoring.evaluate`, by the same functions of tracking.scoring. The truth's side is
prepared once. Only one step is replaced: of groups that must be derived from tracks, only the members are computed
(`_derived_groups`), without hulls, ids and events.

Also here: members of the groups that the default grouping derives from tracked people, without shapes, ids and events.

The groups are those of `tracking.grouping.grouped_tracks.derive`, in the same frames and with the same members.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim.types import Ints, Tracks, Truth
from tracking.grouping.belief import default_belief
from tracking.grouping.foot_points import depth_as_measured, ground_below
from tracking.grouping.grouped_tracks import names_groups, with_groups
from tracking.grouping.grouping_choice import groups_now
from tracking.grouping.tracks_table import tabulate
from tracking.scoring.evaluation import Scorer, objective
from tracking.scoring.group_and_event_scores import ComparedSides, tracked_groups
from tracking.scoring.group_scores import f1, groups_found, shared_members
from tracking.scoring.matching import mapped_people
from tracking.scoring.people_and_groups import GroupRows
from tracking.scoring.people_comparison import Similarity, in_one_plane, people_pairs
from tracking.scoring.rows import FrameRows, find_rows
from tracking.scoring.track_scores import weighted_hota
from tracking.scoring.weighted_sums import unweighted


class ObjectiveScorer:
    """Computes the objective (mean of HOTA and group_F1) of any number of trackers against one truth.

    State: scorer, a `Scorer` of the truth, which must not change.
    """

    def __init__(self, truth: Truth) -> None:
        self.scorer = Scorer(truth)

    def scores(
        self, tracks: Sequence[Tracks], px_per_m: float, source: str | None = None, similarity: Similarity | None = None
    ) -> dict[str, float]:
        """Returns HOTA, group_F1 and objective, by key, of tracks sorted by frame.

        Scored are the frames from 1 to the last of the tracks. px_per_m: image scale for deriving groups; nan takes the
        truth's. source: what the tracker works on, an `InputKind`; None: unknown. A score is nan where that of
        `evaluate` is.
        """
        (moved,), similarity = in_one_plane(self.scorer.truth, [tracks], [source], similarity)
        scorer, last = self.scorer.judge(tracks, moved), tracks[-1].index if tracks else 0
        inside = scorer.scored(last)
        sides = scorer.sides([t for t in moved if inside[t.index]], inside)
        found = {"HOTA": float("nan"), "group_F1": float("nan")}
        if not sides.groups_only:
            pairs = people_pairs(sides, similarity)
            found["HOTA"] = unweighted(weighted_hota(pairs, pairs.size), pairs.size)["HOTA"]
        if sides.frames.any():
            mapping = sides.mapping if sides.groups_only else mapped_people(pairs)
            if sides.surface == "ground" and not names_groups(moved):
                camera = ground_below(moved, scorer.truth.camera, px_per_m, source).camera
                moved = moved if camera is None else depth_as_measured(moved, camera)
            found["group_F1"] = _group_f1(scorer, replace(sides, mapping=mapping), moved, px_per_m)
        mean = objective(*(np.array([score]) for score in found.values()))
        return {**found, "objective": float(mean[0])}


def _group_f1(scorer: Scorer, sides: ComparedSides, tracks: Sequence[Tracks], px_per_m: float) -> float:
    found = _tracked_members(sides, tracks, px_per_m)
    if found is None:
        return float("nan")
    est, person = found
    true, people = scorer.groups(sides.surface).groups, scorer.people.rows
    # the true groups of all frames stand on this side: groups of later frames share nobody with tracked ones
    row = np.append(np.flatnonzero(sides.inside[people.frame]), -1)
    shared = shared_members(true, est, row[person], len(people))
    return f1(int(groups_found(true, est, shared).sum()), int(sides.frames[true.rows.frame].sum()), len(est))


def _tracked_members(sides: ComparedSides, tracks: Sequence[Tracks], px_per_m: float) -> tuple[GroupRows, Ints] | None:
    """Returns the tracker's scored groups, and the true person of each membership, -1 none; None if unknown."""
    fps = sides.truth.fps
    px_per_m = px_per_m if np.isfinite(px_per_m) else sides.truth.px_per_m
    named, given = names_groups(tracks), [t.groups is not None for t in tracks]
    unscaled = sides.surface == "image" and not np.isfinite(px_per_m)
    if not (sides.groups_only or unscaled or (named and all(given))):
        if not (named and any(given)):
            return _derived_groups(sides, tracks, px_per_m)
        sides = replace(sides, tracks=with_groups(tracks, fps, px_per_m))
    tracked = tracked_groups(sides)
    return (tracked.counted, tracked.person) if tracked.known else None


def _derived_groups(sides: ComparedSides, tracks: Sequence[Tracks], px_per_m: float) -> tuple[GroupRows, Ints]:
    """Returns the groups of two or more that the default grouping derives, and the true person of each membership."""
    fps = sides.truth.fps
    table = tabulate(tracks, fps, px_per_m)
    # a label for each row, equal for members of one group in a frame, -1 alone
    group = table.group if names_groups(tracks) else groups_now(table, fps, default_belief())
    order = np.lexsort((group, table.frame))
    order = order[(group[order] >= 0) & sides.frames[table.frame[order] + 1]]
    frame, label = table.frame[order], group[order]
    new = np.diff(frame, prepend=-1).astype(bool) | np.diff(label, prepend=-1).astype(bool)
    number = np.cumsum(new) - 1
    several = np.bincount(number, minlength=1)[number] > 1
    order, new = order[several], new[several]
    of, first = np.cumsum(new) - 1, np.flatnonzero(new)
    rows = FrameRows(table.frame[order][first] + 1, of[first])
    member = find_rows(sides.est.rows, FrameRows(table.frame[order] + 1, table.id[order]))
    groups = GroupRows(rows, np.full((len(rows), 2), np.nan), (np.zeros((0, 2)),) * len(rows), of, member)
    return groups, np.where(member >= 0, np.append(sides.mapping, -1)[member], -1)
