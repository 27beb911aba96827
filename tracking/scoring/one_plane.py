"""Puts the tracks of two runs into one plane, so that their scores have one unit and one surface and can be subtracted.

Foreground pixels are never projected to the ground, so the common plane of a run in the image and one on the ground is
the image. Tracks of people on the ground are moved there if they have boxes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sim.truth.group_hulls import box_groups
from sim.types import Array, Bools, Tracks, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.scoring.people_comparison import IncomparableError, Similarity, plane_of, usual_similarity


def in_one_plane(
    truth: Truth, first: Sequence[Tracks], second: Sequence[Tracks], similarity: Similarity | None = None
) -> tuple[Sequence[Tracks], Sequence[Tracks], Similarity]:
    """Returns the tracks of two runs of one sequence in one plane, and the similarity of people to use for both.

    first, second: one `Tracks` per frame. If one run lies in the image and the other on the ground, the latter is moved
    to the image; else both are returned as they are. similarity: is returned if given. None: "boxes" if the truth and
    both runs have them, else "image" or "ground", where both runs lie.

    Raises IncomparableError if one run lies in the image, and the other on the ground without boxes of people.
    """
    runs = [first, second]
    surfaces = ["image" if plane_of(truth, run) == "image" else "ground" for run in runs]
    if surfaces[0] != surfaces[1]:
        k = surfaces.index("ground")
        runs[k] = in_image(with_groups(runs[k], truth.fps, truth.px_per_m))
    both: Similarity = "image" if "image" in surfaces else "ground"
    boxes = all(usual_similarity(truth, run) == "boxes" for run in runs)
    return runs[0], runs[1], similarity or ("boxes" if boxes else both)


def in_image(tracks: Sequence[Tracks]) -> list[Tracks]:
    """Returns tracks of people on the ground as tracks in the image, at the centres of their boxes.

    tracks: with boxes and groups. Ids, groups and events stay; the hulls of groups are those of their members' boxes.
    Velocities are nan.

    Raises IncomparableError for tracks of whole groups, and for people without boxes.
    """
    if any(len(t.id) and (t.box is None or t.unit == "group") for t in tracks):
        what = "groups without people" if any(t.unit == "group" for t in tracks) else "people without boxes"
        raise IncomparableError(f"one run in the image (px), the other on the ground (m) with {what}")
    return [_in_image(t) for t in tracks]


def _in_image(t: Tracks) -> Tracks:
    box = np.zeros((0, 4)) if t.box is None else t.box
    middle, none = box[:, :2] + box[:, 2:] / 2, np.full((len(box), 2), np.nan)
    order = np.argsort(t.id)
    rows = (t.id[order], t.group[order], middle[order], none, box[order])
    groups = box_groups(np.full(len(box), t.index), *rows, t.index, 1)[0]
    events = tuple(replace(e, pos=_centre(middle, np.isin(t.id, e.members))) for e in t.events)
    return t.replace(plane="image", pos=middle, vel=none, groups=groups, events=events)


def _centre(middle: Array, rows: Bools) -> tuple[float, float]:
    x, y = middle[rows].mean(axis=0) if rows.any() else (float("nan"), float("nan"))
    return float(x), float(y)
