"""Where a scenario's camera stands: the closest place from which every body is in view, in closed form.

With the rotation given, the image's four edges are planes through the camera's centre C with fixed inward normals n. A
body (ellipsoid with centre c and shape S) is in view if and only if n·C <= n·c - sqrt(nᵀ S n) for each edge. Only the
least right-hand side b over all bodies and frames matters. C is solved in camera coordinates (right, down, forward):
the left and right planes limit (right, forward), the upper and lower planes limit (down, forward). A height or position
that the scenario gives fixes coordinates of C first.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.scene.body import PERSON_HEIGHT, Ellipsoids, RecordedBodies, ellipsoids, recorded_bodies
from sim.scene.camera import camera_rotation
from sim.types import Array, Bools, Camera, Motion

if TYPE_CHECKING:
    from scenarios.schema.scenario import CameraSpec

MARGIN = 0.02  # kept free along each image edge, as a share of the image's shorter side
LOWEST = 0.3  # m: no solved height is lower
TOP_HEIGHT = 20.0  # m: height of a camera from above if not given; it affects nothing but depth
TOLERANCE = 1e-6


def place_camera(spec: CameraSpec, motion: Motion) -> Camera:
    """Return the camera of a scenario, with height, position and scale (px_per_m, kind "top") solved if not given.

    All bodies of all frames are in view, as large as possible. With `crop`, only bodies on the world's own ground are
    fitted, and others may leave the view. Without bodies to fit, four standard people in the world's corners are
    fitted. Raises InputError, naming the first person out of view, if the given values leave a body out of view and
    `crop` is false.
    """
    everybody = recorded_bodies(motion)
    aimed = _bodies_to_fit(everybody, motion, spec.crop)
    camera = _top(spec, aimed) if spec.kind == "top" else _pinhole(spec, aimed)
    if not spec.crop:
        _check_all_in_view(camera, spec, everybody, motion)
    return camera


def _select(bodies: RecordedBodies, keep: Bools) -> RecordedBodies:
    shapes = Ellipsoids(bodies.shapes.centre[keep], bodies.shapes.shape[keep])
    return RecordedBodies(bodies.frame[keep], bodies.id[keep], bodies.pos3[keep], shapes)


def _bodies_to_fit(bodies: RecordedBodies, motion: Motion, crop: bool) -> RecordedBodies:
    """The bodies to keep in view; standard people in the world's four corners if there are none."""
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
    """Least n·c - sqrt(nᵀ S n) over body and head: (B, K) for normals (K, 3)."""
    centre = bodies.shapes.centre @ normals.T
    spread = np.sqrt(np.einsum("ki,bpij,kj->bpk", normals, bodies.shapes.shape, normals))
    return np.asarray((centre - spread).min(axis=1))


def _slopes(spec: CameraSpec, margin: float) -> tuple[float, float]:
    """Half the view's width and half its height, per metre of depth, less `margin` px on each side."""
    return (spec.image[0] / 2 - margin) / spec.focal_px, (spec.image[1] / 2 - margin) / spec.focal_px


def _edges(rotation: Array, slopes: tuple[float, float]) -> Array:
    """Inward normals (4, 3), in the world, of the planes of the left, right, upper and lower image edge."""
    k, m = slopes
    return np.array([[1, 0, k], [-1, 0, k], [0, 1, m], [0, -1, m]]) @ rotation


def _pinhole(spec: CameraSpec, bodies: RecordedBodies) -> Camera:
    """A pinhole camera with all bodies in view: at the given position or height, else at the closest place."""
    rotation = camera_rotation(float(np.deg2rad(spec.tilt_deg)), float(np.deg2rad(spec.yaw_deg)))
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
    return _camera(spec, centre, rotation, baseline=spec.baseline)


def _camera(spec: CameraSpec, centre: Array, rotation: Array, baseline: float = 0.0, scale: float = np.nan) -> Camera:
    focal = (spec.focal_px, spec.focal_px)
    middle = (spec.image[0] / 2, spec.image[1] / 2)
    return Camera(spec.kind, spec.image, focal, middle, centre, rotation, baseline, scale)


