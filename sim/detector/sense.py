"""The simulated point and box detector: from the truth to the detections that a detector with these settings reports.

A person is detected in a frame if a uniform draw u is below p = detect_prob · visibility^occlusion_power · min(1, size
/ (2 small_px)). visibility is the visible share of the person, size the height of the box in px; the other names are
settings of the sensor. p is 0 if the visibility is below min_visibility, and for people hidden by `sensor.hide`. Each
person has one random stream and each false alarm another; all are read at the frame's own offset. One person or one
frame more therefore changes no other draw, and a changed setting keeps all draws, so that sweeps over settings are
paired. Everything is drawn as uniforms (`sim.detector.draws`).

Errors of boxes are proportional to the box (`sim.detector.box_noise`). A measured profile (`flockscope fit sensor`)
replaces visibility^occlusion_power by a curve, and makes misses and errors correlated over time
(`sim.detector.draws`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.detector import draws
from sim.detector.box_noise import perturb_boxes, seen_shift
from sim.detector.clutter import false_alarms
from sim.detector.draws import Readings
from sim.elementary import normal_quantile, power
from sim.rng import normals, rng, uniforms
from sim.scene.body import SHOULDER_SHARE
from sim.scene.camera import foot_points
from sim.scene.camera_motion import View, by_frame
from sim.schedules import at_rows, looked_at
from sim.types import Array, Bools, Camera, Detections, Ints, Truth

if TYPE_CHECKING:
    from scenarios.schema.sensor import Sensor

DETECT, EDGES, POINT, NORMALS = 0, slice(1, 5), slice(5, 7), 7  # a person's standard normals in a frame
SCORE, ORDER, UNIFORMS = 0, 1, 2  # and uniforms
PERSISTENCE_STEP = 0.1  # s: lag of which `sensor.persistence` is the correlation


def sense(
    truth: Truth, sensor: Sensor, seed: int, camera: View | None = None, image_size: tuple[int, int] | None = None,
    repeat: int = 0, people: Mapping[str, tuple[int, ...]] | None = None,
) -> list[Detections]:  # fmt: skip
    """Returns one Detections for each of the frames 1 to truth.length, with the false alarms of the detector.

    If the truth has positions, `pos` is the ground point (m), with the box beside it if boxes are known. Else `pos` is
    the centre of the box (px). A person whose box has a nan is not detected. Detections of a frame are in random order,
    with scores and without velocities. A frame without any has empty Detections.

    camera, image_size (width, height in px, ignored with a camera): place and size the false alarms. The camera also
    scales `small_px` seen from above, and relates boxes to ground points if `sensor.points` is "seen" or "foot".
    Without both, false alarms are placed by the labels. seed, repeat (number of the suite entry's copy, 0 without
    copies): name the random streams. people: ids of the people of each group that the script names, for `sensor.hide`;
    None: no groups.

    Raises InputError if `sensor.hide` names a group that is not in `people`, AssertionError if the truth has neither
    positions nor boxes, ValueError for a negative seed or person id.
    """
    return sense_owned(truth, sensor, seed, camera, image_size, repeat, people)[0]


def sense_owned(
    truth: Truth, sensor: Sensor, seed: int, camera: View | None = None, image_size: tuple[int, int] | None = None,
    repeat: int = 0, people: Mapping[str, tuple[int, ...]] | None = None,
) -> tuple[list[Detections], list[Ints]]:  # fmt: skip
    """Returns the detections of `sense`, and for each frame the ids (M,) of the people whom they show, -1 for a false
    alarm."""
    true = _true_detections(truth, sensor, seed, repeat, people or {}, camera)
    false = false_alarms(truth, sensor, seed, camera, image_size, repeat)
    looked = looked_at(sensor.every, truth.length, truth.fps)
    return draws.detections_by_frame(draws.in_frames(true, looked), draws.in_frames(false, looked), truth)


def _true_detections(
    truth: Truth, sensor: Sensor, seed: int, repeat: int, people: Mapping[str, tuple[int, ...]], camera: View | None
) -> Readings:
    n, u = person_draws(truth, seed, repeat, sensor)
    hidden = _artificially_hidden(truth, sensor, people)
    p = detection_probability(truth, sensor, camera)
    open_ = (p > 0.0) & (p < 1.0)
    seen = np.where(open_, n[:, DETECT] < normal_quantile(np.where(open_, p, 0.5)), p >= 1.0) & ~hidden
    base = sensed_boxes(truth, sensor.box)
    if base is not None:
        seen &= np.isfinite(base).all(axis=1)
    n, u = n[seen], u[seen]
    visible, times = truth.visibility[seen], (truth.frame[seen] - 1) / truth.fps
    box = None if base is None else perturb_boxes(base[seen], visible, sensor.box_noise, n[:, EDGES], times)
    if truth.pos is not None:
        noise_m = at_rows(sensor.noise_m, truth)[seen, None]
        pos = truth.pos[seen] + noise_m * n[:, POINT] if sensor.noise_m else truth.pos[seen]
        if base is not None and box is not None and camera is not None:
            pos = _displaced(pos, base[seen], box, truth, seen, sensor, camera)
    else:
        assert box is not None, "labels have positions or boxes"
        pos = box[:, :2] + box[:, 2:] / 2
    score = draws.true_scores(u[:, SCORE], visible, sensor)
    return Readings(truth.frame[seen], pos, box, score, u[:, ORDER], truth.id[seen])


def _displaced(pos: Array, sensed: Array, box: Array, truth: Truth, seen: Bools, sensor: Sensor, camera: View) -> Array:
    """Returns the points (N, 2) in m that the detector reports, by `sensor.points`, of points with errors pos (N, 2).

    "own": pos itself. "seen": pos displaced as the foot of the person's sensed box is. "foot": the place on the ground
    at the foot of the reported box, or pos where that shows no ground. sensed, box (N, 4): boxes before and after
    errors, left, top, width, height in px. seen (R,): True for the N rows of the truth to which they belong; their
    ground height counts, 0 if the truth has none.
    """
    if sensor.points == "own" or truth.box is None:
        return pos
    z = np.zeros(len(box)) if truth.z is None else truth.z[seen]
    whole, views = truth.box[seen], list(by_frame(camera, truth.frame[seen], truth.fps))
    if sensor.points == "seen":
        shifts = [seen_shift(sensed[r], whole[r], z[r], one) for one, r in views]
        return np.asarray(pos + np.concatenate([np.zeros((0, 2)), *shifts]))
    at = np.concatenate([foot_points(box[r], z[r], one) for one, r in views])
    return np.where(np.isfinite(at), at, pos)


def person_draws(truth: Truth, seed: int, repeat: int, sensor: Sensor) -> tuple[Array, Array]:
    """Returns the random numbers of each of the R rows of the truth, keyed by the person and the frame.

    Returns standard normals (R, 7) and uniforms (R, 2) above 0 and at most 1. Columns of the normals: DETECT, the
    errors of four box edges, the errors of two point coordinates. A person is detected if DETECT is below the standard
    normal quantile of the detection probability. Columns of the uniforms: SCORE, and ORDER, which decides the position
    in the frame's list.

    With `sensor.persistence` ρ, DETECT is kept for a random time: the misses of one person 0.1 s apart have correlation
    ρ if the detection probability is constant. `sensor.miss_memory` makes DETECT, and `box_noise.memory` the edges, a
    sum of AR(1) processes. All of them run in s, whatever the frame rate. repeat: number of the suite entry's copy, 0
    without copies.

    Raises ValueError for a negative seed or id.
    """
    n, u = np.empty((len(truth.id), NORMALS)), np.empty((len(truth.id), UNIFORMS))
    by_person = np.argsort(truth.id, kind="stable")
    cuts = np.flatnonzero(np.diff(truth.id[by_person])) + 1
    for rows in np.split(by_person, cuts):
        if len(rows):
            n[rows], u[rows] = _one_person(int(truth.id[rows[0]]), truth.frame[rows], seed, repeat, sensor, truth.fps)
    return n, u


def _one_person(id: int, frame: Ints, seed: int, repeat: int, sensor: Sensor, fps: float) -> tuple[Array, Array]:
    first, count = int(frame[0]), int(frame[-1] - frame[0]) + 1
    drawn = draws.frame_uniforms(rng(seed, "detect", id, repeat=repeat), first, count, NORMALS + UNIFORMS)
    n, u = normals(drawn[:, :NORMALS]), drawn[:, NORMALS:]
    parts = ((0, slice(DETECT, DETECT + 1), sensor.miss_memory), (1, EDGES, sensor.box_noise.memory))
    for key, columns, memory in parts:
        n[:, columns] = draws.correlated_normals(n[:, columns], memory or (), first, fps, seed, id, key, repeat=repeat)
    if sensor.persistence:
        tick = draws.ticks(np.arange(first, first + count), fps)
        n[:, DETECT] = _kept(sensor.persistence, int(tick[-1]) + 1, rng(seed, "detect", id, 2, repeat=repeat))[tick]
    return n[frame - first], u[frame - first]


def _kept(persistence: float, count: int, r: np.random.Generator) -> Array:
    """Returns standard normals (count,) at ticks of the detector's clock; each is that of the tick before with a
    probability that leaves the share `persistence` after PERSISTENCE_STEP."""
    drawn = uniforms(r, (count, 2))
    fresh = drawn[:, 0] >= power(persistence, 1.0 / (draws.CLOCK * PERSISTENCE_STEP))
    fresh[0] = True
    return normals(drawn[:, 1])[np.maximum.accumulate(np.where(fresh, np.arange(count), 0))]


def detection_probability(truth: Truth, sensor: Sensor, camera: View | None = None) -> Array:
    """Returns the probability (R,), 0 to 1, that each row of the truth is detected; `sensor.hide` is not considered.

    It is detect_prob times the factor of visibility times min(1, size / (2 small_px)), and 0 where the visibility is
    below min_visibility or nan; these names are settings of the sensor. The factor is visibility^occlusion_power, or
    the curve `sensor.by_visibility` if given. Size is the box's height in px; seen from above (camera of kind "top") it
    is the larger side of the box over 0.27. Size has no effect without boxes or if small_px is 0. A nan size counts as
    0.
    """
    visible = truth.visibility
    curve = sensor.by_visibility
    factor = power(visible, sensor.occlusion_power) if curve is None else draws.interpolated_quantiles(curve, visible)
    p = at_rows(sensor.detect_prob, truth) * factor
    if sensor.small_px and truth.box is not None:
        from_above = isinstance(camera, Camera) and camera.kind == "top"
        size = truth.box[:, 2:].max(axis=1) / SHOULDER_SHARE if from_above else truth.box[:, 3]
        p = p * np.minimum(1.0, np.nan_to_num(size) / (2 * sensor.small_px))
    return np.asarray(np.where(visible >= sensor.min_visibility, p, 0.0))


def _artificially_hidden(truth: Truth, sensor: Sensor, people: Mapping[str, tuple[int, ...]]) -> Bools:
    """Returns True (R,) for the rows of the truth that an entry of `sensor.hide` covers: start <= t < end, in s.

    t is 0 in frame 1. people: ids of the people of each group that the script names. An entry without a group hides
    everybody; without entries all are False. Raises InputError if an entry names a group that is not in `people`.
    """
    t = (truth.frame - 1) / truth.fps
    hidden = np.zeros(len(t), dtype=np.bool_)
    for k, hide in enumerate(sensor.hide):
        if hide.group is not None and hide.group not in people:
            raise InputError(
                file=truth.name, place=f"sensor.hide.{k}.group", got=repr(hide.group),
                expected=f"a group of the script ({', '.join(people) or 'none is known here'})",
                remedy="leave out `group` to hide everybody",
            )  # fmt: skip
        now = (t >= hide.start) & (t < hide.end)
        hidden |= now if hide.group is None else now & np.isin(truth.id, people[hide.group])
    return hidden


def sensed_boxes(truth: Truth, kind: str) -> Array | None:
    """Returns the boxes (R, 4), left, top, width, height in px, that the detector measures, before errors are added.

    They are the boxes of the visible parts; a number that is nan there, as nothing is visible, is taken from the amodal
    box (that of the whole person). If `kind` is "amodal" or the truth has no visible boxes, they are the amodal
    boxes themselves, not a copy. None if the truth has no boxes.
    """
    if truth.box is None or truth.visible_box is None or kind == "amodal":
        return truth.box
    return np.where(np.isfinite(truth.visible_box), truth.visible_box, truth.box)
