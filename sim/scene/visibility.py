"""How much of each person a camera sees, by geometry alone: whatever is rendered, this stands in the truth.

Each silhouette (body and head, sim.scene.body) is sampled on a grid over its amodal box. A sample is visible if it
lies in
the image and in no nearer silhouette, and if its line of sight meets no wall, pillar or step first. Order of people:
sim.scene.body.distance. A wall hides who stands beyond its line; a pillar who is further away than the tangent to it;
stairs whose steps are met before the upright plane through the person that faces the camera.
Seen from above nothing upright hides anybody.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.scene.body import Ellipsoids, distance, outline_boxes, outlines
from sim.scene.terrain import flights
from sim.types import Array, Camera, Ints, Scene


@dataclass(frozen=True)
class Seen:
    """R people: amodal box (R, 4) ltwh px, visibility (R,), truncation (R,), visible_box (R, 4), nan where hidden."""

    box: Array
    visibility: Array
    truncation: Array
    visible_box: Array


def look(camera: Camera, scene: Scene, frame: Ints, pos3: Array, height: Array, shapes: Ellipsoids) -> Seen:
    """What is seen of R people in frames `frame` (R,), sorted; who is behind the camera has a nan box and is unseen.

    visibility: visible share of the whole silhouette, the part outside the image counting as hidden;
    truncation: the share outside the image. Both to about 1/300 (the grid).
    """
    from sim.scene.visibility_kernels import look as sample

    ellipses = outlines(camera, shapes)
    box = outline_boxes(ellipses)
    starts = np.concatenate([[0], np.flatnonzero(np.diff(frame)) + 1, [len(frame)]]).astype(np.int64)
    visibility, truncation, visible_box = sample(
        starts,
        box,
        np.ascontiguousarray(ellipses.centre),
        packed_inverse(ellipses.shape),
        distance(camera, pos3, height),
        np.ascontiguousarray(pos3[:, :2]),
        np.array(camera.image, dtype=float),
        camera.kind == "pinhole",
        np.array(camera.position, dtype=float),
        unprojection(camera),
        np.array(scene.walls, dtype=float),
        scene.wall_height,
        np.array(scene.pillars, dtype=float),
        scene.pillar_height,
        (np.zeros((0, 4)), 0.0, np.zeros((0, 3)), 0.0, flights(scene)),
    )
    return Seen(box, visibility, truncation, visible_box)


def packed_inverse(shape: Array) -> Array:
    """E⁻¹ of symmetric (..., 2, 2) as (..., 3): its entries 11, 12, 22."""
    a, b, d = shape[..., 0, 0], shape[..., 0, 1], shape[..., 1, 1]
    return np.asarray(np.stack([d, -b, a], axis=-1) / (a * d - b * b)[..., None])


def unprojection(camera: Camera) -> Array:
    """(3, 3): (u, v, 1) → direction of sight in the world, Rᵀ K⁻¹; of use for pinhole cameras only."""
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    inverse = np.array([[1 / fx, 0, -cx / fx], [0, 1 / fy, -cy / fy], [0, 0, 1]])
    return np.asarray(camera.rotation.T @ inverse)
