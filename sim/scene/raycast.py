"""Inputs of the compiled ray casting, in m: the solid things of a scene, and the lines of sight of a camera.

`Solids` holds walls, pillars and stairs. `PixelRays` holds two 3 x 3 matrices that give the line of sight of each image
point (u, v) px. `sim.scene.raycast_kernels.first_hit` finds what a ray meets first among `Solids` and the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sim.elementary import dot, product
from sim.scene.terrain import flight_rows
from sim.types import Array, Camera, Scene

NOTHING, GROUND, WALL, PILLAR, TREAD, RISER = range(6)  # what a ray meets: the hit's HIT_KIND
HIT_KIND, NORMAL_X, NORMAL_Y, NORMAL_Z, HIT_INDEX, HIT_PLACE = range(6)  # slots of `hit`
HIT_SLOTS = 6
X1, Y1, X2, Y2 = range(4)  # columns of Solids.walls
CENTRE_X, CENTRE_Y, RADIUS = range(3)  # columns of Solids.pillars


class Solids(NamedTuple):
    """The solid things of a scene, as the kernels take them; lengths in m.

    walls (W, 4)     x1, y1, x2, y2 of each wall's line on the ground
    wall_height      of all walls
    pillars (P, 3)   x, y, radius
    pillar_height    of all pillars
    flights (S, 9)   stairs: foot x, foot y (middle of the edge), unit axis x, unit axis y (from foot to head), length,
                     half width, rise of all steps together (negative if they go down), number of steps, landing
                     (length of the level part behind the head)
    """

    walls: Array
    wall_height: float
    pillars: Array
    pillar_height: float
    flights: Array


@dataclass(frozen=True)
class PixelRays:
    """Lines of sight of a camera: image point (u, v) px looks from origin @ (u, v, 1) along direction @ (u, v, 1).

    origin (3, 3)      its product is a point of the world, x, y, z in m
    direction (3, 3)   its product is a vector in the world, with depth 1 along the optical axis; not a unit vector
    """

    origin: Array
    direction: Array


def solids_of(scene: Scene) -> Solids:
    """Return the walls, pillars and stairs of a scene as Solids for the kernels, with 0 rows where there are none."""
    walls = np.array(scene.walls, dtype=float).reshape(-1, 4)
    pillars = np.array(scene.pillars, dtype=float)
    return Solids(walls, float(scene.wall_height), pillars, float(scene.pillar_height), flight_rows(scene))


def only_flights(flights: Array) -> Solids:
    """Return Solids with these flights of stairs (S, 9), rows of `terrain.flight_rows`, without walls and pillars."""
    return Solids(np.zeros((0, 4)), 0.0, np.zeros((0, 3)), 0.0, flights)


def unprojection(camera: Camera) -> Array:
    """Return the matrix Rᵀ K⁻¹ (3, 3) that maps (u, v, 1), u and v in px, to the direction of the line of sight in the
    world.

    R is the camera's rotation (world to camera), K its matrix of focal lengths and image centre. The direction has
    depth 1 along the optical axis. For pinhole cameras only; kind "top" is not refused, but the result has no meaning.
    Lens distortion is ignored.
    """
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    inverse = np.array([[1 / fx, 0, -cx / fx], [0, 1 / fy, -cy / fy], [0, 0, 1]])
    return product(camera.rotation.T, inverse)


def pixel_rays(camera: Camera) -> PixelRays:
    """Return the lines of sight of a camera, pinhole or from above, as two matrices that act on (u, v, 1); see
    PixelRays.

    Lens distortion is ignored.
    """
    origin, direction = np.zeros((3, 3)), np.zeros((3, 3))
    origin[:, 2] = camera.position
    if camera.kind == "pinhole":
        return PixelRays(origin, np.ascontiguousarray(unprojection(camera)))
    right, down, forward = camera.rotation
    origin[:, 0], origin[:, 1] = right / camera.px_per_m, down / camera.px_per_m
    origin[:, 2] -= dot(origin[:, :2], np.array(camera.centre_px))
    direction[:, 2] = forward
    return PixelRays(origin, direction)


def signed_scale(camera: Camera) -> float:
    """Return the image scale as the kernels take it; its sign tells the kind of camera.

    Kind "pinhole": the horizontal focal length in px, which is px per m at a depth of 1 m. Kind "top": minus px_per_m,
    the scale at any depth.
    """
    return float(camera.focal_px[0]) if camera.kind == "pinhole" else -camera.px_per_m
