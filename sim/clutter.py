"""False alarms: boxes and points where nobody is, of the size that a person there would have.

Their number is the Poisson quantile of one uniform per frame, and the k-th of a frame has a stream of its own: a
higher rate adds false alarms and keeps those that were there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.camera import project, to_ground
from sim.people import boxes
from sim.rng import rng
from sim.sensors import Readings, uniforms
from sim.types import Array, Camera, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema import Sensor

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
    return Readings(frame, pos, None if truth.box is None else box, FALSE_SCORE * u[:, SCORE] ** 2, u[:, PLACE])


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
    box = boxes(camera, pos3, 2 * np.pi * u[:, HEADING], tall)
    behind = ~np.isfinite(box).all(axis=1)  # right under the camera: a person-sized box there all the same
    size = np.stack([0.27 * tall, tall], axis=1) * camera.focal_px[0] / max(camera.position[2], 1.0)
    box[behind] = np.concatenate([uv - size / 2, size], axis=1)[behind]
    return pos, box


def _furthest_row(camera: Camera) -> float:
    """The highest image row on which a person stands that is not too small."""
    v = np.linspace(0.0, camera.image[1], 241)
    ground = to_ground(camera, np.column_stack([np.full_like(v, camera.centre_px[0]), v]))
    foot = np.column_stack([ground, np.zeros(len(v))])
    tall = foot + np.array([0.0, 0.0, 1.7])
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


def clipped(box: Array, image_size: tuple[int, int]) -> Array:
    """The part of each box that lies in the image."""
    limit = np.array(image_size, dtype=float)
    low, high = np.clip(box[:, :2], 0, limit), np.clip(box[:, :2] + box[:, 2:], 0, limit)
    return np.concatenate([low, high - low], axis=1)
