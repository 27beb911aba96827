"""A picture of the ground or of the image plane: people, trails, groups and what stands still, drawn with cv2.

Everything is drawn with four bits of sub-pixel; the contact sheet draws at twice its size and shrinks it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from sim.types import Array, Image, Ints, Scene, Stairs, Truth

INK, QUIET, GRID, FLOOR, THING, WALL = (
    (36, 31, 27),
    (120, 112, 104),
    (238, 234, 230),
    (253, 252, 251),
    (144, 133, 125),
    (60, 51, 45),
)
PALETTE = ("0072b2", "b84a00", "00805e", "a33a7a", "6a51a3", "8a6d00", "b2182b", "20708c", "4d7c0f", "7a4a2a")
SHIFT = 4
TRAIL = 3.0
"""s of the past that is shown."""

FOOTPRINT = 0.3
Colour = tuple[int, int, int]


def colour(identity: int) -> Colour:
    """BGR of an id, as on the replay page; grey for -1."""
    if identity < 0:
        return THING
    text = PALETTE[identity % len(PALETTE)]
    return int(text[4:], 16), int(text[2:4], 16), int(text[:2], 16)


@dataclass(frozen=True, eq=False)
class View:
    """How a panel shows the world: canvas (H, W, 3), px per unit, where (low, high) lie; y grows upwards on a plan."""

    canvas: Image
    scale: float
    low: Array
    high: Array
    upwards: bool

    @classmethod
    def fit(cls, canvas: Image, low: Array, high: Array, upwards: bool) -> View:
        """The largest scale at which low … high fits into the canvas."""
        height, width = canvas.shape[:2]
        span = high - low
        scale = min(width / span[0], height / span[1])
        spare = (np.array([width, height]) / scale - span) / 2
        return cls(canvas, float(scale), low - spare, high + spare, upwards)

    def map(self, points: Array) -> Array:
        """World points (N, 2) as px."""
        points = np.asarray(points, float).reshape(-1, 2)
        y = self.high[1] - points[:, 1] if self.upwards else points[:, 1] - self.low[1]
        return np.stack([points[:, 0] - self.low[0], y], axis=1) * self.scale

    def line(self, points: Array, ink: Colour, width: int, closed: bool = False) -> None:
        """A polyline."""
        cv2.polylines(self.canvas, [_whole(self.map(points))], closed, ink, width, cv2.LINE_AA, SHIFT)

    def disc(self, at: Array, radius: float, ink: Colour, width: int = -1) -> None:
        """A disc (or a ring) of so many px."""
        x, y = _whole(self.map(at))[0]
        cv2.circle(self.canvas, (int(x), int(y)), round(radius * 2**SHIFT), ink, width, cv2.LINE_AA, SHIFT)

    def arrow(self, ends: Array, ink: Colour, width: int) -> None:
        """From the first of two places to the second, with a head of 7 px at most."""
        a, b = self.map(ends)
        far = float(np.hypot(*(b - a)))
        tip = min(7.0, far / 2) / far if far > 0 else 0.0
        start, end = ((int(x), int(y)) for x, y in _whole(np.stack([a, b])))
        cv2.arrowedLine(self.canvas, start, end, ink, width, cv2.LINE_AA, SHIFT, tip)

    def wash(self, polygon: Array, ink: Colour, share: float) -> None:
        """A translucent polygon given in px."""
        low = np.maximum(np.floor(polygon.min(axis=0)).astype(int) - 1, 0)
        high = np.ceil(polygon.max(axis=0)).astype(int) + 2
        patch = self.canvas[low[1] : high[1], low[0] : high[0]]
        if patch.size == 0:
            return
        over = patch.copy()
        cv2.fillPoly(over, [_whole(polygon - low)], ink, cv2.LINE_AA, SHIFT)
        cv2.addWeighted(over, share, patch, 1 - share, 0, dst=patch)


def _whole(points: Array) -> np.ndarray:
    """Fixed-point px as cv2 wants them (cv2's pixel centres are whole)."""
    limited = np.clip(points - 0.5, -30_000, 30_000)
    return np.asarray(np.rint(limited * 2**SHIFT), np.int32)


def text(canvas: Image, words: str, at: tuple[float, float], size: float, ink: Colour = INK, bold: int = 1) -> None:
    """Words from their lower left corner, with a light rim; ASCII only."""
    place = (round(at[0]), round(at[1]))
    words = words.encode("ascii", "replace").decode()
    cv2.putText(canvas, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, FLOOR, bold + 4, cv2.LINE_AA)
    cv2.putText(canvas, words, place, cv2.FONT_HERSHEY_SIMPLEX, size, ink, bold, cv2.LINE_AA)


def ground(view: View, scene: Scene | None) -> None:
    """Grid lines, walls with their doors open, pillars, stairs, service points."""
    span = float((view.high - view.low).max())
    step = 1.0 if span <= 30 else 5.0 if span <= 120 else 20.0
    for axis in (0, 1):
        for value in np.arange(math.ceil(view.low[axis] / step) * step, view.high[axis], step):
            ends = np.stack([view.low, view.high])
            ends[:, axis] = value
            view.line(ends, GRID, 1)
    if scene is None:
        return
    width, depth = scene.size
    view.line(np.array([[0, 0], [width, 0], [width, depth], [0, depth]]), THING, 2, closed=True)
    for flight in scene.stairs:
        _stairs(view, flight)
    for wall in scene.walls:
        view.line(wall, WALL, 6)
    for door in scene.doors:
        view.line(door, FLOOR, 9)
    for x, y, radius in scene.pillars:
        view.disc(np.array([x, y]), radius * view.scale, THING)
    for at in scene.service:
        view.disc(at, 8, WALL, 2)


def _stairs(view: View, flight: Stairs) -> None:
    axis = flight.head - flight.foot
    across = np.array([-axis[1], axis[0]]) / np.hypot(*axis) * flight.width / 2
    for k in range(flight.steps + 1):
        middle = flight.foot + axis * k / flight.steps
        view.line(np.stack([middle - across, middle + across]), THING, 1)


def trails(view: View, truth: Truth, index: int, places: Array) -> None:
    """The last seconds of everybody present; places (R, 2) are the truth's rows in the panel's unit."""
    present = truth.id[truth.rows(index)]
    first = truth.rows(max(index - round(TRAIL * truth.fps), 1)).start
    past = slice(first, truth.rows(index).stop)
    for person in present:
        rows = np.flatnonzero(truth.id[past] == person)
        broken = np.flatnonzero(np.diff(truth.frame[past][rows]) != 1)
        rows = rows[broken[-1] + 1 :] if len(broken) else rows
        if len(rows) > 1:
            view.line(places[past][rows], _pale(colour(int(person))), 3)


def _pale(ink: Colour) -> Colour:
    b, g, r = (round(v + (255 - v) * 0.45) for v in ink)
    return b, g, r


def hulls(view: View, truth: Truth, index: int, places: Array, boxes: Array | None) -> None:
    """The groups of a frame as the region of their members, with their ids."""
    rows = truth.rows(index)
    group = truth.group[rows]
    for identity in np.unique(group[group >= 0]):
        members = np.flatnonzero(group == identity)
        if len(members) < 2:
            continue
        points = _outline(view, places[rows][members], None if boxes is None else boxes[rows][members])
        polygon = cv2.convexHull(points.astype(np.float32)).reshape(-1, 2).astype(float)
        ink = colour(int(identity))
        view.wash(polygon, ink, 0.2)
        cv2.polylines(view.canvas, [_whole(polygon)], True, ink, 2, cv2.LINE_AA, SHIFT)
        x, y = polygon[polygon[:, 1].argmin()]
        text(view.canvas, f"G{identity}", (x - 12, max(y - 8, 22)), 0.66, ink, 2)


def _outline(view: View, places: Array, boxes: Array | None) -> Array:
    if boxes is not None:
        corners = [boxes[:, :2] + boxes[:, 2:] * np.array(c) for c in ((0, 0), (1, 0), (0, 1), (1, 1))]
        return view.map(np.concatenate(corners))
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    circle = max(FOOTPRINT * view.scale, 9) * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return np.asarray((view.map(places)[:, None] + circle).reshape(-1, 2))


def people(view: View, truth: Truth, index: int, places: Array, boxes: Array | None, names: bool) -> None:
    """Everybody of a frame: a disc with a nose where they head, or a box; `names` adds ids."""
    rows, radius = truth.rows(index), max(0.22 * view.scale, 6.0)
    for row in range(rows.start, rows.stop):
        ink, at = colour(int(truth.id[row])), places[row]
        if not np.isfinite(at).all():
            continue
        if boxes is None:
            view.disc(at, radius + 1.5, FLOOR)
            view.disc(at, radius, ink)
            _nose(view, truth, row, at, ink)
        else:
            x, y, w, h = boxes[row]
            view.line(np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]]), ink, 3, closed=True)
    if names:
        _names(view, truth.id[rows], places[rows], radius)


