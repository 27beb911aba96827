"""False alarms: boxes and points where nobody is, of the size that a person would have there.

By default each false alarm lasts one frame. The number in a frame is the Poisson quantile of one uniform, and the k-th
alarm of a frame has a random stream of its own. A higher rate therefore adds false alarms and keeps the earlier ones.

False alarms that persist over frames (`sensor.false_alarms`): at people (body parts, doubles) or on their own.

Alarms are born as a Poisson process in time and live for an exponential time, on the detector's clock of CLOCK ticks
per s: each survives to the next tick with probability q = exp(-1 / (CLOCK life)), where life is the mean life in s. A
living alarm is reported in a frame with probability `seen`. On average, rate / seen alarms live at any time, from the
first on, where rate is `sensor.clutter_rate`. The number reported in a frame is therefore Poisson with mean
`clutter_rate`, whatever the life and the frame rate; it is lower where alarms at people end early because the people
leave. Alarms of life 0 are reported in one frame. The k-th alarm born at a tick has a random stream of its own: a
higher rate adds alarms and keeps the earlier ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from sim.detector.box_noise import move_edges
from sim.detector.draws import CLOCK, Readings, false_scores, ticks
from sim.detector.visible_ground import GroundInView, VisibleGround, clip_boxes, furthest_row, labelled_points
from sim.elementary import exp, log
from sim.rng import normals, poisson_counts, rng, uniforms
from sim.scene.body import PERSON_HEIGHT, SHOULDER_SHARE, person_boxes
from sim.scene.camera import standing_share, to_ground
from sim.scene.camera_motion import MovingCamera, View, by_frame, camera_at
from sim.schedules import values_at
from sim.types import Array, Bools, Camera, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema.schedule import Schedule
    from scenarios.schema.sensor import FalseAlarms, Sensor


LIFE, AT_PERSON, SITE, X, Y, TALL, ASPECT, VX, VY, BIRTH_DRAWS = range(10)  # an alarm's draws at birth
SHOWN, EDGES, SCORE, ORDER, FRAME_DRAWS = 0, slice(1, 5), 5, 6, 7  # an alarm's draws in each frame
SITE_SPREAD = 0.03  # standard deviation of positions round the sites `at`, as a share of the ground part of the image


def persistent_false_alarms(
    truth: Truth, sensor: Sensor, seed: int, camera: View | None, size: Array | None, repeat: int
) -> Readings:
    """Returns the false alarms of all frames 1 to truth.length as Readings, where alarms last several frames.

    `sensor.false_alarms` holds their settings and must be given (else AssertionError). size (2,): width, height of the
    image in px, None if unknown. camera None: places and sizes come from the labels. seed, repeat (number of the suite
    entry's copy, 0 without copies): name the random streams.

    Rows are sorted by alarm, not by frame; the mean number per frame is `sensor.clutter_rate`. Positions are in m; in
    px, the box's centre, if the truth has no positions. Boxes are None if the truth has none. With `sensor.box`
    "visible" they are clipped to the image if its size is known. If the truth has boxes, an alarm is dropped in frames
    where its box has no area. Raises ValueError for a negative seed.
    """
    model = sensor.false_alarms
    assert model is not None
    view = GroundInView(truth, camera, size)
    none = np.zeros(0, np.int64), np.zeros((0, 4)), np.zeros((0, 2)), np.zeros((0, FRAME_DRAWS))
    born = _draw_births(model, sensor.clutter_rate, truth, seed, repeat)
    parts = [none, *(_one_alarm(model, view, *birth, seed, repeat) for birth in born)]
    frame, box, pos, u = (np.concatenate(part) for part in zip(*parts, strict=True))
    keep = u[:, SHOWN] < model.seen
    if truth.box is not None:
        if sensor.box == "visible" and size is not None:
            box = clip_boxes(box, (int(size[0]), int(size[1])))
        keep &= (box[:, 2:] > 0).all(axis=1)
    frame, box, pos, u = frame[keep], box[keep], pos[keep], u[keep]
    if truth.pos is None:
        pos = box[:, :2] + box[:, 2:] / 2
    return Readings(frame, pos, None if truth.box is None else box, false_scores(u[:, SCORE], sensor), u[:, ORDER])


def _draw_births(
    model: FalseAlarms, rate: float | Schedule, truth: Truth, seed: int, repeat: int
) -> Iterator[tuple[int, float, tuple[int, int], Array, Array]]:
    """Yields each alarm of a sequence that lives in a frame, in order of birth: first frame (from 1), age there, s, its
    name (tick of birth, and number among those born then), which names its random streams, and its uniforms.

    The uniforms are (9,) at birth, columns LIFE …, and (L, 7) in the L frames that it lives, columns SHOWN …. The first
    tick starts with the stationary number of living alarms, as if some had begun earlier. rate: mean number of alarms
    reported per frame; if it changes, the number follows as old alarms end.
    """
    frames = np.arange(1, truth.length + 1)
    # the steps at which alarms may be born, and the step of each frame; without a life every frame is a step
    step, per_s, q = frames - 1, truth.fps, 0.0
    if model.life:
        step, per_s, q = ticks(frames, truth.fps), CLOCK, float(exp(-1.0 / (CLOCK * model.life)))
    u = uniforms(rng(seed, "clutter", 0, 1, repeat=repeat), int(step[-1]) + 1 if len(step) else 0)
    alive = values_at(rate, np.arange(len(u)) / per_s) / model.seen
    number = poisson_counts(alive * (1.0 - q), u)
    number[:1] = poisson_counts(alive[:1], u[:1])
    for start in np.flatnonzero(number).tolist():
        for nth in range(number[start]):
            stream = rng(seed, "clutter", 1, start, nth, repeat=repeat)
            at_birth = uniforms(stream, BIRTH_DRAWS)
            life = 1 + int(log(at_birth[LIFE]) / log(q)) if q else 1
            first, end = np.searchsorted(step, (start, start + life)).tolist()
            if first < end:
                age, in_frames = (step[first] - start) / per_s, uniforms(stream, (end - first, FRAME_DRAWS))
                yield first + 1, age, (start, nth), at_birth, in_frames


def _one_alarm(
    model: FalseAlarms, view: GroundInView, start: int, age: float, name: tuple[int, int], at_birth: Array,
    in_frames: Array, seed: int, repeat: int,
) -> tuple[Ints, Array, Array, Array]:  # fmt: skip
    """Returns one alarm, as of `_draw_births`: its frames (L,), boxes (L, 4) px, points (L, 2) m and uniforms (L, 7).

    With probability `model.near` the alarm goes with a person who is present in its frame of birth, and ends when that
    person is first absent. Otherwise, or without people in that frame, it is on its own. `model.jitter`: standard
    deviation of the random error of each edge in each frame, in box heights.
    """
    frame, truth = start + np.arange(len(in_frames)), view.truth
    n = normals(at_birth)
    here = truth.rows(start)
    if at_birth[AT_PERSON] < model.near and here.stop > here.start:
        id = _draw_person(truth.id[here], seed, name, repeat)
        row, present = _rows_of_person(truth, id, frame)
        frame, in_frames = frame[present], in_frames[present]
        parts = [_boxes_at_person(model, ground, row[r], n) for ground, r in view.by_frame(frame)]
        box, pos = (np.concatenate(part) for part in zip(*parts, strict=True))
    else:
        ages = age + np.arange(len(in_frames)) / truth.fps
        box, pos = _boxes_alone(model, view.in_frame(start), ages, at_birth, n)
        if view.moves:
            box = view.carried(frame, box, pos)
    if model.jitter:
        box = move_edges(box, model.jitter * box[:, 3:] * normals(in_frames[:, EDGES]))
    return frame, box, pos, in_frames


def _draw_person(ids: Ints, seed: int, name: tuple[int, int], repeat: int) -> int:
    """Returns the id of the person with whom an alarm goes: the one of `ids` with the highest random draw.

    name: of the alarm, as of `_draw_births`. Each draw has a random stream of its own, named by seed, repeat (number of
    the suite entry's copy), the alarm and the person's id. One person more therefore changes few alarms. Raises
    ValueError if `ids` is empty, or for a negative seed or id.
    """
    draws = [rng(seed, "clutter", 2, *name, int(id), repeat=repeat).random() for id in ids]
    return int(ids[int(np.argmax(draws))])


def _rows_of_person(truth: Truth, id: int, frame: Ints) -> tuple[Ints, Bools]:
    """Returns the rows (M,) of the truth in which person `id` is present, and a mask (L,) of the frames to which they
    belong.

    frame (L,): consecutive frame numbers, from 1 on. The rows run from the first of these frames until the person is
    first absent. If the person is absent in the first frame, M is 0 and the mask is all False. The person must have at
    least one row in the truth, else IndexError.
    """
    mine = np.flatnonzero(truth.id == id)
    place = np.minimum(np.searchsorted(truth.frame[mine], frame), len(mine) - 1)
    present = np.logical_and.accumulate(truth.frame[mine[place]] == frame)
    return mine[place[present]], present


def _boxes_at_person(model: FalseAlarms, ground: VisibleGround, row: Ints, n: Array) -> tuple[Array, Array]:
    """Returns boxes (L, 4), left, top, width, height in px, and points (L, 2) in m, of an alarm beside a person.

    row (L,): the person's rows of the truth. n (9,): standard normals, columns LIFE …. `model` gives
    pairs (mean, standard deviation): across and foot, the shift of the middle to the right and of the lower edge
    downwards, in the person's box heights; near_height, the logarithm of height over the person's height. Boxes are 0
    if the truth has none. The points are at the middle of the lower edges, for a camera of kind "top" at the middle of
    the boxes, if there is a camera and ground is seen there. Else they are the person's, moved along x by the shift
    across × 1.7 m, or 0 if the truth has no positions.
    """
    truth = ground.truth
    across, down = (mean + sd * n[c] for (mean, sd), c in ((model.across, X), (model.foot, Y)))
    aside = PERSON_HEIGHT * across * np.array([1.0, 0.0])
    pos = np.zeros((len(row), 2)) if truth.pos is None else truth.pos[row] + aside
    if truth.box is None:
        return np.zeros((len(row), 4)), pos
    left, top, w, h = truth.box[row].T
    tall = h * exp(model.near_height[0] + model.near_height[1] * n[TALL])
    box = _boxes_on_feet(left + w / 2 + h * across, top + h * (1.0 + down), tall, model, n)
    share = standing_share(ground.camera)
    return box, ground.ground_points(box[:, 0] + box[:, 2] / 2, box[:, 1] + share * box[:, 3], pos)


def _boxes_alone(
    model: FalseAlarms, ground: VisibleGround, age: Array, at_birth: Array, n: Array
) -> tuple[Array, Array]:
    """Returns boxes (L, 4), left, top, width, height in px, and points (L, 2) in m, of an alarm that stands or drifts
    alone.

    age (L,): time since its birth in each frame, s. at_birth (9,): its uniforms, columns LIFE …; n
    (9,): the same as standard normals. It starts near one of the sites `model.at` (shares of width and height of
    the ground part of the image), with a standard deviation of 0.03 and inside that part; without sites, anywhere
    on it. It moves with constant velocity, drawn with standard deviation `model.drift` (box heights per s) per
    axis. `model.height`: mean and standard deviation of the logarithm of its height over a person's. Points are
    those under the feet, for a camera of kind "top" under the middle of the box, if there is a camera and ground is
    seen there; else one fixed point of the labelled area (0, 0 without one), which does not drift.
    """
    x, y = at_birth[X], at_birth[Y]
    if model.at:
        x, y = model.at[min(int(at_birth[SITE] * len(model.at)), len(model.at) - 1)]
        x, y = x + SITE_SPREAD * n[X], y + SITE_SPREAD * n[Y]
    u, v = ground.image_point(float(np.clip(x, 0.0, 1.0)), float(np.clip(y, 0.0, 1.0)))
    tall = ground.usual_height(u, v) * exp(model.height[0] + model.height[1] * n[TALL])
    away = model.drift * tall * age
    u, v = u + away * n[VX], v + away * n[VY]
    box = _boxes_on_feet(u, v, np.full(len(age), tall), model, n)
    foot = v - (1.0 - standing_share(ground.camera)) * tall
    return box, ground.ground_points(u, foot, labelled_points(ground.truth, np.tile([x, y], (len(age), 1))))


def _boxes_on_feet(middle: Array, foot: Array, tall: Array, model: FalseAlarms, n: Array) -> Array:
    """Returns boxes (L, 4), left, top, width, height in px, that stand on given feet.

    middle (L,) or one number: column of the middle. foot (L,) or one number: row of the feet. tall (L,): height. All
    are in px. The width is the same share of the height in all rows: its logarithm has the mean and standard deviation
    `model.aspect`, and is drawn by the standard normal in column ASPECT of n (9,).
    """
    wide = tall * exp(model.aspect[0] + model.aspect[1] * n[ASPECT])
    return np.stack([middle - wide / 2, foot - tall, wide, tall], axis=1)


ACROSS, DOWN, HEIGHT, HEADING, SCORE_1, ORDER_1, DRAWS = 0, 1, 2, 3, 4, 5, 6  # draws of one false alarm


def false_alarms(
    truth: Truth, sensor: Sensor, seed: int, camera: View | None, image_size: tuple[int, int] | None, repeat: int = 0,
) -> Readings:  # fmt: skip
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
    size = camera_at(camera, 0.0).image if camera is not None else image_size
    if sensor.false_alarms is not None and (len(truth.id) or camera is not None):
        known = None if size is None else np.array(size, dtype=float)
        return persistent_false_alarms(truth, sensor, seed, camera, known, repeat)
    rate = values_at(sensor.clutter_rate, np.arange(truth.length) / truth.fps)
    count = false_alarm_counts(rate, seed, repeat)
    frame, u = np.zeros(0, np.int64), np.zeros((0, DRAWS))
    if len(truth.id) or camera is not None:  # else sizes and places are unknown
        for k in range(int(count.max(initial=0))):
            here = np.flatnonzero(count > k)
            drawn = uniforms(rng(seed, "clutter", 1 + k, repeat=repeat), (truth.length, DRAWS))
            frame, u = np.append(frame, here + 1), np.concatenate([u, drawn[here]])
    order = np.argsort(frame, kind="stable") if isinstance(camera, MovingCamera) else np.arange(len(frame))
    frame, u = frame[order], u[order]
    pos, box = (
        _placed_by_labels(truth, image_size, u) if camera is None else _placed_by_view(camera, frame, u, truth.fps)
    )
    if box is not None and size is not None and sensor.box == "visible":
        box = clip_boxes(box, size)
    if truth.pos is None and box is not None:
        pos = box[:, :2] + box[:, 2:] / 2
    return Readings(frame, pos, None if truth.box is None else box, false_scores(u[:, SCORE_1], sensor), u[:, ORDER_1])


def false_alarm_counts(rate: Array, seed: int, repeat: int = 0) -> Ints:
    """Returns the number of false alarms in each frame, (F,): Poisson with mean rate (F,).

    seed, repeat (number of the suite entry's copy, 0 without copies): name the random stream; with the same stream, a
    higher rate never gives a smaller number. It is 0 where the rate is 0. Raises ValueError for a
    negative seed or rate.
    """
    return poisson_counts(rate, uniforms(rng(seed, "clutter", 0, repeat=repeat), len(rate)))


def _placed_by_view(view: View, frame: Ints, u: Array, fps: float) -> tuple[Array, Array]:
    parts = [_placed_by_camera(camera, u[r]) for camera, r in by_frame(view, frame, fps)]
    pos, box = (np.concatenate(part) for part in zip(*parts, strict=True))
    return pos, box


def _placed_by_camera(camera: Camera, u: Array) -> tuple[Array, Array]:
    """Returns ground points (N, 2) in m and boxes (N, 4), left, top, width, height in px, of N false alarms in the
    image.

    Each is a person 1.5 to 1.95 m tall. The feet are even over the image; for a pinhole camera only below the row
    `furthest_row`, where people become small. u (N, 6): uniforms in (0, 1], columns ACROSS, DOWN (place of the feet),
    HEIGHT, HEADING (of the body), SCORE_1, ORDER_1 (both not used here). Where the camera gives no box, as right under
    it, a box of a person's size is put round the image point. A point is nan where no ground is seen.
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
    SCORE_1, ORDER_1 (not used here). Boxes have their centres evenly over the image (image_size: width, height in px),
    or over the rectangle of the labelled box centres if that is None. Points are evenly in the rectangle of all
    labelled positions, or 0 if the truth has no positions. Boxes are None if it has no boxes.
    """
    spread = u[:, [ACROSS, DOWN]]
    pos = labelled_points(truth, spread)
    if truth.box is None:
        return pos, None
    if not len(u):
        return pos, np.zeros((0, 4))
    size = truth.box[(u[:, HEIGHT] * len(truth.box)).astype(np.int64), 2:]
    centre = truth.box[:, :2] + truth.box[:, 2:] / 2
    low, high = (centre.min(axis=0), centre.max(axis=0)) if image_size is None else (np.zeros(2), np.array(image_size))
    return pos, np.concatenate([low + spread * (high - low) - size / 2, size], axis=1)
