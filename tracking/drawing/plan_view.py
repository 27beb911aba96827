"""Draws one frame of the truth on a canvas: the scene from above, trails, group hulls, people; for contact sheets.

The canvas is a plan in m, or the image plane in px where only boxes are labelled.

Also here: the rectangle of the ground that a plan shows: all people and objects of the scene, with a margin.
"""

from __future__ import annotations

import math

import cv2
import numpy as np

from sim.types import Array, Ints, Scene, Stairs, Truth
from tracking.drawing.canvas import (
    FLOOR,
    GRID,
    SHIFT,
    THING,
    TRAIL_SECONDS,
    WALL,
    Canvas,
    Colour,
    box_corners,
    colour,
    fixed_point,
    text,
)

MARGIN = 1.0  # m: the least margin of a plan round people and objects.


def plan_area(scene: Scene | None, places: Array) -> tuple[Array, Array] | None:
    """Returns the lower left and upper right corner (2,), m, of the ground to show; None if nothing is known."""
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


FOOTPRINT = 0.3  # m: radius of the disc that a group's hull keeps round each member.

# Directions, in px from a disc's centre, in which its id may be written; the first is preferred.
LABEL_DIRECTIONS = ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (1, 0), (-1, 0), (0, -1))


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
        _draw_stairs(canvas, flight)
    for wall in scene.walls:
        canvas.line(wall, WALL, 6)
    for door in scene.doors:
        canvas.line(door, FLOOR, 9)
    for x, y, radius in scene.pillars:
        canvas.disc(np.array([x, y]), radius * canvas.scale, THING)
    for at in scene.service:
        canvas.disc(at, 8, WALL, 2)


def _draw_stairs(canvas: Canvas, flight: Stairs) -> None:
    axis = flight.head - flight.foot
    across = np.array([-axis[1], axis[0]]) / np.hypot(*axis) * flight.width / 2
    for k in range(flight.steps + 1):
        middle = flight.foot + axis * k / flight.steps
        canvas.line(np.stack([middle - across, middle + across]), THING, 1)


def draw_trails(canvas: Canvas, truth: Truth, index: int, places: Array) -> None:
    """Draws where each person of frame `index` was during the last 3 s, in place; places (R, 2): of all rows."""
    present = truth.id[truth.rows(index)]
    first = truth.rows(max(index - round(TRAIL_SECONDS * truth.fps), 1)).start
    past = slice(first, truth.rows(index).stop)
    for person in present:
        rows = np.flatnonzero(truth.id[past] == person)
        gaps = np.flatnonzero(np.diff(truth.frame[past][rows]) != 1)
        rows = rows[gaps[-1] + 1 :] if len(gaps) else rows
        if len(rows) > 1:
            b, g, r = (round(v + (255 - v) * 0.45) for v in colour(int(person)))  # pale
            canvas.line(places[past][rows], (b, g, r), 3)


def draw_group_hulls(canvas: Canvas, truth: Truth, index: int, places: Array, boxes: Array | None, letter: str) -> None:
    """Draws hull and id, after a letter, of each group of two or more in frame `index`: round boxes, or circles."""
    rows = truth.rows(index)
    group = truth.group[rows]
    for identity in np.unique(group[group >= 0]):
        members = np.flatnonzero(group == identity)
        if len(members) < 2:
            continue
        points = _outlines(canvas, places[rows][members], None if boxes is None else boxes[rows][members])
        polygon = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2).astype(float)
        ink = colour(int(identity))
        canvas.fill(polygon, ink, 0.2)
        cv2.polylines(canvas.image, [fixed_point(polygon)], True, ink, 2, cv2.LINE_AA, SHIFT)
        x, y = polygon[polygon[:, 1].argmin()]
        text(canvas.image, f"{letter}{identity}", (x - 12, max(y - 8, 22)), 0.66, ink, 2)


def _outlines(canvas: Canvas, places: Array, boxes: Array | None) -> Array:
    if boxes is not None:
        return canvas.map(box_corners(boxes).reshape(-1, 2))
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    circle = max(FOOTPRINT * canvas.scale, 9) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.asarray((canvas.map(places)[:, None] + circle).reshape(-1, 2))


def draw_people(canvas: Canvas, truth: Truth, index: int, places: Array, boxes: Array | None, ids: bool) -> None:
    """Draws each person of frame `index` in place: a disc with a heading line, or a box if `boxes` is given."""
    rows, radius = truth.rows(index), max(0.22 * canvas.scale, 6.0)
    for row in range(rows.start, rows.stop):
        ink, at = colour(int(truth.id[row])), places[row]
        if not np.isfinite(at).all():
            continue
        if boxes is None:
            canvas.disc(at, radius + 1.5, FLOOR)
            canvas.disc(at, radius, ink)
            _draw_heading(canvas, truth, row, at, ink)
        else:
            canvas.line(box_corners(boxes[row]), ink, 3, closed=True)
    if ids:
        draw_ids(canvas, truth.id[rows], places[rows], radius)


def _draw_heading(canvas: Canvas, truth: Truth, row: int, at: Array, ink: Colour) -> None:
    if truth.vel is None or np.hypot(*truth.vel[row]) < 0.1:
        return
    canvas.line(np.stack([at, at + 0.5 * truth.vel[row] / np.hypot(*truth.vel[row])]), ink, 3)


def draw_ids(canvas: Canvas, ids: Ints, places: Array, radius: float) -> None:
    """Writes each id beside the disc at its place (N, 2), where it covers the least of discs and other ids."""
    discs = canvas.map(places)
    taken = np.concatenate([discs - radius, discs + radius], axis=1)
    directions = np.array(LABEL_DIRECTIONS)
    for identity, at in zip(ids.tolist(), discs, strict=True):
        if not np.isfinite(at).all():
            continue
        size = np.array(cv2.getTextSize(str(identity), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 2)[0], float)
        middles = at + directions * (
            radius * np.where(np.abs(directions).all(axis=1), 0.7, 1.0)[:, None] + size / 2 + 1
        )
        spots = np.concatenate([middles - size / 2, middles + size / 2], axis=1)
        covered = [_overlap_area(spot, taken) for spot in spots]
        best = spots[int(np.argmin(covered))]
        taken = np.concatenate([taken, best[None]])
        text(canvas.image, str(identity), (best[0], best[3]), 0.6, colour(identity), 2)


def _overlap_area(box: Array, others: Array) -> float:
    wide = np.minimum(box[2], others[:, 2]) - np.maximum(box[0], others[:, 0])
    high = np.minimum(box[3], others[:, 3]) - np.maximum(box[1], others[:, 1])
    return float(np.nansum(np.maximum(wide, 0) * np.maximum(high, 0)))
