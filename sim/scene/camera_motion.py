"""A camera that moves while it records: its pose at any time, and what follows from it frame by frame.

A pose is a pure function of time, so the same seed has the same camera at common times of two frame rates, and before
frame 1, too. With R the rotation (world to camera) of the camera at rest:
    shake    R(t) = turn(a(t), b(t), c(t)) R: angles to the right, downwards and clockwise, each a sum of WAVES waves of
             equal amplitude whose frequencies are even in a band and whose phases are drawn
    pan      R(t) = R turned about the vertical
    drift    R(t) = turn(w t cos d, w t sin d, 0) R, with the direction d drawn
    robot    the position is on the path; the heading is that of the chord from LOOK behind it to LOOK ahead of it
Everything is computed with `sim.elementary`: the truth follows from it and must not depend on the processor.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.elementary import PI, atan2, dot, length, product, sin, unit
from sim.rng import rng, uniforms
from sim.scene.camera import camera_rotation, require_camera
from sim.scene.camera_placement import pinhole, place_camera
from sim.schedules import values_at
from sim.types import Array, Camera, Ints, Motion

if TYPE_CHECKING:
    from scenarios.schema.camera_motion import DriftSpec, PanSpec, RobotSpec, ShakeSpec
    from scenarios.schema.scenario import CameraSpec

WAVES = 12  # of each angle of a shake
LOOK = 0.5  # m along the path, behind and ahead, between which the heading is taken
STEP = 0.7  # m: length of a robot's step
DEGREE = PI / 180.0
DECIMALS = 9  # of a time in s that count

Pose = Callable[[float], Camera]


@dataclass(frozen=True, eq=False)
class MovingCamera:
    """A camera with a pose for each time. rest: its pose without the motion; of a robot, that of frame 1."""

    rest: Camera
    pose: Pose

    def at(self, t: float) -> Camera:
        """Returns the camera t s after frame 1, which may be negative."""
        # The same time, reached at two frame rates, differs in its last bit.
        return self.pose(round(t, DECIMALS))


View = Camera | MovingCamera


def place_view(spec: CameraSpec, motion: Motion) -> View:
    """Returns the camera of a scenario, with its motion if it has one.

    A camera at rest is placed by `camera_placement.place_camera`, which checks that everybody is in view; people may
    leave the view of one that moves. Raises InputError as there, and if the camera cannot move so.
    """
    moved = spec.motion
    if moved is not None and spec.kind != "pinhole":
        got, remedy = f"kind {spec.kind}", "set camera.kind = 'pinhole', and camera.tilt_deg = 90 to look down"
        raise InputError(place="camera.motion", got=got, expected="a pinhole camera", remedy=remedy)
    if moved is not None and moved.kind == "robot":
        return _walking(moved, spec)
    rest = place_camera(spec, motion)
    if moved is None:
        return rest
    drawn = uniforms(rng(motion.seed, "camera", repeat=motion.repeat), (3, 2, WAVES))
    if moved.kind == "shake":
        return MovingCamera(rest, _shake(moved, rest, drawn))
    return MovingCamera(rest, _pan(moved, rest) if moved.kind == "pan" else _drift(moved, rest, float(drawn[0, 0, 0])))


def cameras_of_frames(view: View, fps: float, frames: int) -> tuple[Camera, ...]:
    """Returns the camera of each of the frames 1 … `frames` at fps frames/s."""
    return tuple(camera_at(view, k / fps) for k in range(frames))


def camera_at(view: View, t: float) -> Camera:
    """Returns the camera t s after frame 1."""
    return view if isinstance(view, Camera) else view.at(t)


def by_frame(view: View, frame: Ints, fps: float) -> Iterator[tuple[Camera, slice]]:
    """Yields the camera of each frame and its rows; for a camera that stands still all rows at once.

    frame (R,): of each row, from 1, sorted. Without rows, one camera with no rows is yielded.
    """
    if isinstance(view, Camera) or not len(frame):
        yield camera_at(view, 0.0), slice(0, len(frame))
        return
    starts = [0, *(np.flatnonzero(np.diff(frame)) + 1).tolist(), len(frame)]
    for first, end in pairwise(starts):
        yield view.at((int(frame[first]) - 1) / fps), slice(first, end)


def turn(right: float, down: float, roll: float) -> Array:
    """Returns the rotation (3, 3), applied from the left, of a camera that turns to the right, then down, then
    clockwise; rad."""
    (ca, sa), (cb, sb), (cc, sc) = (unit(angle) for angle in (right, down, roll))
    to_right = np.array([[ca, 0.0, -sa], [0.0, 1.0, 0.0], [sa, 0.0, ca]])
    downwards = np.array([[1.0, 0.0, 0.0], [0.0, cb, -sb], [0.0, sb, cb]])
    clockwise = np.array([[cc, sc, 0.0], [-sc, cc, 0.0], [0.0, 0.0, 1.0]])
    return product(clockwise, product(downwards, to_right))


def _shake(spec: ShakeSpec, rest: Camera, drawn: Array) -> Pose:
    low, high = spec.band
    omega = 2.0 * PI * (low + drawn[:, 0] * (high - low))
    phase = 2.0 * PI * drawn[:, 1]
    px = spec.px if isinstance(spec.px, float) else max(spec.px.value)
    sd = np.array([px / rest.focal_px[0], px / rest.focal_px[1], spec.roll_deg * DEGREE])
    amplitude = sd * np.sqrt(2.0 / WAVES)

    def pose(t: float) -> Camera:
        waves = sin(omega * t + phase)
        angles = dot(waves, np.ones_like(waves)) * amplitude
        if not isinstance(spec.px, float) and px:
            angles = angles * (values_at(spec.px, np.array([t])) / px)
        right, down, roll = angles.tolist()
        return rest.replace(rotation=product(turn(right, down, roll), rest.rotation))

    return pose


def _pan(spec: PanSpec, rest: Camera) -> Pose:
    def pose(t: float) -> Camera:
        angle = spec.deg_per_s * t
        if spec.sweep_deg is not None:
            # A triangle wave: from 0 to the sweep and back.
            there = abs(angle) % (2.0 * spec.sweep_deg)
            angle = min(there, 2.0 * spec.sweep_deg - there) * (1.0 if angle >= 0 else -1.0)
        c, s = unit(angle * DEGREE).tolist()
        left = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        return rest.replace(rotation=product(rest.rotation, left))

    return pose


def _drift(spec: DriftSpec, rest: Camera, share: float) -> Pose:
    right, down = (spec.deg_per_s * DEGREE * unit(2.0 * PI * share)).tolist()
    return lambda t: rest.replace(rotation=product(turn(right * t, down * t, 0.0), rest.rotation))


def _walking(spec: RobotSpec, camera: CameraSpec) -> MovingCamera:
    given = [key for key in ("height", "position") if getattr(camera, key) is not None]
    if given:
        place, remedy = f"camera.{given[0]}", "leave it out: camera.motion.height and path say where a robot is"
        raise InputError(place=place, got="a value", expected="none beside motion.kind = 'robot'", remedy=remedy)
    points = np.array(spec.path, dtype=float)
    legs = np.diff(points, axis=0)
    reach = length(legs)
    ahead, end = legs / reach[:, None], np.cumsum(reach)
    start, whole = end - reach, float(end[-1])
    tilt, aside = camera.tilt_deg * DEGREE, (camera.yaw_deg or 0.0) * DEGREE

    def on_path(s: float) -> Array:
        """Returns the point at s m of the path, which goes straight on before its first and after its last point."""
        leg = max(int(np.searchsorted(start, s, "right")) - 1, 0)
        return np.asarray(points[leg] + (s - start[leg]) * ahead[leg])

    def pose(t: float) -> Camera:
        s = min(max(spec.speed * t, 0.0), whole)
        dx, dy = (on_path(s + LOOK) - on_path(s - LOOK)).tolist()
        heading = float(atan2(dy, dx)) - PI / 2.0  # as a yaw: 0 looks along +y
        z = spec.height + spec.bob * float(sin(2.0 * PI * s / STEP))
        return pinhole(camera, np.array([*on_path(s).tolist(), z]), camera_rotation(tilt, heading + aside))

    return MovingCamera(require_camera(pose(0.0), place="camera"), pose)
