"""Where a scenario's camera stands: the closest place from which every body is in view, in closed form.

With the rotation given, the image's four edges are planes through the camera's centre C with fixed inward normals n.
A body (ellipsoid c, S) is inside the view iff n·C <= n·c - sqrt(nᵀ S n) for each; the least right-hand side b over all
bodies and frames is all that matters. C in camera coordinates (right, down, forward): left and right planes bind
(right, forward), upper and lower (down, forward). A given height or position fixes coordinates of C first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scenarios.errors import InputError
from sim.scene.body import Ellipsoids, ellipsoids
from sim.scene.camera import looking
from sim.scene.terrain import height_at
from sim.types import Array, Bools, Camera, Ints, Motion

if TYPE_CHECKING:
    from scenarios.schema.scenario import CameraSpec

MARGIN = 0.02  # of the image's shorter side, kept free on each side
LOWEST = 0.3  # m: no solved camera is lower
TOP_HEIGHT = 20.0  # m: of a camera from above, where it matters to nothing but depth
TOLERANCE = 1e-6


@dataclass(frozen=True)
class Bodies:
    """All recorded bodies: frame (B,) 1-based, id (B,), pos3 (B, 3), shapes."""

    frame: Ints
    id: Ints
    pos3: Array
    shapes: Ellipsoids


def recorded(motion: Motion) -> Bodies:
    """Everybody in every frame, in the order (frame, id)."""
    t, p = np.nonzero(motion.present)
    xy = motion.pos[t, p]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    shapes = ellipsoids(pos3, motion.heading[t, p], motion.height[p], motion.width[p], motion.depth[p])
    return Bodies(t + 1, p + 1, pos3, shapes)


def _only(bodies: Bodies, keep: Bools) -> Bodies:
    shapes = Ellipsoids(bodies.shapes.centre[keep], bodies.shapes.shape[keep])
    return Bodies(bodies.frame[keep], bodies.id[keep], bodies.pos3[keep], shapes)


def solve(spec: CameraSpec, motion: Motion) -> Camera:
    """The camera of this specification; all of height, position and scale that is not given is solved.

    All bodies of all frames are in view, as large as possible (crop = true: only those on the world's own ground
    are aimed at). InputError where what is given leaves somebody out of view and crop is false.
    """
    everybody = recorded(motion)
    aimed = _aim(everybody, motion, spec.crop)
    camera = _top(spec, aimed) if spec.kind == "top" else _pinhole(spec, aimed)
    if not spec.crop:
        _refuse_leavers(camera, spec, everybody, motion)
    return camera


def _aim(bodies: Bodies, motion: Motion, crop: bool) -> Bodies:
    """The bodies to keep in view; the world's corners where there are none."""
    if crop:
        xy = bodies.pos3[:, :2]
        bodies = _only(bodies, np.all((xy >= 0) & (xy <= motion.scene.size), axis=1))
    if len(bodies.id):
        return bodies
    w, d = motion.scene.size
    corners = np.array([[0, 0, 0], [w, 0, 0], [0, d, 0], [w, d, 0]], dtype=float)
    none = np.zeros(4, np.int64)
    return Bodies(none, none, corners, ellipsoids(corners, np.zeros(4), np.full(4, 1.7)))


def _reach(bodies: Bodies, normals: Array) -> Array:
    """min over body and head of n·c - sqrt(nᵀ S n): (B, K) for normals (K, 3)."""
    centre = bodies.shapes.centre @ normals.T
    spread = np.sqrt(np.einsum("ki,bpij,kj->bpk", normals, bodies.shapes.shape, normals))
    return np.asarray((centre - spread).min(axis=1))


def _slopes(spec: CameraSpec, margin: float) -> tuple[float, float]:
    """Half the view's extent per metre of depth, sideways and up."""
    return (spec.image[0] / 2 - margin) / spec.focal_px, (spec.image[1] / 2 - margin) / spec.focal_px


def _edges(rotation: Array, slopes: tuple[float, float]) -> Array:
    """Inward normals (4, 3) of the left, right, upper and lower edge, in the world."""
    k, m = slopes
    return np.array([[1, 0, k], [-1, 0, k], [0, 1, m], [0, -1, m]]) @ rotation


