"""Boxes that are tracked in the image, as people on the ground: `standing` moves the tracks to where the boxes stand,
and `completed` derives groups and events there. The ground is that of the camera, or of the boxes (`ground_of_boxes`).

Distances between people are those of the ground, in m, and not px divided by one scale for near and far people. Boxes
from pixels show the ground as those of detectors do, and groups are derived there; but the tracks themselves stay in
the image, as the foot of a blob is no person's.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from sim.scene.standing import standing_points
from sim.types import Array, Camera, Scene, Tracks
from tracking.grouping.ground_of_boxes import Ground, ground_of_boxes
from tracking.grouping.grouped_tracks import GroupsSoFar, groups_in_frames, moved_events, names_groups, with_groups
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.tracks_table import TracksTable, tabulate

FEETLESS = ("pixels", "stereo", "pixels and boxes")  # Inputs of trackers whose tracks stay in the image.


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
    source: what the tracker worked on, an `InputKind`; None: unknown."""
    return camera is not None and source not in FEETLESS and boxes_stand(tracks)


def boxes_stand(tracks: Sequence[Tracks]) -> bool:
    """Returns True if tracks are people in the image whose boxes end near their feet."""
    return plane_of_run(tracks) == "image" and boxed(tracks)


def ground_below(
    tracks: Sequence[Tracks], camera: Camera | None, px_per_m: float, image_size: tuple[int, int] | None = None
) -> Ground:
    """Returns the ground on which the boxes of tracks stand: by the camera if known, else by the first boxes.

    The boxes are used only if the tracker names no groups. The ground is unknown for tracks that lack boxes or lie on
    the ground.
    """
    if not boxes_stand(tracks):
        return Ground()
    if camera is not None or names_groups(tracks):
        return Ground(camera)
    return ground_of_boxes(tracks, px_per_m, image_size)


def completed(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: Grouping | None = None, *, camera: Camera | None,
    scene: Scene | None, image_size: tuple[int, int] | None = None, objective: bool = False,
) -> tuple[tuple[Tracks, ...], Ground]:  # fmt: skip
    """Returns the tracks with groups and events filled in, and the ground that was used for them.

    If the ground under the boxes is known (`ground_below`), groups are derived from positions there, else as
    `with_groups` does. image_size: width, height, px; None: unknown. objective: as of `derive`.
    """
    if all(t.derived for t in tracks):
        return tuple(tracks), Ground()
    ground = ground_below(tracks, camera, px_per_m, image_size)
    if ground.camera is None:
        return with_groups(tracks, fps, px_per_m, rule, objective=objective), ground
    groups = GroupsSoFar(fps, 1.0, rule, objective=objective, places=partial(places_on, ground, scene))
    return tuple(groups.ended(groups.add(tracks))), ground


def people_in_metres(
    tracks: Sequence[Tracks], fps: float, px_per_m: float, *, camera: Camera | None, scene: Scene | None,
    image_size: tuple[int, int] | None = None,
) -> TracksTable:  # fmt: skip
    """Returns the table of people at the places from which `completed` derives groups; arguments as there."""
    ground = ground_below(tracks, camera, px_per_m, image_size)
    if ground.camera is None:
        return tabulate(tracks, fps, px_per_m)
    return tabulate(tracks, fps, 1.0, places_on(ground, scene, tracks))


def places_on(ground: Ground, scene: Scene | None, tracks: Sequence[Tracks]) -> Array:
    """Returns the points on a known ground (R, 2), m, of all rows of tracks. Boxes that show the ground tell no place
    in the scene."""
    assert ground.camera is not None
    return standing_points(_boxes(tracks), ground.camera, scene if ground.source == "camera" else None)


def _boxes(tracks: Sequence[Tracks]) -> Array:
    """Returns the boxes (R, 4) of all rows, nan where a frame has none."""
    boxes = [np.full((len(t.id), 4), np.nan) if t.box is None else t.box for t in tracks]
    return np.concatenate([np.zeros((0, 4)), *boxes])


def standing(tracks: Sequence[Tracks], camera: Camera, scene: Scene | None) -> list[Tracks]:
    """Returns tracks of boxes in the image as tracks on the ground, at the points where the boxes stand. Velocities
    become nan. Groups that the tracker named are kept, with new shapes; other `groups` become None."""
    ground = standing_points(_boxes(tracks), camera, scene)
    cuts = np.cumsum([0, *(len(t.id) for t in tracks)]).tolist()
    moved = [
        t.replace(
            plane="ground", pos=ground[a:b], vel=np.full((b - a, 2), np.nan),
            events=moved_events(t.events, t.id, ground[a:b]),
        ) for t, (a, b) in zip(tracks, pairwise(cuts), strict=True)
    ]  # fmt: skip
    named = [t.groups is not None or bool((t.group >= 0).any()) for t in moved]
    every = groups_in_frames(moved) if any(named) else [None] * len(moved)
    return [t.replace(groups=groups if own else None) for t, groups, own in zip(moved, every, named, strict=True)]
