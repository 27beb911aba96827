"""Inputs of the compiled ray casting, in m: the solid things of a scene, and the lines of sight of a camera.

`Solids` holds walls, pillars, stairs and boxes. `PixelRays` holds two 3 x 3 matrices that give the line of sight of
each image point (u, v) px. `sim.scene.raycast_kernels.first_hit` finds what a ray meets first among `Solids` and the
ground.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sim.elementary import dot, product
from sim.scene.boxes import box_rows
from sim.scene.terrain import flight_rows
from sim.types import Array, Camera, Scene

NOTHING, GROUND, WALL, PILLAR, TREAD, RISER, BOX = range(7)  # what a ray meets: the hit's HIT_KIND
HIT_KIND, NORMAL_X, NORMAL_Y, NORMAL_Z, HIT_INDEX, HIT_PLACE = range(6)  # slots of `hit`
HIT_SLOTS = 6
X1, Y1, X2, Y2 = range(4)  # columns of Solids.walls
CENTRE_X, CENTRE_Y, RADIUS = range(3)  # columns of Solids.pillars


class Solids(NamedTuple):
    """The solid things of a scene for the kernels, in m.

    walls (W, 4): x1, y1, x2, y2. pillars (P, 3): x, y, radius. flights (S, 9): stairs, as `terrain.flight_rows`.
    boxes (B, 22): as `boxes.box_rows`.
    """

    walls: Array
    wall_height: float
    pillars: Array
    pillar_height: float
    flights: Array
    boxes: Array


class PixelRays(NamedTuple):
    """Lines of sight of a camera, as two matrices (3, 3).

    Image point (u, v) px looks from the world point origin @ (u, v, 1), in m, along direction @ (u, v, 1).
    """

    origin: Array
    direction: Array


def solids_of(scene: Scene) -> Solids:
    """Returns the solid things of a scene for the kernels."""
    walls = np.array(scene.walls, dtype=float).reshape(-1, 4)
    pillars = np.array(scene.pillars, dtype=float)
    return Solids(
        walls, float(scene.wall_height), pillars, float(scene.pillar_height), flight_rows(scene), box_rows(scene)
    )


def stairs_and_boxes(solids: Solids) -> Solids:
    """Returns the stairs and boxes alone, without walls and pillars."""
    return solids._replace(walls=np.zeros((0, 4)), pillars=np.zeros((0, 3)))


def unprojection(camera: Camera) -> Array:
    """Returns Rᵀ K⁻¹ (3, 3) of a pinhole camera: it maps (u, v, 1) px to the direction of sight in the world."""
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    inverse = np.array([[1 / fx, 0, -cx / fx], [0, 1 / fy, -cy / fy], [0, 0, 1]])
    return product(camera.rotation.T, inverse)


def pixel_rays(camera: Camera) -> PixelRays:
    """Returns the lines of sight of a camera, without lens distortion."""
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
    """Returns px per m: at a depth of 1 m for a pinhole camera; with a minus sign for a camera of kind "top"."""
    return float(camera.focal_px[0]) if camera.kind == "pinhole" else -camera.px_per_m
