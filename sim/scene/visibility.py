"""How much of each person a camera sees, computed from geometry alone, whether or not images are drawn.

Each silhouette (body and head or limbs, `sim.scene.body`) is sampled on a grid over its amodal box. A sample is visible
if it meets three conditions: it lies in the image; no nearer silhouette covers it; its line of sight meets no wall,
pillar, step, box or thing first. `sim.scene.body.occlusion_distance` orders people from near to far. A wall hides
people beyond its line. A pillar hides people further away than the tangent to it. Stairs and boxes hide if the ray
meets them before the upright plane through the person that faces the camera. Things (an umbrella, a car) hide if the
ray through the sample meets one of their ellipsoids before all of the person's. Seen from above, people are hidden by
people and things alone.

Who is visible in a recording follows from the boxes alone: each is taken for an upright person of `sim.scene.body`
whose body and head fill it. Of two people, the one whose box ends lower in the image is the nearer (flat ground, a
level camera). Only labelled people hide people here: walls and other objects are unknown.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.elementary import inverse_3x3
from sim.scene import body
from sim.scene.body import Ellipsoids, Outlines, RecordedBodies
from sim.scene.raycast import PixelRays, pixel_rays, solids_of, stairs_and_boxes, unprojection
from sim.types import Array, Camera, Ints, Scene, Truth


class BodyVisibility(NamedTuple):
    """What a camera sees of R people, one row each."""

    # (R, 4) left, top, width, height in px of the whole body, hidden parts included, not clipped to the image; nan if
    # the person is not wholly in front of a pinhole camera
    box: Array
    visibility: Array  # (R,) visible share of the whole silhouette, 0 to 1; 0 where the box is nan
    truncation: Array  # (R,) share of the silhouette outside the image, 0 to 1; 1 where the box is nan
    visible_box: Array  # (R, 4) left, top, width, height in px of the visible part; nan if nothing is visible


class Hiders(NamedTuple):
    """Things that hide people: S rows, and the lines of sight and bodies that decide which is met first."""

    first: Ints  # (F,) first row of each frame of people; `end` (F,): the last + 1
    end: Ints
    box: Array  # (S, 4) px
    centre: Array  # (S, K, 3) m
    inverse: Array  # (S, K, 3, 3) inverse shapes, 1/m²
    own_centre: Array  # (R, J, 3) m: of the people
    own_inverse: Array  # (R, J, 3, 3) 1/m²
    rays: PixelRays


def _hiders(camera: Camera, frame: Ints, shapes: Ellipsoids, things: RecordedBodies) -> Hiders:
    frames = frame[frame_starts(frame)[:-1]]
    first, end = (np.searchsorted(things.frame, frames, side) for side in ("left", "right"))
    box = body.outline_boxes(body.outlines(camera, things.shapes))
    return Hiders(
        first, end, box, things.shapes.centre, inverse_3x3(things.shapes.shape),
        shapes.centre, inverse_3x3(shapes.shape), pixel_rays(camera),
    )  # fmt: skip


def measure_visibility(
    camera: Camera, scene: Scene, frame: Ints, pos3: Array, height: Array, shapes: Ellipsoids,
    things: RecordedBodies | None = None,
) -> BodyVisibility:  # fmt: skip
    """Returns what the camera sees of R people in any number of frames, exact to about 1/300.

    frame (R,): sorted; people of one frame hide each other. pos3 (R, 3): feet, m. height (R,): m. shapes: their bodies.
    things: what else hides people, but is nobody. Lens distortion is ignored.
    """
    from sim.scene.visibility_kernels import sample_visibility

    ellipses = body.outlines(camera, shapes)
    box, solids, has_eye = body.outline_boxes(ellipses), solids_of(scene), camera.kind == "pinhole"
    hides, others = has_eye and len(solids.walls) + len(solids.pillars) > 0, stairs_and_boxes(solids)
    visibility, truncation, visible_box = sample_visibility(
        frame_starts(frame), box, np.ascontiguousarray(ellipses.centre), body.packed_inverse(ellipses.shape),
        body.occlusion_distance(camera, pos3, height), pos3[:, :2].copy(), np.array(camera.image, dtype=float),
        np.array(camera.position, dtype=float), unprojection(camera), solids if hides else None,
        others if has_eye and len(solids.flights) + len(solids.boxes) > 0 else None,
        None if things is None else _hiders(camera, frame, shapes, things),
    )  # fmt: skip
    return BodyVisibility(box, visibility, truncation, visible_box)


def frame_starts(frame: Ints) -> Ints:
    """Returns the index of the first row of each of the F frames in frame (R,), which is sorted; then R. (F + 1,)."""
    return np.concatenate([[0], np.flatnonzero(np.diff(frame)) + 1, [len(frame)]]).astype(np.int64)


def with_visibility(truth: Truth, image_size: tuple[int, int] | None) -> Truth:
    """Returns the truth with visibility, truncation and visible boxes estimated from its boxes.

    image_size: (width, height) px; None: the smallest image that holds all boxes. If the labels state visibilities
    (some below 1), these are kept. A truth without boxes, or with visible boxes, is returned unchanged.
    """
    if truth.box is None or truth.visible_box is not None or not len(truth.box):
        return truth
    from sim.scene.visibility_kernels import sample_visibility

    size = np.array(image_size if image_size is not None else image_size_of_boxes(truth.box), dtype=float)
    ellipses = inscribed_outlines(truth.box)
    seen, truncation, visible_box = sample_visibility(
        frame_starts(truth.frame), np.array(truth.box), np.ascontiguousarray(ellipses.centre),
        body.packed_inverse(ellipses.shape), -(truth.box[:, 1] + truth.box[:, 3]), np.zeros((len(truth.box), 2)), size,
        np.zeros(3), np.eye(3), None, None, None,
    )  # fmt: skip
    labelled = bool((truth.visibility < 1).any())
    return truth.replace(
        visibility=truth.visibility if labelled else seen, truncation=truncation, visible_box=visible_box
    )


def inscribed_outlines(box: Array) -> Outlines:
    """Returns the outlines of body and head of N people who fill the boxes (N, 4), left, top, width, height in px."""
    left, top, width, height = box.T
    middle = left + width / 2
    centre, shape = np.empty((len(box), 2, 2)), np.zeros((len(box), 2, 2, 2))
    for k, part, half_width in (
        (body.BODY_PART, body.BODY, 0.5),
        (body.HEAD_PART, body.HEAD, body.HEAD.across / body.SHOULDER_SHARE),
    ):
        centre[:, k] = np.stack([middle, top + (1.0 - part.centre) * height], axis=1)
        shape[:, k, 0, 0], shape[:, k, 1, 1] = np.square(half_width * width), np.square(part.up * height)
    return Outlines(centre, shape)


def image_size_of_boxes(*boxes: Array) -> tuple[int, int]:
    """Returns the (width, height) px of the smallest image that holds all known boxes (N, 4); (1, 1) without boxes."""
    far = np.concatenate([np.zeros((0, 2)), *(box[:, :2] + box[:, 2:] for box in boxes)])
    width, height = np.ceil(far[np.isfinite(far).all(axis=1)].max(axis=0, initial=1.0))
    return int(width), int(height)
