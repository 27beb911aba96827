"""How much of each person a camera sees, computed from geometry alone, whether or not images are drawn.

Each silhouette (body and head, `sim.scene.body`) is sampled on a grid over its amodal box. A sample is visible if it
meets three conditions: it lies in the image; no nearer silhouette covers it; its line of sight meets no wall, pillar or
step first. `sim.scene.body.occlusion_distance` orders people from near to far. A wall hides people beyond its line. A
pillar hides people further away than the tangent to it. Stairs hide if the ray meets a step before the upright plane
through the person that faces the camera. Seen from above, walls, pillars and stairs hide nobody.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.scene.body import Ellipsoids, occlusion_distance, outline_boxes, outlines, packed_inverse
from sim.scene.raycast import only_flights, solids_of, unprojection
from sim.types import Array, Camera, Ints, Scene


@dataclass(frozen=True)
class BodyVisibility:
    """What a camera sees of R people, one row each."""

    # (R, 4) left, top, width, height in px of the whole body, hidden parts included, not clipped to the image; nan if
    # the person is not wholly in front of a pinhole camera
    box: Array
    visibility: Array  # (R,) visible share of the whole silhouette, 0 to 1; 0 where the box is nan
    truncation: Array  # (R,) share of the silhouette outside the image, 0 to 1; 1 where the box is nan
    visible_box: Array  # (R, 4) left, top, width, height in px of the visible part; nan if nothing is visible


def measure_visibility(
    camera: Camera, scene: Scene, frame: Ints, pos3: Array, height: Array, shapes: Ellipsoids
) -> BodyVisibility:
    """Returns what the camera sees of R people in any number of frames, exact to about 1/300.

    frame (R,): sorted; people of one frame hide each other. pos3 (R, 3): feet. height (R,). Lens distortion is ignored.
    """
    from sim.scene.visibility_kernels import COLUMNS, ROWS, behind_stairs, sample_visibility

    ellipses = outlines(camera, shapes)
    box = outline_boxes(ellipses)
    solids = solids_of(scene)
    centre, inverse, pos = np.ascontiguousarray(ellipses.centre), packed_inverse(ellipses.shape), pos3[:, :2].copy()
    has_eye, eye, unproject = camera.kind == "pinhole", np.array(camera.position, dtype=float), unprojection(camera)
    behind = np.zeros((0, ROWS, COLUMNS), bool)
    if has_eye and len(solids.flights):
        behind = behind_stairs(box, centre, inverse, pos, eye, unproject, only_flights(solids.flights))
    hides = has_eye and len(solids.walls) + len(solids.pillars) > 0
    visibility, truncation, visible_box = sample_visibility(
        frame_starts(frame), box, centre, inverse, occlusion_distance(camera, pos3, height), pos,
        np.array(camera.image, dtype=float), eye, unproject, solids if hides else None, behind,
    )  # fmt: skip
    return BodyVisibility(box, visibility, truncation, visible_box)


def frame_starts(frame: Ints) -> Ints:
    """Returns the first row of each frame in sorted frame numbers (R,), then R: (F + 1,)."""
    return np.concatenate([[0], np.flatnonzero(np.diff(frame)) + 1, [len(frame)]]).astype(np.int64)
