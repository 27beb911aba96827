"""Where a person stands whose box is known: the inverse of the boxes of `sim.scene.body`.

A body has an extent, so that the lower edge of its box is not its place on the ground. The body that has the box is
found by least squares (Levenberg and Marquardt) over four unknowns: the image of its place, as shares of the box; its
height; the angle by which it is turned from the line of sight. A box counts by its middle, its upper and its lower
edge. Its width counts little, so that a box that no body has keeps its lower edge.

Two bodies have the same box: one is turned to the left, one to the right. The middle of their places is returned. It is
exact for people who face along or across the line of sight and under a camera that looks straight down. Else it is
wrong by 1 to 2 mm (median), and by at most 2 cm for 99 % of people who are seen from 3 to 12 m above.
"""

from __future__ import annotations

import numpy as np

from sim.scene.body import BODY, DEPTH_SHARE, HEAD, PERSON_HEIGHT, SHOULDER_SHARE
from sim.scene.camera import at_height, foot_points, project, rays, seen_ground, standing_share, to_ground
from sim.scene.terrain import height_at
from sim.types import Array, Camera, Scene

LEVELS, HALVINGS, ROUNDS = 65, 40, 4  # of the search for the height of the ground on stairs
# Body and head: height of the centre, squared half axes across, along the heading and up; of a person 1 m tall.
AXES = [[BODY.across * SHOULDER_SHARE, BODY.along * DEPTH_SHARE, BODY.up], [HEAD.across, HEAD.along, HEAD.up]]
PARTS = np.column_stack([[BODY.centre, HEAD.centre], np.square(AXES)])


STATURES = 1.0, 2.4  # m: half of the people are neither smaller nor taller. The kernel finds heights of 0.5 to 2.5 m.
SAMPLE = 1000  # boxes by which it is judged


def stature_doubt(box: Array, camera: Camera) -> str:
    """Returns a warning if most people with boxes (R, 4), px, would be too small or too tall by the camera; else ""."""
    some = box[:: len(box) // SAMPLE + 1]
    some = some[np.isfinite(foot_points(some, np.zeros(len(some)), camera)).all(axis=1)]
    if camera.kind == "top" or not len(some):
        return ""
    tall, (least, most) = np.median(_standing(some, np.zeros(len(some)), camera)[1]), STATURES
    if least <= tall <= most:
        return ""
    size = f"under {least:g}" if tall < least else f"over {most:g}"
    return (
        f"by --camera half of the people are {size} m tall: check its unit, m, its rotation, world to camera, and "
        "its position, which is no translation"
    )


def standing_points(box: Array, camera: Camera, scene: Scene | None = None) -> Array:
    """Returns the places x, y (R, 2), m, on the ground where upright people with boxes (R, 4) stand; nan where the foot
    of a box shows no ground. box: left, top, width, height of the whole body, px. scene: its stairs count."""
    share = np.array([0.5, standing_share(camera)])
    if camera.kind == "top":
        return seen_ground(camera, box[:, :2] + box[:, 2:] * share, scene)
    place = np.full((len(box), 2), np.nan)
    known = np.isfinite(to_ground(camera, box[:, :2] + box[:, 2:] * share)).all(axis=1)
    if scene is None or not scene.stairs:
        place[known], _ = _standing(box[known], np.zeros(int(known.sum())), camera)
        return place
    found, tall = _standing_on_stairs(np.concatenate([box[known]] * 2), camera, scene)
    (near, far), (h, h_far) = np.split(found, 2), np.split(tall, 2)
    taken = np.abs(h_far - PERSON_HEIGHT) < np.abs(h - PERSON_HEIGHT)
    place[known] = np.where(taken[:, None], far, near)
    return place


def _standing(box: Array, z: Array, camera: Camera) -> tuple[Array, Array]:
    """Returns the places (R, 2) and heights (R,) of the bodies with the boxes on ground of height z (R,), m."""
    from sim.scene.standing_kernels import bodies  # compiled code: few scores need it

    low, size = box[:, :2], np.maximum(box[:, 2:], 1e-6)
    lens = np.array([*camera.focal_px, *camera.centre_px, camera.radial])
    eye, turn = np.array(camera.position), np.array(camera.rotation)  # of one type, so that numba compiles once
    two = bodies(np.ascontiguousarray(low), size, z, lens, eye, turn, PARTS)
    a, b = (to_ground(camera, low + q[:, :2] * size, z) for q in two)
    return (a + b) / 2, (two[0, :, 2] + two[1, :, 2]) / 2


def _standing_on_stairs(box: Array, camera: Camera, scene: Scene) -> tuple[Array, Array]:
    """Returns places and heights as `_standing`: of the first half of the boxes on the first ground on the line of
    sight, of the second half on the last."""
    rises = [stairs.rise for stairs in scene.stairs]
    levels = np.linspace(max(0.0, *rises), min(0.0, *rises), LEVELS)
    last = np.arange(len(box)) >= len(box) // 2
    foot, standing = box[:, :2] + box[:, 2:] * [0.5, 1.0], (np.zeros((len(box), 2)), np.zeros(len(box)))
    for _ in range(ROUNDS):
        sight = rays(camera, foot)
        below = levels[:, None] <= height_at(scene, at_height(*sight, levels[:, None]))
        first = np.where(last, LEVELS - below[::-1].argmin(axis=0), below.argmax(axis=0))
        first = np.clip(first, 1, LEVELS - 1)
        high, low = levels[first - 1], levels[first]
        for _ in range(HALVINGS):
            z = (high + low) / 2
            under = z <= height_at(scene, at_height(*sight, z))
            high, low = np.where(under, high, z), np.where(under, z, low)
        standing = _standing(box, (high + low) / 2, camera)
        foot, _ = project(camera, np.column_stack([standing[0], (high + low) / 2]))
    return standing
