"""Boxes that are tracked in the image, as people on the ground: `standing` moves the tracks to where the boxes stand,
and `completed` derives groups and events there. The ground is that of the camera, or of the boxes (`ground_of_boxes`).

Distances between people are those of the ground, in m, and not px divided by one scale for near and far people. Boxes
in the image from pixels are never moved, as the foot of a blob is no person's.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sim.scene.standing import standing_points
from sim.types import Array, Bools, Camera, GroupEvent, Ints, Scene, Tracks
from tracking.grouping.ground_of_boxes import Ground, ground_of_boxes
from tracking.grouping.grouped_tracks import (
    filled,
    groups_in_frames,
    labels_and_events,
    names_groups,
    with_groups,
    with_velocities,
)
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.tracks_table import TracksTable, tabulate

FEETLESS = ("pixels", "stereo")  # Inputs of trackers whose boxes do not end at people's feet.


def plane_of_run(tracks: Sequence[Tracks]) -> str | None:
    """Returns the plane of the first `Tracks` with people; without any, of the first `Tracks`; None for no `Tracks`."""
    return next((t.plane for t in tracks if len(t.id)), tracks[0].plane if tracks else None)


def boxed(tracks: Sequence[Tracks]) -> bool:
    """Returns True if all tracks follow people and have boxes; frames without tracks do not count."""
    return all(t.box is not None and t.unit == "person" for t in tracks if len(t.id))


def source_of(run: Iterable[Tracks] | None) -> str | None:
    """Returns what the tracker of a run worked on, an `InputKind`, by the run's `info`; None if it is unknown."""
    info = getattr(run, "info", {})
    return info.get("input") or ("pixels" if info.get("detections") == "image" else None)


def can_stand(tracks: Sequence[Tracks], camera: Camera | None, source: str | None = None) -> bool:
    """Returns True if tracks can be moved from the image to the ground: people with boxes, a camera, no pictures.
    source: as in `completed`."""
    return camera is not None and _stand(tracks, source)


def _stand(tracks: Sequence[Tracks], source: str | None) -> bool:
    return plane_of_run(tracks) == "image" and source not in FEETLESS and boxed(tracks)


def ground_below(
    tracks: Sequence[Tracks], camera: Camera | None, px_per_m: float, source: str | None = None,
    image_size: tuple[int, int] | None = None, moves: bool = False,
) -> Ground:  # fmt: skip
    """Returns the ground on which the boxes of tracks stand: by the camera if known, else by the first boxes.

    source, moves: as in `completed`. The boxes are used only if the tracker names no groups. The ground is unknown for
    tracks that lack boxes, come from pictures, or lie on the ground.
    """
    if moves or not _stand(tracks, source):
        return Ground()
    if camera is not None or names_groups(tracks):
        return Ground(camera)
    return ground_of_boxes(tracks, px_per_m, image_size)


def completed(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None, *, camera: Camera | None,
    scene: Scene | None, source: str | None = None, image_size: tuple[int, int] | None = None, objective: bool = False,
    moves: bool = False,
) -> tuple[tuple[Tracks, ...], Ground]:  # fmt: skip
    """Returns the tracks with groups and events filled in, and the ground that was used for them.

    If the ground under the boxes is known (`ground_below`), groups are derived from positions there, else as
    `with_groups` does. source: what the tracker worked on, an `InputKind`; None: unknown. image_size: width, height,
    px; None: unknown. objective: as of `derive`. moves: the camera was found to move, so that the ground is unknown.
    """
    if all(t.derived for t in tracks):
        return tuple(tracks), Ground()
    ground = ground_below(tracks, camera, px_per_m, source, image_size, moves)
    if ground.camera is None:
        return with_groups(tracks, fps, px_per_m, rule, objective=objective), ground
    places = _places(tracks, ground, scene)
    _, labels, events = labels_and_events(tracks, fps, 1.0, rule, objective=objective, places=places)
    there = [moved_events(new, t.id, t.pos) for t, new in zip(tracks, events, strict=True)]
    return tuple(filled(with_velocities(tracks, fps), labels, there, objective=objective)), ground


def people_in_metres(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, *, camera: Camera | None, scene: Scene | None,
    source: str | None = None, image_size: tuple[int, int] | None = None,
) -> TracksTable:  # fmt: skip
    """Returns the table of people at the places from which `completed` derives groups; arguments as there."""
    ground = ground_below(tracks, camera, px_per_m, source, image_size)
    if ground.camera is None:
        return tabulate(tracks, fps, px_per_m)
    return tabulate(tracks, fps, 1.0, _places(tracks, ground, scene))


def _places(tracks: Sequence[Tracks], ground: Ground, scene: Scene | None) -> Array:
    """Returns the points on a known ground (R, 2), m, of all rows. Boxes that show the ground tell no place in the
    scene."""
    assert ground.camera is not None
    return standing_points(_boxes(tracks), ground.camera, scene if ground.source == "camera" else None)


def _boxes(tracks: Sequence[Tracks]) -> Array:
    return np.concatenate([np.zeros((0, 4)), *(t.box for t in tracks if t.box is not None)])


def standing(tracks: Sequence[Tracks], camera: Camera, scene: Scene | None) -> list[Tracks]:
    """Returns tracks of boxes in the image as tracks on the ground, at the points where the boxes stand. Velocities
    become nan. Groups that the tracker named are kept, with new shapes; other `groups` become None."""
    ground = standing_points(_boxes(tracks), camera, scene)
    cuts = np.cumsum([0, *(0 if t.box is None else len(t.box) for t in tracks)]).tolist()
    moved = [
        t.replace(
            plane="ground", pos=ground[a:b], vel=np.full((b - a, 2), np.nan),
            events=moved_events(t.events, t.id, ground[a:b]),
        ) for t, (a, b) in zip(tracks, pairwise(cuts), strict=True)
    ]  # fmt: skip
    named = [t.groups is not None or bool((t.group >= 0).any()) for t in moved]
    every = groups_in_frames(moved) if any(named) else [None] * len(moved)
    return [t.replace(groups=groups if own else None) for t, groups, own in zip(moved, every, named, strict=True)]


def moved_events(events: Sequence[GroupEvent], id: Ints, pos: Array) -> tuple[GroupEvent, ...]:
    """Returns the events with each `pos` replaced by the mean position of its members in one frame, nan if none is. id
    (N,), pos (N, 2): ids and positions of the people in that frame."""
    return tuple(replace(e, pos=_centre(pos, np.isin(id, e.members))) for e in events)


def _centre(pos: Array, rows: Bools) -> tuple[float, float]:
    x, y = pos[rows].mean(axis=0) if rows.any() else (float("nan"), float("nan"))
    return float(x), float(y)