def _nose(view: View, truth: Truth, row: int, at: Array, ink: Colour) -> None:
    if truth.vel is None or np.hypot(*truth.vel[row]) < 0.1:
        return
    view.line(np.stack([at, at + 0.5 * truth.vel[row] / np.hypot(*truth.vel[row])]), ink, 3)


AROUND = ((1, 1), (1, -1), (-1, 1), (-1, -1), (0, 1), (1, 0), (-1, 0), (0, -1))
"""Where a name may stand beside its disc, the best first."""


def _names(view: View, ids: Ints, places: Array, radius: float) -> None:
    """Ids beside their discs, each where it covers the least of discs and of names that already stand."""
    discs = view.map(places)
    taken = np.concatenate([discs - radius, discs + radius], axis=1)
    for identity, at in zip(ids.tolist(), discs, strict=True):
        if not np.isfinite(at).all():
            continue
        size = np.array(cv2.getTextSize(str(identity), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 2)[0], float)
        middles = at + np.array(AROUND) * (
            radius * np.where(np.abs(AROUND).all(axis=1), 0.7, 1.0)[:, None] + size / 2 + 1
        )
        spots = np.concatenate([middles - size / 2, middles + size / 2], axis=1)
        covered = [_shared(spot, taken) for spot in spots]
        best = spots[int(np.argmin(covered))]
        taken = np.concatenate([taken, best[None]])
        text(view.canvas, str(identity), (best[0], best[3]), 0.6, colour(identity), 2)


def _shared(box: Array, others: Array) -> float:
    """Area that a box (left, top, right, bottom) shares with others (N, 4)."""
    wide = np.minimum(box[2], others[:, 2]) - np.maximum(box[0], others[:, 0])
    high = np.minimum(box[3], others[:, 3]) - np.maximum(box[1], others[:, 1])
    return float(np.nansum(np.maximum(wide, 0) * np.maximum(high, 0)))
