"""The point and box sensor: what a detector with these settings would report of what is true.

Who is detected: u < p with p = detect_prob · visibility^occlusion_power · min(1, size / (2 small_px)), 0 below
min_visibility and while hidden. Each person has one stream, each place of a false alarm another, all read at the
frame's own offset: a person or a frame more moves nobody else, and a setting changed leaves all other draws as they
were, so that sweeps are paired. Everything is drawn as uniforms; normals are their quantiles.
A measured profile (`flockscope fit sensor`) puts a curve in the place of visibility^occlusion_power, makes luck and
noise last (sim.detector.correlated_noise) and noise grow with the box (sim.detector.box_noise).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.rng import rng
from sim.scene.body import SHOULDER_SHARE
from sim.types import Array, Bools, Camera, Detections, Ints, Plane, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

KEEP, DETECT, EDGES, POINT, SCORE, PLACE, DRAWS = 0, 1, slice(2, 6), slice(6, 8), 8, 9, 10  # a person's frame's draws


@dataclass(frozen=True)
class Readings:
    """R detections of a whole sequence: frame (R,), pos (R, 2), box (R, 4) or None, score (R,), place (R,) in (0, 1):
    where in its frame's list each stands, so that the order tells nothing."""

    frame: Ints
    pos: Array
    box: Array | None
    score: Array
    place: Array


def sense(
    truth: Truth,
    sensor: Sensor,
    seed: int,
    camera: Camera | None = None,
    image_size: tuple[int, int] | None = None,
    repeat: int = 0,
    people: Mapping[str, tuple[int, ...]] | None = None,
) -> list[Detections]:
    """The detections of frames 1 … length.

    On the ground (pos = point, box beside it where boxes are known) if the truth has positions, else in the image
    (pos = the box's centre). people: ids of each group of the script, for `hide`; InputError for an unknown group, and
    for visible boxes of a truth that has none.
    """
    from sim.detector.clutter import false_alarms

    if sensor.box == "visible" and truth.box is not None and truth.visible_box is None:
        raise InputError(
            file=truth.name, place="sensor.box", got="visible", expected="amodal: the visible parts are not labelled",
            remedy="leave sensor.box out",
        )  # fmt: skip
    true = _found(truth, sensor, seed, repeat, people or {}, camera)
    false = false_alarms(truth, sensor, seed, camera, image_size, repeat)
    return _by_frame(true, false, truth)


def _by_frame(true: Readings, false: Readings, truth: Truth) -> list[Detections]:
    frame = np.concatenate([true.frame, false.frame])
    order = np.lexsort((np.concatenate([true.place, false.place]), frame))
    pos = np.concatenate([true.pos, false.pos])[order]
    score = np.concatenate([true.score, false.score])[order]
    box = None if true.box is None or false.box is None else np.concatenate([true.box, false.box])[order]
    plane: Plane = "image" if truth.pos is None else "ground"
    cuts = np.searchsorted(frame[order], np.arange(1, truth.length + 2))
    found = []
    for k, (a, b) in enumerate(pairwise(cuts)):
        here = None if box is None else box[a:b]
        found.append(Detections(k + 1, k / truth.fps, plane, pos[a:b], None, here, score[a:b]))
    return found


def _found(
    truth: Truth, sensor: Sensor, seed: int, repeat: int, people: Mapping[str, tuple[int, ...]], camera: Camera | None
) -> Readings:
    """The true detections."""
    u = person_draws(truth, seed, repeat, sensor)
    hidden = _hidden(truth, sensor, people)
    seen = (u[:, DETECT] < detection_probability(truth, sensor, camera)) & ~hidden
    base = _boxes(truth, sensor)
    if base is not None:
        seen &= np.isfinite(base).all(axis=1)
    u = u[seen]
    box = None if base is None else _boxed(base[seen], truth.visibility[seen], sensor, u[:, EDGES])
    if truth.pos is not None:
        pos = truth.pos[seen] + sensor.noise_m * normals(u[:, POINT]) if sensor.noise_m else truth.pos[seen]
        if sensor.points == "foot" and box is not None and camera is not None:
            pos = _standing(box, truth, seen, camera, pos)
    else:
        assert box is not None, "labels have positions or boxes"
        pos = box[:, :2] + box[:, 2:] / 2
    score = true_scores(u[:, SCORE], truth.visibility[seen], sensor)
    return Readings(truth.frame[seen], pos, box, score, u[:, PLACE])


def _standing(box: Array, truth: Truth, seen: Bools, camera: Camera, otherwise: Array) -> Array:
    """The ground under the boxes' feet; the point sensor's where a box shows none."""
    from sim.detector.box_noise import feet

    z = np.zeros(len(box)) if truth.z is None else truth.z[seen]
    pos = feet(box, z, camera)
    return np.where(np.isfinite(pos), pos, otherwise)


def _boxed(box: Array, visibility: Array, sensor: Sensor, u: Array) -> Array:
    if sensor.box_noise is None:
        return _noisy_boxes(box, sensor.noise_px, u)
    from sim.detector.box_noise import erring

    return erring(box, visibility, sensor.box_noise, normals(u))


def person_draws(truth: Truth, seed: int, repeat: int, sensor: Sensor) -> Array:
    """Uniforms in (0, 1) for each row of the truth, (R, DRAWS), keyed by the person and the frame.

    persistence ρ: a person's DETECT is the previous frame's again with chance ρ; it stays uniform, and misses of
    neighbouring frames are correlated by exactly ρ where the detection probability does not change. Memories make
    the normal quantiles of DETECT or EDGES last instead.
    """
    u = np.empty((len(truth.id), DRAWS))
    by_person = np.argsort(truth.id, kind="stable")
    cuts = np.flatnonzero(np.diff(truth.id[by_person])) + 1
    for rows in np.split(by_person, cuts):
        if len(rows):
            u[rows] = _one_person(int(truth.id[rows[0]]), truth.frame[rows], seed, repeat, sensor, truth.fps)
    return u


