"""Boxes of a scene: the rows of numbers by which kernels know them, and the check that nobody walks into one."""

from __future__ import annotations

import numpy as np

from scenarios.errors import InputError
from sim.elementary import PI, dot, turned, unit
from sim.scene.body import recorded_bodies
from sim.types import Array, Box, Motion, Scene

PATTERNS = ("grain", "plain", "stripes", "checks")
# Columns of `box_rows`: middle (3), unit vectors of the box's own axes (3 x 3), half sizes (3), half diagonal, index in
# PATTERNS, period (m), gloss, colour (3: blue, green, red).
MIDDLE, AXES, HALF, REACH, PATTERN, PERIOD, GLOSS, COLOUR = 0, 3, 12, 15, 16, 17, 18, 19
COLUMNS = 22


def box_axes(box: Box) -> Array:
    """Returns the unit vectors (3, 3) of the box's own x, y and z axis in the world, one a row."""
    (ct, st), (ca, sa) = unit(box.turn_deg / 180 * PI), unit(box.tilt_deg / 180 * PI)
    return np.array([[ct, st, 0.0], [-st * ca, ct * ca, -sa], [-st * sa, ct * sa, ca]])


def box_rows(scene: Scene) -> Array:
    """Returns the boxes of a scene as rows (B, 22) for the ray casting, lengths in m; columns MIDDLE …."""
    rows = np.zeros((len(scene.boxes), COLUMNS))
    for row, box in zip(rows, scene.boxes, strict=True):
        half = box.size / 2
        reach = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
        looks = [reach, PATTERNS.index(box.pattern), box.period, box.gloss, *box.colour[::-1]]
        row[:] = [*box.at, *box_axes(box).ravel(), *half, *looks]
    return rows


ROOM = 0.2  # m: radius of the balls along a person's axis that must be outside of boxes
BALLS = 16


def check_nobody_in_boxes(motion: Motion) -> None:
    """Raises InputError, naming the first person (by frame, then id) who walks or stands in a box of the scene."""
    if not motion.scene.boxes:
        return
    recorded = recorded_bodies(motion)
    up = ROOM + np.linspace(0.0, 1.0, BALLS) * (motion.height[recorded.id - 1, None] - 2 * ROOM)
    balls = np.repeat(recorded.pos3[:, None], BALLS, axis=1)
    balls[..., 2] += up
    inside = np.zeros((len(motion.scene.boxes), len(balls)), bool)
    for k, box in enumerate(motion.scene.boxes):
        out = np.maximum(np.abs(turned(box_axes(box), balls - box.at)) - box.size / 2, 0.0)
        inside[k] = (dot(out, out) < ROOM * ROOM).any(axis=1)
    rows = np.flatnonzero(inside.any(axis=0))
    if len(rows):
        row, k = rows[0], int(np.argmax(inside[:, rows[0]]))
        x, y = recorded.pos3[row, :2]
        raise InputError(
            file=f"scenario {motion.name}", place=f"world.boxes.{k} (seed {motion.seed})",
            got=f"person {recorded.id[row]} in it in frame {recorded.frame[row]} at ({x:.1f}, {y:.1f})",
            expected="nobody in a box, as people do not avoid boxes", remedy="move the box, or the ways of groups",
        )  # fmt: skip
