"""The scene from above: the rectangle of the ground that a plan shows, all people and objects with a margin, and the
drawing of objects on it."""

from __future__ import annotations

import math

import numpy as np

from sim.types import Array, Scene
from tracking.drawing.canvas import FLOOR, GRID, THING, WALL, Canvas

MARGIN = 1.0  # m: the least margin of a plan round people and objects.


def plan_area(scene: Scene | None, places: Array) -> tuple[Array, Array] | None:
    """Returns the lower left and the upper right corner (2,), m, of the ground to show, by the scene and the positions
    `places` (N, 2), m; None if there is no scene and no finite position."""
    places = _finite(places)
    if scene is not None:
        return _scene_area(scene, places)
    if not len(places):
        return None
    return places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN


def _scene_area(scene: Scene, places: Array) -> tuple[Array, Array]:
    objects = [places, scene.pillars[:, :2], scene.doors.reshape(-1, 2), scene.service]
    objects += [end[None] for flight in scene.stairs for end in (flight.foot, flight.head)]
    points = _finite(np.concatenate([np.asarray(each).reshape(-1, 2) for each in objects]))
    if not len(points):
        return np.zeros(2), scene.size
    low, high = points.min(axis=0) - 2 * MARGIN, points.max(axis=0) + 2 * MARGIN
    return np.maximum(low, np.minimum(0, low + MARGIN)), np.minimum(high, np.maximum(scene.size, high - MARGIN))


def _finite(points: Array) -> Array:
    return points[np.isfinite(points).all(axis=1)]


def draw_scene(canvas: Canvas, scene: Scene | None) -> None:
    """Draws grid lines and the fixed objects of a scene, in place."""
    span = float((canvas.high - canvas.low).max())
    step = 1.0 if span <= 30 else 5.0 if span <= 120 else 20.0
    for axis in (0, 1):
        for value in np.arange(math.ceil(canvas.low[axis] / step) * step, canvas.high[axis], step):
            ends = np.stack([canvas.low, canvas.high])
            ends[:, axis] = value
            canvas.line(ends, GRID, 1)
    if scene is None:
        return
    width, depth = scene.size
    canvas.line(np.array([[0, 0], [width, 0], [width, depth], [0, depth]]), THING, 2, closed=True)
    for flight in scene.stairs:
        ends, (along, across) = np.stack([flight.foot, flight.head]), flight.head - flight.foot
        side = np.array([-across, along]) / np.hypot(along, across) * flight.width / 2
        canvas.line(np.concatenate([ends - side, ends[::-1] + side]), THING, 2, closed=True)
    for wall in scene.walls:
        canvas.line(wall, WALL, 6)
    for door in scene.doors:
        canvas.line(door, FLOOR, 9)
    for x, y, radius in scene.pillars:
        canvas.disc(np.array([x, y]), radius * canvas.scale, THING)
    for at in scene.service:
        canvas.disc(at, 8, WALL, 2)