def _closest(rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """Camera centre (3,) m furthest forward.

    Two opposite planes meet at forward = (b1 + b2)/2k; the pair that meets first limits, the other pair is centred.
    """
    forward = min((b[0] + b[1]) / (2 * slopes[0]), (b[2] + b[3]) / (2 * slopes[1]))
    return np.asarray(np.array([(b[0] - b[1]) / 2, (b[2] - b[3]) / 2, forward]) @ rotation)


def _at_height(height: float, rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """Camera centre (3,) m at this height, as far ahead over the ground as the edges allow.

    If the edges contradict each other, their violation is smallest there.
    """
    k, m = slopes
    ahead = np.cross([0.0, 0.0, 1.0], rotation[0])
    base = np.array([0.0, 0.0, height])
    down, forward = rotation[1], rotation[2]
    limits = [
        (forward @ ahead * k, (b[0] + b[1]) / 2 - k * (forward @ base)),
        ((down + m * forward) @ ahead, b[2] - (down + m * forward) @ base),
        ((m * forward - down) @ ahead, b[3] - (m * forward - down) @ base),
    ]
    straight_down = limits[0][0] < TOLERANCE  # going ahead brings nothing nearer: take the middle of both limits
    g = _largest(limits) if not straight_down else (_largest(limits) - _largest([(-a, c) for a, c in limits])) / 2
    return np.asarray(base + g * ahead + (b[0] - b[1]) / 2 * rotation[0])


def _largest(limits: list[tuple[float, float]]) -> float:
    """The largest g with a g <= c for all (a, c).

    If none exists, the middle between the least upper and the greatest lower limit; without an upper limit, the lower
    one, or 0.
    """
    upper = min((c / a for a, c in limits if a > TOLERANCE), default=np.inf)
    lower = max((c / a for a, c in limits if a < -TOLERANCE), default=-np.inf)
    if not np.isfinite(upper):
        return float(lower) if np.isfinite(lower) else 0.0
    return float(upper if lower <= upper else (lower + upper) / 2)


def _height_at_position(spec: CameraSpec, normals: Array, b: Array) -> float:
    """The given height, or the lowest height at the given position from which all bodies are in view, m."""
    if spec.height is not None:
        return spec.height
    position = np.array(spec.position, dtype=float)
    limits = [(-n[2], float(c - n[:2] @ position)) for n, c in zip(normals, b, strict=True)]
    return max(LOWEST, -_largest(limits))


def _top(spec: CameraSpec, bodies: RecordedBodies) -> Camera:
    """A camera from above: over the middle of the bodies' extent, at the largest scale that shows all, unless given."""
    rotation = camera_rotation(np.pi / 2, float(np.deg2rad(spec.yaw_deg)))
    sides = np.concatenate([rotation[:2], -rotation[:2]])
    low_x, low_y, minus_high_x, minus_high_y = _reach(bodies, sides).min(axis=0)
    low, high = np.array([low_x, low_y]), -np.array([minus_high_x, minus_high_y])
    middle = (low + high) / 2 if spec.position is None else rotation[:2, :2] @ np.array(spec.position)
    half = np.maximum(np.maximum(high - middle, middle - low), 0.1)
    room = np.array(spec.image) / 2 - MARGIN * min(spec.image)
    scale = spec.px_per_m if spec.px_per_m is not None else float((room / half).min())
    xy = middle @ rotation[:2, :2]
    return _camera(spec, np.array([*xy, spec.height or TOP_HEIGHT]), rotation, scale=scale)


def _check_all_in_view(camera: Camera, spec: CameraSpec, bodies: RecordedBodies, motion: Motion) -> None:
    """Raise InputError, naming the first body that is not wholly inside the image, if there is one."""
    if camera.kind == "top":
        sides = np.concatenate([camera.rotation[:2], -camera.rotation[:2]])
        half = np.array(camera.image) / (2 * camera.px_per_m)
        slack = _reach(bodies, sides) - sides @ camera.position + np.concatenate([half, half])
    else:
        normals = _edges(camera.rotation, _slopes(spec, 0.0))
        slack = _reach(bodies, normals) - normals @ camera.position
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
