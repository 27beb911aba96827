"""False alarms that stay (`sensor.false_alarms`): parts and doubles of people, things taken for people.

Alarms are born as a Poisson process and live for a geometric number of frames, q = exp(-1 / (fps life)) from one to
the next; one that lives shows in a frame with chance `seen`. With rate / seen of them alive from the first frame on,
`clutter_rate` is the number of a frame, Poisson, whatever the life. The k-th born in a frame has a stream of its own:
a higher rate adds some and keeps those that were there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sim.detector.clutter import Ground, clipped, false_scores
from sim.detector.sense import Readings, normals, uniforms
from sim.rng import rng
from sim.scene.body import PERSON_HEIGHT
from sim.types import Array, Bools, Camera, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import FalseAlarms, Sensor

LIFE, NEAR, WHICH, X, Y, TALL, ASPECT, VX, VY, ONCE = range(10)  # an alarm's draws at birth
SHOW, EDGES, SCORE, PLACE, EACH = 0, slice(1, 5), 5, 6, 7  # its draws of each frame
KERNEL = 0.03  # sd of places round those of `at`, in shares


@dataclass(frozen=True)
class Born:
    """B alarms: frame of birth (B,), draws at birth (B, ONCE), and by alarm the draws of its frames (L, EACH)."""

    frame: Ints
    once: Array
    each: list[Array]


def ghosts(truth: Truth, sensor: Sensor, seed: int, camera: Camera | None, size: Array | None, repeat: int) -> Readings:
    """The false alarms of all frames; size (2,) px of the image, None where unknown."""
    model = sensor.false_alarms
    assert model is not None
    ground = Ground(truth, camera, size)
    born = _births(model, sensor.clutter_rate, truth, seed, repeat)
    parts = [_one(model, ground, born, k, seed, repeat) for k in range(len(born.frame))]
    frame = np.concatenate([np.zeros(0, np.int64), *(p[0] for p in parts)])
    rows = np.concatenate([np.zeros((0, 6)), *(p[1] for p in parts)])
    u = np.concatenate([np.zeros((0, EACH)), *(p[2] for p in parts)])
    keep = u[:, SHOW] < model.seen
    box, pos = rows[:, :4], rows[:, 4:]
    if truth.box is not None:
        if sensor.box == "visible" and size is not None:
            box = clipped(box, (int(size[0]), int(size[1])))
        keep &= (box[:, 2:] > 0).all(axis=1)
    frame, box, pos, u = frame[keep], box[keep], pos[keep], u[keep]
    if truth.pos is None:
        pos = box[:, :2] + box[:, 2:] / 2
    return Readings(frame, pos, None if truth.box is None else box, false_scores(sensor, u[:, SCORE]), u[:, PLACE])


def _births(model: FalseAlarms, rate: float, truth: Truth, seed: int, repeat: int) -> Born:
    from scipy.special import pdtr

    q = np.exp(-1.0 / (truth.fps * model.life)) if model.life else 0.0
    alive = rate / model.seen
    u = uniforms(rng(seed, "clutter", 0, 1, repeat=repeat), 1, truth.length, 1)[:, 0]
    k = np.arange(int(alive + 12 * np.sqrt(alive) + 20))
    number = np.searchsorted(pdtr(k, alive * (1.0 - q)) if q < 1 and rate else np.ones(1), u)
    number[:1] = np.searchsorted(pdtr(k, alive) if rate else np.ones(1), u[:1])
    frame = np.repeat(np.arange(1, truth.length + 1), number)
    once, each = np.empty((len(frame), ONCE)), []
    for row, (f, nth) in enumerate((f, n) for f, many in enumerate(number, 1) for n in range(many)):
        stream = rng(seed, "clutter", 1, f, nth, repeat=repeat)
        once[row] = stream.random(ONCE) + 2.0**-54
        lives = 1 + int(np.log(once[row, LIFE]) / np.log(q)) if q else 1
        each.append(stream.random((min(lives, truth.length + 1 - f), EACH)) + 2.0**-54)
    return Born(frame, once, each)


Rows = tuple[Ints, Array, Array]


def _one(model: FalseAlarms, ground: Ground, born: Born, k: int, seed: int, repeat: int) -> Rows:
    """One alarm: its frames (L,), box and ground point (L, 6), draws (L, EACH)."""
    start, once, each = int(born.frame[k]), born.once[k], born.each[k]
    frame = start + np.arange(len(each))
    n = normals(once)
    here = ground.truth.rows(start)
    if once[NEAR] < model.near and here.stop > here.start:
        nth = int(k - np.searchsorted(born.frame, start))
        id = _companion(ground.truth.id[here], seed, start, nth, repeat)
        row, there = _rows_of(ground.truth, id, frame)
        frame, each = frame[there], each[there]
        box, pos = _beside(model, ground, row, n)
    else:
        box, pos = _apart(model, ground, len(each), once, n)
    if model.jitter:
        box = _jittered(box, model.jitter, normals(each[:, EDGES]))
    return frame, np.concatenate([box, pos], axis=1), each


def _companion(ids: Ints, seed: int, frame: int, nth: int, repeat: int) -> int:
    """Whom an alarm goes with: the highest of draws keyed by the person, so that one person more moves few alarms."""
    draws = [rng(seed, "clutter", 2, frame, nth, int(id), repeat=repeat).random() for id in ids]
    return int(ids[int(np.argmax(draws))])


def _rows_of(truth: Truth, id: int, frame: Ints) -> tuple[Ints, Bools]:
    """Rows of a person in the first of those frames until he leaves, and which of the frames they are."""
    mine = np.flatnonzero(truth.id == id)
    place = np.minimum(np.searchsorted(truth.frame[mine], frame), len(mine) - 1)
    there = np.logical_and.accumulate(truth.frame[mine[place]] == frame)
    return mine[place[there]], there


def _beside(model: FalseAlarms, ground: Ground, row: Ints, n: Array) -> tuple[Array, Array]:
    """Boxes (L, 4) and points (L, 2) that go with a person in these rows of the truth."""
    truth = ground.truth
    across, down = (mean + sd * n[c] for (mean, sd), c in ((model.across, X), (model.foot, Y)))
    pos = (
        np.zeros((len(row), 2)) if truth.pos is None else truth.pos[row] + PERSON_HEIGHT * across * np.array([1.0, 0.0])
    )
    if truth.box is None:
        return np.zeros((len(row), 4)), pos
    left, top, w, h = truth.box[row].T
    tall = h * np.exp(model.near_height[0] + model.near_height[1] * n[TALL])
    box = _upright(left + w / 2 + h * across, top + h * (1.0 + down), tall, model, n)
    return box, ground.points(box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3], pos)


def _apart(model: FalseAlarms, ground: Ground, frames: int, once: Array, n: Array) -> tuple[Array, Array]:
    """Boxes (L, 4) and points (L, 2) of one that goes its own way, or stands."""
    x, y = once[X], once[Y]
    if model.at:
        x, y = model.at[min(int(once[WHICH] * len(model.at)), len(model.at) - 1)]
        x, y = x + KERNEL * n[X], y + KERNEL * n[Y]
    u, v = ground.place(float(np.clip(x, 0.0, 1.0)), float(np.clip(y, 0.0, 1.0)))
    tall = ground.usual_height(u, v) * np.exp(model.height[0] + model.height[1] * n[TALL])
    away = model.drift * tall / ground.truth.fps * np.arange(frames)
    u, v = u + away * n[VX], v + away * n[VY]
    box = _upright(u, v, np.full(frames, tall), model, n)
    return box, ground.points(u, v, np.tile(ground.anywhere(x, y), (frames, 1)))


def _upright(middle: Array, foot: Array, tall: Array, model: FalseAlarms, n: Array) -> Array:
    wide = tall * np.exp(model.aspect[0] + model.aspect[1] * n[ASPECT])
    return np.stack([middle - wide / 2, foot - tall, wide, tall], axis=1)


def _jittered(box: Array, jitter: float, n: Array) -> Array:
    edges = np.concatenate([box[:, :2], box[:, :2] + box[:, 2:]], axis=1) + jitter * box[:, 3:] * n
    size = np.maximum(edges[:, 2:] - edges[:, :2], np.minimum(box[:, 2:], 1.0))
    return np.concatenate([edges[:, :2], size], axis=1)
