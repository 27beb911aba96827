"""Shadows of people, whose bodies and heads are ellipsoids, in the light of the sun.

Computes where each person's shadow falls in an image (outlines, ranges of pixels, softness of the edge), and whether
solid things such as walls hide the sun from a person's feet, waist and head.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.render.people import DrawnPeople, ImageOutlines, image_outlines, pixel_bounds
from sim.scene.body import Ellipsoids, outlines, packed_inverse
from sim.scene.camera import project
from sim.scene.raycast import HIT_SLOTS, Solids
from sim.types import Array, Camera, Ints

LIT_HEIGHTS = (0.12, 0.5, 0.95)  # of the height: feet (they stand a step deep in drawn stairs), waist, head


@dataclass(frozen=True, eq=False)
class PeopleShadows:
    """Shadows of N people on the ground at their feet, two each; the second axis is body, head."""

    shape: Array  # (N, 2, 3) inverse of each shadow ellipse's 2 x 2 shape matrix, 1/m²: entries 11, 12, 22, in x and y
    softness: Array  # (N, 2) half the penumbra's width over the geometric mean of the ellipse's half axes, no unit
    # ImageOutlines of the shadows with their soft edges, and of the pixels on which they can fall
    outlines: ImageOutlines


def people_shadows(camera: Camera, people: DrawnPeople, sun: Array, penumbra: float, level: bool) -> PeopleShadows:
    """Returns the shadows of N people as a camera sees them.

    An ellipsoid with centre c and shape S casts on the plane at height z an ellipse with centre c - s (c_z - z)/s_z and
    shape P S Pᵀ. Here s is the unit vector `sun` (3,) to the sun, e_z the upward unit vector, and P = I - s e_zᵀ/s_z.
    penumbra: m. level: True if shadows can fall on level ground only.
    """
    along = np.eye(3) - np.outer(sun / sun[2], [0.0, 0.0, 1.0])
    shape = along @ people.shapes.shape @ along.T
    radius = np.linalg.det(shape[..., :2, :2]) ** 0.25
    softness = 0.5 * penumbra / radius
    foot = people.pos3[:, None, 2]
    middle = people.shapes.centre - sun / sun[2] * (people.shapes.centre[..., 2] - foot)[..., None]
    flat = shape * ((1 + softness) ** 2)[..., None, None]
    found = image_outlines(camera, outlines(camera, Ellipsoids(middle, flat)))
    if not level:
        found = ImageOutlines(found.middle, found.inverse, _bounds_up_to_head(camera, people, sun, flat))
    return PeopleShadows(packed_inverse(shape[..., :2, :2]), softness, found)


def _bounds_up_to_head(camera: Camera, people: DrawnPeople, sun: Array, flat: Array) -> Ints:
    half = np.sqrt(np.diagonal(flat, axis1=2, axis2=3))[..., :2]
    low_z, high_z = np.minimum(people.pos3[:, 2], 0.0), people.pos3[:, 2] + people.height
    corners = []
    for z in (low_z, high_z):
        middle = (
            people.shapes.centre[..., :2] - sun[:2] / sun[2] * (people.shapes.centre[..., 2] - z[:, None])[..., None]
        )
        for side in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            here = middle + half * side
            corners.append(np.concatenate([here, np.broadcast_to(z[:, None, None], (*here.shape[:2], 1))], axis=2))
    uv = project(camera, np.stack(corners, axis=1).reshape(-1, 3))[0].reshape(len(people.id), 16, 2)
    # A shadow that reaches behind the camera may be anywhere in the image.
    behind = np.asarray(np.isnan(uv).any(axis=(1, 2)))[:, None]
    return pixel_bounds(camera, np.where(behind, 0.0, uv.min(axis=1)), np.where(behind, camera.image, uv.max(axis=1)))


def sunlit_shares(solids: Solids, people: DrawnPeople, sun: Array) -> Array:
    """Returns (N, 3): 1 if the sun reaches a person's feet, waist and head (columns), 0 if a solid thing hides it."""
    lit = np.ones((len(people.id), 3))
    if not any(len(part) for part in solids if isinstance(part, np.ndarray)):
        return lit
    from sim.scene.raycast_kernels import first_hit

    hit = np.empty(HIT_SLOTS)
    for row, place, height in zip(lit, people.pos3, people.height, strict=True):
        for k, up in enumerate(LIT_HEIGHTS):
            row[k] = float(np.isinf(first_hit(place + np.array([0.0, 0.0, up * height]), sun, solids, hit)))
    return lit
