"""Where a truth and the tracks of any number of runs are compared: on the ground, or in the image.

This is a property of the data, so that the scores of any number of runs can be laid side by side.
Calibrated data (positions on the ground, or boxes and a camera) are compared on the ground, with the true positions if
they are known. Boxes are moved to where the bodies stand that have them (`sim.scene.standing`).
Other data are compared by overlap of boxes if everybody has one, else by position in the image. Tracks from pixels are
never projected to the ground, as a blob's foot is no person's: with such a run, all runs of calibrated data are
compared in the image.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sim.scene.standing import standing_points
from sim.truth.group_hulls import groups_over_time
from sim.types import Tracks, Truth
from tracking.grouping.foot_points import boxed, can_stand, completed, standing
from tracking.grouping.grouped_tracks import groups_in_frames, moved_events
from tracking.scoring.people import IncomparableError, Similarity


def plane_of(truth: Truth, tracks: Sequence[Tracks]) -> str:
    """Returns the plane of one tracker's positions: "ground", "space" or "image"; without `Tracks`, the truth's."""
    own = "image" if truth.pos is None else "ground"
    return next((t.plane for t in tracks if len(t.id)), tracks[0].plane if tracks else own)


def grounded(truth: Truth) -> Truth:
    """Returns the truth with people where their boxes stand and groups derived there, if it has boxes and a camera but
    no `pos`. Groups are derived only if it has groups. Any other truth is returned unchanged."""
    if truth.pos is not None or truth.box is None or truth.camera is None:
        return truth
    pos = standing_points(truth.box, truth.camera, truth.scene)
    there = np.isfinite(pos).all(axis=1)
    rows = (truth.frame[there], truth.id[there], truth.group[there], pos[there], np.full_like(pos[there], np.nan))
    labelled = truth.groups is not None or truth.groups_px is not None
    groups = tuple(groups_over_time(*rows, 1, truth.length)) if labelled else None
    return truth.replace(pos=pos, vel=None, groups=groups)


def in_one_plane(
    truth: Truth, runs: Sequence[Sequence[Tracks]], sources: Sequence[str | None], similarity: Similarity | None = None
) -> tuple[list[Sequence[Tracks]], Similarity]:
    """Returns the tracks of all runs of one sequence in one plane, and the similarity of people to use for all.

    truth: as `grounded` returns it. sources: of each run, as `source_of` returns it. similarity: returned as it is
    unless None, which chooses it by the data. Raises IncomparableError if a run on the ground must be moved to the
    image but has no boxes of people.
    """
    ground = _meet_on_ground(truth, runs, sources, similarity)
    moved = [
        _on_ground(truth, run) if ground else _in_image(truth, run, own) for run, own in zip(runs, sources, strict=True)
    ]
    if similarity is not None:
        return moved, similarity
    if ground:
        return moved, "ground"
    by_overlap = truth.camera is None and truth.box is not None and all(boxed(run) for run in runs)
    return moved, "boxes" if by_overlap else "image"


def stands(truth: Truth, run: Sequence[Tracks], source: str | None, similarity: Similarity | None) -> bool:
    """Returns True if `in_one_plane` returns a run, compared alone, as `standing` moves it to the ground."""
    return _meet_on_ground(truth, [run], [source], similarity) and can_stand(run, truth.camera)


def _meet_on_ground(
    truth: Truth, runs: Sequence[Sequence[Tracks]], sources: Sequence[str | None], similarity: Similarity | None
) -> bool:
    if similarity in (None, "boxes"):
        return truth.pos is not None and all(
            plane_of(truth, run) != "image" or can_stand(run, truth.camera, own)
            for run, own in zip(runs, sources, strict=True)
        )
    return similarity == "ground"


def _on_ground(truth: Truth, run: Sequence[Tracks]) -> Sequence[Tracks]:
    if truth.camera is None or not can_stand(run, truth.camera):
        return run
    return standing(run, truth.camera, truth.scene)


def _in_image(truth: Truth, run: Sequence[Tracks], source: str | None) -> Sequence[Tracks]:
    flat = plane_of(truth, run) == "image"
    if flat and not can_stand(run, truth.camera, source):
        return run
    if not (flat or boxed(run)):
        what = "groups without people" if any(t.unit == "group" for t in run) else "people without boxes"
        raise IncomparableError(f"labels or runs in the image (px), and one on the ground (m) with {what}")
    known = completed(run, truth.fps, truth.px_per_m, camera=truth.camera, scene=truth.scene)[0]
    return known if flat else [_track_in_image(t) for t in known]


def _track_in_image(t: Tracks) -> Tracks:
    box = np.zeros((0, 4)) if t.box is None else t.box
    middle, none = box[:, :2] + box[:, 2:] / 2, np.full((len(box), 2), np.nan)
    moved = t.replace(plane="image", pos=middle, vel=none, events=moved_events(t.events, t.id, middle))
    return moved.replace(groups=groups_in_frames([moved])[0])
