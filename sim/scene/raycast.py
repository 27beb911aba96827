"""Inputs of the compiled ray casting: the solid things of a scene, and the lines of sight of a camera's pixels.

`sim.scene.raycast_kernels.first_hit` finds what a ray meets first among `Solids` and the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sim.scene.terrain import flight_rows
from sim.types import Array, Camera, Scene

NOTHING, GROUND, WALL, PILLAR, TREAD, RISER = range(6)  # what a ray meets: the hit's HIT_KIND
HIT_KIND, NORMAL_X, NORMAL_Y, NORMAL_Z, HIT_INDEX, HIT_PLACE = range(6)  # slots of `hit`
HIT_SLOTS = 6
X1, Y1, X2, Y2 = range(4)  # columns of Solids.walls
CENTRE_X, CENTRE_Y, RADIUS = range(3)  # columns of Solids.pillars


class Solids(NamedTuple):
    """The solid things of a scene, as the kernels take them; lengths in m.

    walls (W, 4): x1, y1, x2, y2; wall_height; pillars (P, 3): x, y, radius; pillar_height; flights (S, 9): see
    `sim.scene.terrain.flight_rows`.
    """

    walls: Array
    wall_height: float
    pillars: Array
    pillar_height: float
    flights: Array


@dataclass(frozen=True)
class PixelRays:
    """Lines of sight of a camera: pixel (u, v) looks from origin @ (u, v, 1) along direction @ (u, v, 1).

    origin, direction (3, 3). A direction has depth 1 m along the optical axis per unit.
    """

    origin: Array
    direction: Array


def solids_of(scene: Scene) -> Solids:
    """Return the walls, pillars and stairs of a scene for the kernels."""
    walls = np.array(scene.walls, dtype=float).reshape(-1, 4)
    pillars = np.array(scene.pillars, dtype=float)
    return Solids(walls, float(scene.wall_height), pillars, float(scene.pillar_height), flight_rows(scene))


def only_flights(flights: Array) -> Solids:
    """Return Solids with these flights of stairs (S, 9), without walls and pillars."""
    return Solids(np.zeros((0, 4)), 0.0, np.zeros((0, 3)), 0.0, flights)


def unprojection(camera: Camera) -> Array:
    """Return the matrix Rᵀ K⁻¹ (3, 3) that maps (u, v, 1) to a line of sight in the world; pinhole cameras only."""
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    inverse = np.array([[1 / fx, 0, -cx / fx], [0, 1 / fy, -cy / fy], [0, 0, 1]])
    return np.asarray(camera.rotation.T @ inverse)


def pixel_rays(camera: Camera) -> PixelRays:
    """Return a camera's lines of sight as linear functions of the pixel; lens distortion is ignored."""
    origin, direction = np.zeros((3, 3)), np.zeros((3, 3))
    origin[:, 2] = camera.position
    if camera.kind == "pinhole":
        return PixelRays(origin, np.ascontiguousarray(unprojection(camera)))
    right, down, forward = camera.rotation
    origin[:, 0], origin[:, 1] = right / camera.px_per_m, down / camera.px_per_m
    origin[:, 2] -= origin[:, :2] @ np.array(camera.centre_px)
    direction[:, 2] = forward
    return PixelRays(origin, direction)


def signed_scale(camera: Camera) -> float:
    """Return the image scale as the kernels take it.

    Pinhole: the focal length, px per m at a depth of 1 m. From above: minus px_per_m, the scale at any depth.
    """
    return float(camera.focal_px[0]) if camera.kind == "pinhole" else -camera.px_per_m
