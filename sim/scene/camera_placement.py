"""Where a scenario's camera stands: the closest place from which every body is in view, in closed form.

A direction that the scenario leaves out is the one of eight in which people look largest in the median. With the
rotation given, the image's four edges are planes through the camera's centre C with fixed inward normals n. A body
(ellipsoid with centre c and shape matrix S) is in view if and only if n·C <= n·c - sqrt(nᵀ S n) for each edge. Only the
least right-hand side b over all bodies and frames matters. C is solved in camera coordinates (right, down, forward):
the left and right planes limit (right, forward), the upper and lower planes limit (down, forward). A height or position
that the scenario gives fixes coordinates of C first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.elementary import dot, product, turned
from sim.scene.body import PERSON_HEIGHT, Ellipsoids, RecordedBodies, ellipsoids, recorded_bodies
from sim.scene.camera import camera_rotation, require_camera
from sim.types import Array, Bools, Camera, Motion

if TYPE_CHECKING:
    from scenarios.schema.scenario import CameraSpec

MARGIN = 0.02  # kept free along each image edge, as a share of the image's shorter side
LOWEST = 0.3  # m: no solved height is lower
TOP_HEIGHT = 20.0  # m: height of a camera from above if not given; it affects nothing but depth
YAWS = tuple(range(0, 360, 45))  # degrees: directions to choose from
TOLERANCE = 1e-6


def place_camera(spec: CameraSpec, motion: Motion) -> Camera:
    """Returns the Camera of a scenario; what its settings leave out is solved: yaw, position, height, and px_per_m for
    kind "top".

    It is placed so that the bodies of all frames are in view and as large as possible, with a margin of 2 % of the
    image's shorter side. No solved height is below 0.3 m. Kind "top" uses the yaw and ignores tilt and baseline; a
    height that is not given is 20 m. With `spec.crop`, only bodies on the world's rectangle are fitted, and others may
    leave the view. Without bodies to fit, four standard people in the world's corners are fitted.

    spec: the scenario's camera settings. motion: the crowd's motion, with its scene.

    Raises InputError, naming the first person out of view, if `spec.crop` is false and a body is not wholly in the
    image. That can happen where position, height or scale are given, or where the tilt allows no place. Also raises
    InputError for a camera that cannot be used, as one that sees no ground (sim.scene.camera).
    """
    everybody = recorded_bodies(motion)
    aimed = _bodies_to_fit(everybody, motion, spec.crop)
    made = (
        _top(spec, aimed) if spec.kind == "top" else _pinhole(spec, aimed, _yaw(spec, _each_second(aimed, motion.fps)))
    )
    camera = require_camera(made, place="camera")
    if not spec.crop:
        _check_all_in_view(camera, spec, everybody, motion)
    return camera


def _select(bodies: RecordedBodies, keep: Bools) -> RecordedBodies:
    shapes = Ellipsoids(bodies.shapes.centre[keep], bodies.shapes.shape[keep])
    return RecordedBodies(bodies.frame[keep], bodies.id[keep], bodies.pos3[keep], shapes)


def _bodies_to_fit(bodies: RecordedBodies, motion: Motion, crop: bool) -> RecordedBodies:
    """Returns the bodies to keep in view: all of `bodies` or, with `crop`, those whose feet are in the world's
    rectangle, edges included.

    If there are none, the result is four bodies of standard people (1.7 m) in the world's corners, with frame 0 and id
    0. motion: gives the scene's size.
    """
    if crop:
        xy = bodies.pos3[:, :2]
        bodies = _select(bodies, np.all((xy >= 0) & (xy <= motion.scene.size), axis=1))
    if len(bodies.id):
        return bodies
    w, d = motion.scene.size
    corners = np.array([[0, 0, 0], [w, 0, 0], [0, d, 0], [w, d, 0]], dtype=float)
    none = np.zeros(4, np.int64)
    return RecordedBodies(none, none, corners, ellipsoids(corners, np.zeros(4), np.full(4, PERSON_HEIGHT)))


def _reach(bodies: RecordedBodies, normals: Array) -> Array:
    """Returns how far each of B bodies reaches against each of K normals, (B, K) m: the least n·X over its points X.

    normals (K, 3). For an ellipsoid (centre c, shape S) it is n·c - sqrt(nᵀ S n); the smaller of body and head counts.
    """
    centre = turned(normals, bodies.shapes.centre)
    spread = np.sqrt(dot(turned(normals, bodies.shapes.shape).swapaxes(-1, -2), normals))
    return np.asarray((centre - spread).min(axis=1))


def _slopes(spec: CameraSpec, margin: float) -> tuple[float, float]:
    """Returns half the width and half the height of the view, in m per m of depth, less `margin` px on each side.

    spec: gives the image size and focal length, both in px.
    """
    return (spec.image[0] / 2 - margin) / spec.focal_px, (spec.image[1] / 2 - margin) / spec.focal_px


def _edges(rotation: Array, slopes: tuple[float, float]) -> Array:
    """Returns the inward normals (4, 3), in the world, of the planes through the left, right, upper and lower image
    edge.

    rotation (3, 3): world to camera. slopes: half the view's width and half its height, in m per m of depth. The
    normals are not unit vectors.
    """
    k, m = slopes
    return product(np.array([[1, 0, k], [-1, 0, k], [0, 1, m], [0, -1, m]]), rotation)


def _each_second(bodies: RecordedBodies, fps: float) -> RecordedBodies:
    """Returns the bodies of the first frame of each second; all bodies if there are none in these frames."""
    first = np.floor((bodies.frame - 1) / fps) > np.floor((bodies.frame - 2) / fps)
    return _select(bodies, first) if first.any() else bodies


def _yaw(spec: CameraSpec, bodies: RecordedBodies) -> float:
    """Returns the yaw of a pinhole camera in degrees: the given one; 0 if height or position is given; else the one of
    YAWS in which a person of 1.7 m in the place of each body is highest in the median, the first of equals.
    """
    if spec.yaw_deg is not None:
        return spec.yaw_deg
    if spec.height is not None or spec.position is not None:
        return 0.0

    def height(yaw: float) -> float:
        camera = _pinhole(spec, bodies, yaw)
        feet = turned(camera.rotation, bodies.pos3 - camera.position)
        head = feet + PERSON_HEIGHT * camera.rotation[:, 2]
        return float(np.median(feet[:, 1] / feet[:, 2] - head[:, 1] / head[:, 2]))

    return max(YAWS, key=height)


def _pinhole(spec: CameraSpec, bodies: RecordedBodies, yaw: float) -> Camera:
    """Returns a pinhole camera with all bodies in view: at the given position or height, else at the closest place.

    spec: camera settings; its tilt, focal length and image size are used as they are. yaw: degrees. A margin of 2 % of
    the image's shorter side is kept free. A solved height is at least 0.3 m. If the given values leave no such place,
    bodies may be out of view; nothing is raised. There must be at least one body.
    """
    rotation = camera_rotation(spec.tilt_deg / 180 * np.pi, yaw / 180 * np.pi)
    slopes = _slopes(spec, MARGIN * min(spec.image))
    normals = _edges(rotation, slopes)
    b = _reach(bodies, normals).min(axis=0)
    if spec.position is not None:
        centre = np.array([*spec.position, _height_at_position(spec, normals, b)])
    elif spec.height is not None:
        centre = _at_height(spec.height, rotation, slopes, b)
    else:
        centre = _closest(rotation, slopes, b)
        if centre[2] < LOWEST:
            centre = _at_height(LOWEST, rotation, slopes, b)
    return pinhole(spec, centre, rotation)


def pinhole(spec: CameraSpec, centre: Array, rotation: Array) -> Camera:
    """Returns the pinhole camera of these settings at a place centre (3,), m. rotation (3, 3): world to camera."""
    return _camera(spec, centre, rotation, baseline=spec.baseline)


def _camera(spec: CameraSpec, centre: Array, rotation: Array, baseline: float = 0.0, scale: float = np.nan) -> Camera:
    focal = (spec.focal_px, spec.focal_px)
    middle = (spec.image[0] / 2, spec.image[1] / 2)
    return Camera(spec.kind, spec.image, focal, middle, centre, rotation, baseline, scale)


def _closest(rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """Returns the camera centre (3,) in m, in the world, that is furthest forward with all bodies in view.

    rotation (3, 3): world to camera. slopes: half the view's width and half its height per m of depth. b (4,): least
    reach (n·X over all their points X) of the bodies against the left, right, upper and lower edge's inward normal n,
    m. Two opposite planes with the reaches b1 and b2 meet at forward = (b1 + b2) / (2 slope). The pair that meets first
    limits; the other pair is centred.
    """
    forward = min((b[0] + b[1]) / (2 * slopes[0]), (b[2] + b[3]) / (2 * slopes[1]))
    return turned(rotation.T, np.array([(b[0] - b[1]) / 2, (b[2] - b[3]) / 2, forward]))


def _at_height(height: float, rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """Returns the camera centre (3,) in m at this height (m), as far ahead over the ground as the image edges allow.

    rotation (3, 3): world to camera. slopes: half the view's width and half its height per m of depth. b (4,): least
    reach (n·X over all their points X) of the bodies against the left, right, upper and lower edge's inward normal n,
    m. If the edges contradict each other, the middle between the contradicting limits is taken. A camera that looks
    straight down is put in the middle of both limits.
    """
    k, m = slopes
    ahead = np.cross([0.0, 0.0, 1.0], rotation[0])
    base = np.array([0.0, 0.0, height])
    down, forward = rotation[1], rotation[2]
    limits = [
        (float(dot(forward, ahead)) * k, (b[0] + b[1]) / 2 - k * float(dot(forward, base))),
        (float(dot(down + m * forward, ahead)), b[2] - float(dot(down + m * forward, base))),
        (float(dot(m * forward - down, ahead)), b[3] - float(dot(m * forward - down, base))),
    ]
    straight_down = limits[0][0] < TOLERANCE  # going ahead brings nothing nearer: take the middle of both limits
    g = _largest(limits) if not straight_down else (_largest(limits) - _largest([(-a, c) for a, c in limits])) / 2
    return np.asarray(base + g * ahead + (b[0] - b[1]) / 2 * rotation[0])


def _largest(limits: list[tuple[float, float]]) -> float:
    """Returns the largest g with a g <= c for all pairs (a, c) of limits.

    If none exists, it is the middle between the least upper and the greatest lower limit. Without an upper limit it is
    the greatest lower limit; without any limit 0. Pairs with |a| <= 1e-6 are ignored.
    """
    upper = min((c / a for a, c in limits if a > TOLERANCE), default=np.inf)
    lower = max((c / a for a, c in limits if a < -TOLERANCE), default=-np.inf)
    if not np.isfinite(upper):
        return float(lower) if np.isfinite(lower) else 0.0
    return float(upper if lower <= upper else (lower + upper) / 2)


def _height_at_position(spec: CameraSpec, normals: Array, b: Array) -> float:
    """Returns the camera's height in m: the given one, or the lowest at the given position with all bodies in view.

    spec: camera settings with a position. normals (4, 3), b (4,): inward normals n of the left, right, upper and lower
    image edge, and the bodies' least reach (n·X over all their points X) against each, m. A solved height is at least
    0.3 m. If no height fits, the middle between the limits is returned.
    """
    if spec.height is not None:
        return spec.height
    position = np.array(spec.position, dtype=float)
    limits = [(-n[2], float(c - dot(n[:2], position))) for n, c in zip(normals, b, strict=True)]
    return max(LOWEST, -_largest(limits))


def _top(spec: CameraSpec, bodies: RecordedBodies) -> Camera:
    """Returns a camera of kind "top": over the middle of the bodies' extent, at the largest scale that shows all.

    A margin of 2 % of the image's shorter side is kept free. Half the extent counts as at least 0.1 m. spec: camera
    settings; a given position (x, y in the world, m), px_per_m or height is used as it is. yaw turns the picture, 0 if
    not given; tilt and baseline are ignored. A height that is not given is 20 m. There must be at least one body.
    """
    rotation = camera_rotation(np.pi / 2, (spec.yaw_deg or 0.0) / 180 * np.pi)
    sides = np.concatenate([rotation[:2], -rotation[:2]])
    low_x, low_y, minus_high_x, minus_high_y = _reach(bodies, sides).min(axis=0)
    low, high = np.array([low_x, low_y]), -np.array([minus_high_x, minus_high_y])
    middle = (low + high) / 2 if spec.position is None else turned(rotation[:2, :2], np.array(spec.position))
    half = np.maximum(np.maximum(high - middle, middle - low), 0.1)
    room = np.array(spec.image) / 2 - MARGIN * min(spec.image)
    scale = spec.px_per_m if spec.px_per_m is not None else float((room / half).min())
    xy = turned(rotation[:2, :2].T, middle)
    return _camera(spec, np.array([*xy, spec.height or TOP_HEIGHT]), rotation, scale=scale)


def _check_all_in_view(camera: Camera, spec: CameraSpec, bodies: RecordedBodies, motion: Motion) -> None:
    """Returns nothing; raise InputError, naming the first body (by frame, then id) that is not wholly inside the image,
    if there is one.

    A body may reach out of the view by at most 1e-6 m. Without bodies nothing is raised. spec: camera settings, for the
    focal length and the message. motion: gives scenario name and seed for the message.
    """
    if camera.kind == "top":
        sides = np.concatenate([camera.rotation[:2], -camera.rotation[:2]])
        half = np.array(camera.image) / (2 * camera.px_per_m)
        slack = _reach(bodies, sides) - turned(sides, camera.position) + np.concatenate([half, half])
    else:
        normals = _edges(camera.rotation, _slopes(spec, 0.0))
        slack = _reach(bodies, normals) - turned(normals, camera.position)
    out = np.flatnonzero((slack < -TOLERANCE).any(axis=1))
    if not len(out):
        return
    given = [key for key in ("height", "position", "px_per_m") if getattr(spec, key) is not None]
    k = int(out[0])
    x, y = bodies.pos3[k, :2]
    raise InputError(
        file=f"scenario {motion.name}",
        place=(", ".join(f"camera.{key}" for key in given) or "camera") + f" (seed {motion.seed})",
        got=f"person {bodies.id[k]} out of view in frame {bodies.frame[k]} at ({x:.1f}, {y:.1f})",
        expected="all people in view in every frame",
        remedy=f"leave out {' and '.join(given) or 'tilt_deg'} to have the view solved, or set camera.crop = true",
    )
