"""False alarms: boxes and points where nobody is, of the size that a person there would have.

Their number is the Poisson quantile of one uniform per frame, and the k-th of a frame has a stream of its own: a
higher rate adds false alarms and keeps those that were there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.detector.sense import Readings, quantiles, uniforms
from sim.rng import rng
from sim.scene.body import PERSON_HEIGHT, SHOULDER_SHARE, person_boxes
from sim.scene.camera import project, to_ground
from sim.types import Array, Camera, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

ACROSS, DOWN, HEIGHT, HEADING, SCORE, PLACE, DRAWS = 0, 1, 2, 3, 4, 5, 6
SMALLEST = 0.25  # of the height of a person at the image's middle: no false alarm is further away
FALSE_SCORE = 0.7  # the highest score of a false alarm; the mean is a third of it


def false_alarms(
    truth: Truth,
    sensor: Sensor,
    seed: int,
    camera: Camera | None,
    image_size: tuple[int, int] | None,
    repeat: int = 0,
) -> Readings:
    """The false alarms of all frames.

    With a camera: spread evenly over the part of the image that shows ground, sized as a person standing there.
    Without: boxes of the sizes of the labelled ones, evenly over the image; points evenly over the labelled area.
    """
    if sensor.false_alarms is not None and (len(truth.id) or camera is not None):
        from sim.detector.persistent_clutter import ghosts

        size = camera.image if camera is not None else image_size
        return ghosts(truth, sensor, seed, camera, None if size is None else np.array(size, dtype=float), repeat)
    count = counts(sensor.clutter_rate, truth.length, seed, repeat)
    slots = [
        (np.flatnonzero(count > k) + 1, uniforms(rng(seed, "clutter", 1 + k, repeat=repeat), 1, truth.length, DRAWS))
        for k in range(int(count.max(initial=0)))
    ]
    frame = np.concatenate([f for f, _ in slots]) if slots else np.zeros(0, np.int64)
    u = np.concatenate([draws[f - 1] for f, draws in slots]) if slots else np.zeros((0, DRAWS))
    if len(truth.id) == 0 and camera is None:  # nothing to take sizes and places from
        frame, u = frame[:0], u[:0]
    pos, box = _seen_by(camera, u) if camera is not None else _like(truth, image_size, u)
    size = camera.image if camera is not None else image_size
    if box is not None and size is not None and sensor.box == "visible":
        box = clipped(box, size)
    if truth.pos is None and box is not None:
        pos = box[:, :2] + box[:, 2:] / 2
    return Readings(frame, pos, None if truth.box is None else box, false_scores(sensor, u[:, SCORE]), u[:, PLACE])


def false_scores(sensor: Sensor, u: Array) -> Array:
    """Scores of false alarms by uniforms u: those measured, else FALSE_SCORE u^2."""
    curve = sensor.false_scores
    return FALSE_SCORE * u**2 if curve is None else quantiles(curve, u)


def counts(rate: float, length: int, seed: int, repeat: int = 0) -> Ints:
    """Poisson numbers (length,), never falling when the rate rises."""
    if not rate:
        return np.zeros(length, np.int64)
    from scipy.special import pdtr

    u = uniforms(rng(seed, "clutter", 0, repeat=repeat), 1, length, 1)[:, 0]
    k = np.arange(int(rate + 12 * np.sqrt(rate) + 20))
    return np.searchsorted(pdtr(k, rate), u).astype(np.int64)


def _seen_by(camera: Camera, u: Array) -> tuple[Array, Array]:
    width, height = camera.image
    top = 0.0 if camera.kind == "top" else _furthest_row(camera)
    uv = np.column_stack([u[:, ACROSS] * width, top + u[:, DOWN] * (height - top)])
    pos = to_ground(camera, uv)
    tall = 1.5 + 0.45 * u[:, HEIGHT]
    pos3 = np.column_stack([pos, np.zeros(len(pos))])
    box = person_boxes(camera, pos3, 2 * np.pi * u[:, HEADING], tall)
    behind = ~np.isfinite(box).all(axis=1)  # right under the camera: a person-sized box there all the same
    size = np.stack([SHOULDER_SHARE * tall, tall], axis=1) * camera.focal_px[0] / max(camera.position[2], 1.0)
    box[behind] = np.concatenate([uv - size / 2, size], axis=1)[behind]
    return pos, box


def _furthest_row(camera: Camera) -> float:
    """The highest image row on which a person stands that is not too small."""
    v = np.linspace(0.0, camera.image[1], 241)
    ground = to_ground(camera, np.column_stack([np.full_like(v, camera.centre_px[0]), v]))
    foot = np.column_stack([ground, np.zeros(len(v))])
    tall = foot + np.array([0.0, 0.0, PERSON_HEIGHT])
    size = np.linalg.norm(project(camera, tall)[0] - project(camera, foot)[0], axis=1)
    at_middle = size[len(v) // 2] if np.isfinite(size[len(v) // 2]) else np.nanmax(size, initial=0.0)
    enough = np.flatnonzero(np.nan_to_num(size) >= SMALLEST * at_middle)
    return float(v[enough[0]]) if len(enough) else 0.0


def _like(truth: Truth, image_size: tuple[int, int] | None, u: Array) -> tuple[Array, Array | None]:
    """Points and boxes like the labelled ones, where no camera says how large a person would be."""
    spread = u[:, [ACROSS, DOWN]]
    pos = np.zeros((len(u), 2))
    if truth.pos is not None and len(u):
        low, high = truth.pos.min(axis=0), truth.pos.max(axis=0)
        pos = low + spread * (high - low)
    if truth.box is None:
        return pos, None
    if not len(u):
        return pos, np.zeros((0, 4))
    size = truth.box[(u[:, HEIGHT] * len(truth.box)).astype(np.int64), 2:]
    centre = truth.box[:, :2] + truth.box[:, 2:] / 2
    low, high = (centre.min(axis=0), centre.max(axis=0)) if image_size is None else (np.zeros(2), np.array(image_size))
    return pos, np.concatenate([low + spread * (high - low) - size / 2, size], axis=1)


class Ground:
    """Where false alarms can stand, and how large a person would be there: by the camera, else by the labels.

    Without a camera a person's height is linear in the row of the feet, as on flat ground, and not far beyond the
    labelled extremes. Ground ends, either way, where people would be SMALLEST of one at the image's middle.
    """

    def __init__(self, truth: Truth, camera: Camera | None, size: Array | None) -> None:
        self.truth, self.camera = truth, camera
        self.low, self.high = np.zeros(2), np.zeros(2)
        self.line, self.extremes = np.array([1.0, 0.0]), (1.0, 1.0)
        if camera is not None:
            self.high = np.array(camera.image, dtype=float)
            self.low[1] = 0.0 if camera.kind == "top" else _furthest_row(camera)
        elif truth.box is not None and len(truth.box):
            foot = truth.box[:, :2] + truth.box[:, 2:] * [0.5, 1.0]
            self.line = height_line(foot[:, 1], truth.box[:, 3])
            self.extremes = 0.5 * float(truth.box[:, 3].min()), 1.5 * float(truth.box[:, 3].max())
            self.low, self.high = foot.min(axis=0), foot.max(axis=0)
            if size is not None:
                self.low, self.high = np.array([0.0, _far_row(self.line, float(size[1]))]), np.array(size)

    def place(self, x: float, y: float) -> tuple[float, float]:
        """The image point at shares x of the width and y of the rows that show ground."""
        u, v = self.low + np.array([x, y]) * (self.high - self.low)
        return float(u), float(v)

    def usual_height(self, u: float, v: float) -> float:
        """Height of a person's box whose feet are at (u, v), px."""
        if self.camera is None:
            return float(np.clip(self.line @ [1.0, v], *self.extremes))
        pos = to_ground(self.camera, np.array([[u, v]]))
        tall = person_boxes(self.camera, np.column_stack([pos, [0.0]]), np.zeros(1), np.full(1, PERSON_HEIGHT))[0, 3]
        if not np.isfinite(tall):  # right under the camera
            tall = PERSON_HEIGHT * self.camera.focal_px[1] / max(float(self.camera.position[2]), 1.0)
        return float(tall)

    def points(self, u: Array, v: Array, otherwise: Array) -> Array:
        """(L, 2) m: the ground behind image points; `otherwise` where none is seen or no camera is known."""
        if self.camera is None:
            return otherwise
        top = self.low[1]
        pos = to_ground(self.camera, np.stack([u, np.maximum(v, top)], axis=1))
        return np.where(np.isfinite(pos), pos, otherwise)

    def anywhere(self, x: float, y: float) -> Array:
        """(2,) m: a place of the labelled area."""
        pos = self.truth.pos
        if pos is None or not len(pos):
            return np.zeros(2)
        low, high = pos.min(axis=0), pos.max(axis=0)
        return np.asarray(low + np.array([x, y]) * (high - low))


def _far_row(line: Array, rows: float) -> float:
    """The row at which people on that line are SMALLEST of one at the middle; 0 where they do not grow downwards."""
    a, b = line
    return float(np.clip((SMALLEST * (a + b * rows / 2) - a) / b, 0.0, rows / 2)) if b > 1e-6 else 0.0


def height_line(foot: Array, tall: Array) -> Array:
    """(2,) a, b of the least-squares line height = a + b foot; b = 0 where all feet are in one row."""
    spread = foot - foot.mean()
    b = float(spread @ tall / (spread @ spread)) if spread @ spread > 1e-9 * len(foot) else 0.0
    return np.array([tall.mean() - b * foot.mean(), b])


def clipped(box: Array, image_size: tuple[int, int]) -> Array:
    """The part of each box that lies in the image."""
    limit = np.array(image_size, dtype=float)
    low, high = np.clip(box[:, :2], 0, limit), np.clip(box[:, :2] + box[:, 2:], 0, limit)
    return np.concatenate([low, high - low], axis=1)