def _one_person(id: int, frame: Ints, seed: int, repeat: int, sensor: Sensor, fps: float) -> Array:
    first = int(frame[0])
    u = uniforms(rng(seed, "detect", id, repeat=repeat), first, int(frame[-1]) - first + 1, DRAWS)
    _make_last(u, first, sensor, fps, seed, id, repeat)
    if sensor.persistence:
        fresh = u[:, KEEP] >= sensor.persistence
        fresh[0] = True
        source = np.maximum.accumulate(np.where(fresh, np.arange(len(u)), 0))
        u[:, DETECT] = u[source, DETECT]
    return u[frame - first]


def _make_last(u: Array, first: int, sensor: Sensor, fps: float, seed: int, id: int, repeat: int) -> None:
    """Misses and errors of boxes that last, in the place of new ones; u (F, DRAWS) of frames `first` … is changed."""
    of_boxes = None if sensor.box_noise is None else sensor.box_noise.memory
    parts = ((0, slice(DETECT, DETECT + 1), sensor.miss_memory), (1, EDGES, of_boxes))
    for key, columns, memory in parts:
        if memory:
            from scipy.special import ndtr

            from sim.detector.correlated_noise import lasting

            u[:, columns] = ndtr(lasting(normals(u[:, columns]), memory, first, fps, seed, id, key, repeat=repeat))


def uniforms(generator: np.random.Generator, first: int, frames: int, per_frame: int) -> Array:
    """Uniforms in (0, 1), (frames, per_frame), for frames `first` … of a stream that spends per_frame on each frame."""
    generator.bit_generator.advance((first - 1) * per_frame)  # type: ignore[attr-defined]
    return np.asarray(generator.random((frames, per_frame)) + 2.0**-54)


def detection_probability(truth: Truth, sensor: Sensor, camera: Camera | None = None) -> Array:
    """The chance of each row to be detected, (R,), hiding apart."""
    visible = truth.visibility
    p = sensor.detect_prob * _in_sight(visible, sensor)
    if sensor.small_px and truth.box is not None:
        from_above = camera is not None and camera.kind == "top"
        # Seen from above a person is as large as one of this shoulder width is high when seen from the side.
        size = truth.box[:, 2:].max(axis=1) / SHOULDER_SHARE if from_above else truth.box[:, 3]
        p = p * np.minimum(1.0, np.nan_to_num(size) / (2 * sensor.small_px))
    return np.asarray(np.where(visible >= sensor.min_visibility, p, 0.0))


def _in_sight(visible: Array, sensor: Sensor) -> Array:
    """What occlusion leaves of the chance to be detected."""
    if sensor.by_visibility is None:
        return np.asarray(visible**sensor.occlusion_power)
    return np.interp(visible, np.linspace(0.0, 1.0, len(sensor.by_visibility)), sensor.by_visibility)


def _hidden(truth: Truth, sensor: Sensor, people: Mapping[str, tuple[int, ...]]) -> Bools:
    t = (truth.frame - 1) / truth.fps
    hidden = np.zeros(len(t), dtype=np.bool_)
    for k, hide in enumerate(sensor.hide):
        if hide.group is not None and hide.group not in people:
            raise InputError(
                file=truth.name, place=f"sensor.hide.{k}.group", got=repr(hide.group),
                expected=f"one of the script's groups ({', '.join(people) or 'none is known here'})",
                remedy="leave out `group` to hide everybody",
            )  # fmt: skip
        now = (t >= hide.start) & (t < hide.end)
        hidden |= now if hide.group is None else now & np.isin(truth.id, people[hide.group])
    return hidden


def _boxes(truth: Truth, sensor: Sensor) -> Array | None:
    """What the sensor frames: the visible part (amodal where nothing is), or all of it."""
    if truth.box is None or truth.visible_box is None or sensor.box == "amodal":
        return truth.box
    return np.where(np.isfinite(truth.visible_box), truth.visible_box, truth.box)


def _noisy_boxes(box: Array, noise: float, u: Array) -> Array:
    """Each edge moved by noise · N(0, 1); at least 1 px (or what there was) remains of width and height."""
    if not noise:
        return box
    move = noise * normals(u)
    edges = np.concatenate([box[:, :2], box[:, :2] + box[:, 2:]], axis=1) + move
    size = np.maximum(edges[:, 2:] - edges[:, :2], np.minimum(box[:, 2:], 1.0))
    return np.concatenate([edges[:, :2], size], axis=1)


def quantiles(curve: tuple[float, ...], u: Array) -> Array:
    """The quantile function through evenly spaced quantiles, at u."""
    return np.interp(u, np.linspace(0.0, 1.0, len(curve)), curve)


def normals(u: Array) -> Array:
    """Standard normals at these uniforms; one that was rounded to 1 is taken for the number below."""
    from scipy.special import ndtri

    return np.asarray(ndtri(np.minimum(u, 1.0 - 2.0**-53)))


def true_scores(u: Array, visibility: Array, sensor: Sensor) -> Array:
    """Confidence of true detections: mean 0.8 in full view, half of that when hardly visible; 1 if it never errs.

    Where the detector's own scores are known, their quantiles.
    """
    if sensor.true_scores is not None:
        return quantiles(sensor.true_scores, u)
    if sensor.detect_prob == 1.0 and sensor.clutter_rate == 0.0:
        return np.ones(len(u))
    return np.asarray((0.4 + 0.6 * np.sqrt(u)) * (0.5 + 0.5 * visibility))
