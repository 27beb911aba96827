"""False alarms: boxes and points where nobody is, of the size that a person would have there.

By default each false alarm lasts one frame (this module). With `sensor.false_alarms` they persist:
`sim.detector.persistent_clutter`. The number in a frame is the Poisson quantile of one uniform, and the k-th alarm of
a frame has a random stream of its own. A higher rate therefore adds false alarms and keeps the earlier ones.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sim.detector.draws import false_scores
from sim.detector.persistent_clutter import persistent_false_alarms
from sim.detector.readings import Readings
from sim.detector.visible_ground import clip_boxes, furthest_row
from sim.rng import poisson_quantiles, rng, uniforms
from sim.scene.body import SHOULDER_SHARE, person_boxes
from sim.scene.camera import to_ground
from sim.types import Array, Camera, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

ACROSS, DOWN, HEIGHT, HEADING, SCORE, ORDER, DRAWS = 0, 1, 2, 3, 4, 5, 6  # draws of one false alarm


def false_alarms(
    truth: Truth,
    sensor: Sensor,
    seed: int,
    camera: Camera | None,
    image_size: tuple[int, int] | None,
    repeat: int = 0,
) -> Readings:
    """Returns the false alarms of all frames 1 to truth.length as Readings; their number per frame is Poisson.

    With a camera, their feet are spread evenly over the part of the image that shows ground, and each is as large as a
    person standing there. Without a camera, boxes have the sizes of labelled boxes and are spread evenly over the image
    (image_size: width, height in px, ignored with a camera; None: over the labelled box centres). Points are spread
    evenly over the labelled area. Positions are in m; in px, the box's centre, if the truth has no positions. With
    `sensor.false_alarms`, alarms last several frames and follow their own rules of place and size.

    Rows are not sorted by frame. A position is nan where no ground is seen. Boxes are None if the truth has none. With
    `sensor.box` "visible" they are clipped to the image if its size is known; an alarm that lasts one frame then stays
    even without area. Without a camera and without labels there are no false alarms. seed, repeat (number of the suite
    entry's copy, 0 without copies): name the random streams. Raises ValueError for a negative seed.
    """
    size = camera.image if camera is not None else image_size
    if sensor.false_alarms is not None and (len(truth.id) or camera is not None):
        known = None if size is None else np.array(size, dtype=float)
        return persistent_false_alarms(truth, sensor, seed, camera, known, repeat)
    count = false_alarm_counts(sensor.clutter_rate, truth.length, seed, repeat)
    streams = [
        (
            np.flatnonzero(count > k) + 1,
            uniforms(rng(seed, "clutter", 1 + k, repeat=repeat), (truth.length, DRAWS)),
        )
        for k in range(int(count.max(initial=0)))
    ]
    frame = np.concatenate([f for f, _ in streams]) if streams else np.zeros(0, np.int64)
    u = np.concatenate([draws[f - 1] for f, draws in streams]) if streams else np.zeros((0, DRAWS))
    if len(truth.id) == 0 and camera is None:  # sizes and places are unknown
        frame, u = frame[:0], u[:0]
    pos, box = _placed_by_camera(camera, u) if camera is not None else _placed_by_labels(truth, image_size, u)
    if box is not None and size is not None and sensor.box == "visible":
        box = clip_boxes(box, size)
    if truth.pos is None and box is not None:
        pos = box[:, :2] + box[:, 2:] / 2
    return Readings(frame, pos, None if truth.box is None else box, false_scores(u[:, SCORE], sensor), u[:, ORDER])


def false_alarm_counts(rate: float, length: int, seed: int, repeat: int = 0) -> Ints:
    """Returns the number of false alarms of each frame 1 to `length`, (length,) int64, Poisson with mean `rate` per
    frame.

    seed, repeat (number of the suite entry's copy, 0 without copies): name the random stream; for fixed ones a higher
    rate never lowers a number. All are 0 if the rate is 0. Raises ValueError for a negative seed or rate.
    """
    return poisson_quantiles(rate, uniforms(rng(seed, "clutter", 0, repeat=repeat), length))


def _placed_by_camera(camera: Camera, u: Array) -> tuple[Array, Array]:
    """Returns ground points (N, 2) in m and boxes (N, 4), left, top, width, height in px, of N false alarms in the
    image.

    Each is a person 1.5 to 1.95 m tall. The feet are even over the image; for a pinhole camera only below the row
    `furthest_row`, where people become small. u (N, 6): uniforms in (0, 1], columns ACROSS, DOWN (place of the feet),
    HEIGHT (of the body), HEADING (of the body), SCORE, ORDER (both not used here). Where the camera gives no box, as
    right under it, a box of a person's size is put round the image point. A point is nan where no ground is seen.
    """
    width, height = camera.image
    top = 0.0 if camera.kind == "top" else furthest_row(camera)
    uv = np.column_stack([u[:, ACROSS] * width, top + u[:, DOWN] * (height - top)])
    pos = to_ground(camera, uv)
    tall = 1.5 + 0.45 * u[:, HEIGHT]
    pos3 = np.column_stack([pos, np.zeros(len(pos))])
    box = person_boxes(camera, pos3, 2 * np.pi * u[:, HEADING], tall)
    behind = ~np.isfinite(box).all(axis=1)
    size = np.stack([SHOULDER_SHARE * tall, tall], axis=1) * camera.focal_px[0] / max(camera.position[2], 1.0)
    box[behind] = np.concatenate([uv - size / 2, size], axis=1)[behind]
    return pos, box


def _placed_by_labels(truth: Truth, image_size: tuple[int, int] | None, u: Array) -> tuple[Array, Array | None]:
    """Returns points (N, 2) in m over the labelled area, and boxes (N, 4), left, top, width, height in px, of labelled
    sizes.

    u (N, 6): uniforms in (0, 1], columns ACROSS, DOWN (place), HEIGHT (which labelled box gives the size), HEADING,
    SCORE, ORDER (not used here). Boxes have their centres evenly over the image (image_size: width, height in px), or
    over the rectangle of the labelled box centres if that is None. Points are evenly in the rectangle of all labelled
    positions, or 0 if the truth has no positions. Boxes are None if it has no boxes.
    """
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