def _pinhole(spec: CameraSpec, bodies: Bodies) -> Camera:
    rotation = looking(float(np.deg2rad(spec.tilt_deg)), float(np.deg2rad(spec.yaw_deg)))
    slopes = _slopes(spec, MARGIN * min(spec.image))
    normals = _edges(rotation, slopes)
    b = _reach(bodies, normals).min(axis=0)
    if spec.position is not None:
        centre = np.array([*spec.position, _height(spec, normals, b)])
    elif spec.height is not None:
        centre = _at_height(spec.height, rotation, slopes, b)
    else:
        centre = _free(rotation, slopes, b)
        if centre[2] < LOWEST:
            centre = _at_height(LOWEST, rotation, slopes, b)
    return _camera(spec, centre, rotation, baseline=spec.baseline)


def _camera(spec: CameraSpec, centre: Array, rotation: Array, baseline: float = 0.0, scale: float = np.nan) -> Camera:
    focal = (spec.focal_px, spec.focal_px)
    middle = (spec.image[0] / 2, spec.image[1] / 2)
    return Camera(spec.kind, spec.image, focal, middle, centre, rotation, baseline, scale)


def _free(rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """The furthest forward: |right| and |down| planes meet at forward = (b1 + b2)/2k; the looser pair is centred."""
    forward = min((b[0] + b[1]) / (2 * slopes[0]), (b[2] + b[3]) / (2 * slopes[1]))
    return np.asarray(np.array([(b[0] - b[1]) / 2, (b[2] - b[3]) / 2, forward]) @ rotation)


def _at_height(height: float, rotation: Array, slopes: tuple[float, float], b: Array) -> Array:
    """At this height: as far ahead along the ground as the edges let it; where they contradict, the least violation."""
    k, m = slopes
    ahead = np.cross([0.0, 0.0, 1.0], rotation[0])
    base = np.array([0.0, 0.0, height])
    down, forward = rotation[1], rotation[2]
    limits = [
        (forward @ ahead * k, (b[0] + b[1]) / 2 - k * (forward @ base)),
        ((down + m * forward) @ ahead, b[2] - (down + m * forward) @ base),
        ((m * forward - down) @ ahead, b[3] - (m * forward - down) @ base),
    ]
    straight_down = limits[0][0] < TOLERANCE  # no nearer place ahead: the middle of the lower edge's and upper's limit
    g = _furthest(limits) if not straight_down else (_furthest(limits) - _furthest([(-a, c) for a, c in limits])) / 2
    return np.asarray(base + g * ahead + (b[0] - b[1]) / 2 * rotation[0])


def _furthest(limits: list[tuple[float, float]]) -> float:
    """The largest g with a g <= c for all (a, c); where none exists, the middle of the contradiction."""
    upper = min((c / a for a, c in limits if a > TOLERANCE), default=np.inf)
    lower = max((c / a for a, c in limits if a < -TOLERANCE), default=-np.inf)
    if not np.isfinite(upper):
        return float(lower) if np.isfinite(lower) else 0.0
    return float(upper if lower <= upper else (lower + upper) / 2)


def _height(spec: CameraSpec, normals: Array, b: Array) -> float:
    """The given height, or the lowest at the given position from which all are in view."""
    if spec.height is not None:
        return spec.height
    position = np.array(spec.position, dtype=float)
    limits = [(-n[2], float(c - n[:2] @ position)) for n, c in zip(normals, b, strict=True)]
    return max(LOWEST, -_furthest(limits))


def _top(spec: CameraSpec, bodies: Bodies) -> Camera:
    """From above: the middle of the bodies' extent unless given, the largest scale that shows them unless given."""
    rotation = looking(np.pi / 2, float(np.deg2rad(spec.yaw_deg)))
    sides = np.concatenate([rotation[:2], -rotation[:2]])
    low_x, low_y, minus_high_x, minus_high_y = _reach(bodies, sides).min(axis=0)
    low, high = np.array([low_x, low_y]), -np.array([minus_high_x, minus_high_y])
    middle = (low + high) / 2 if spec.position is None else rotation[:2, :2] @ np.array(spec.position)
    half = np.maximum(np.maximum(high - middle, middle - low), 0.1)
    room = np.array(spec.image) / 2 - MARGIN * min(spec.image)
    scale = spec.px_per_m if spec.px_per_m is not None else float((room / half).min())
    xy = middle @ rotation[:2, :2]
    return _camera(spec, np.array([*xy, spec.height or TOP_HEIGHT]), rotation, scale=scale)


def _refuse_leavers(camera: Camera, spec: CameraSpec, bodies: Bodies, motion: Motion) -> None:
    """InputError for the first body that is not wholly inside the image."""
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
