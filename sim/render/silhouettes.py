"""People and their shadows as the painting kernels want them: rays in each part's own axes, outlines, boxes."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TypeVar

import numpy as np

from sim.scene.body import Ellipsoids, Outlines, ellipsoids, half_axes, outlines, packed_inverse
from sim.scene.camera import project
from sim.scene.raycast import PixelRays
from sim.scene.terrain import height_at
from sim.types import Array, Camera, Ints, Motion

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Crowd:
    """The N people of a frame: id (N,), pos3 (N, 3), height (N,), shapes, half axes (N, 2, 3), turn (N, 3, 3).

    turn: world → own axes across (to the right), along the heading, up.
    """

    id: Ints
    pos3: Array
    height: Array
    shapes: Ellipsoids
    half: Array
    turn: Array


@dataclass(frozen=True, eq=False)
class Outlined:
    """Ellipses in the image: middle (N, 2, 2) px, inverse (N, 2, 3) packed; boxes (N, 4): rows, columns they touch."""

    middle: Array
    inverse: Array
    boxes: Ints


@dataclass(frozen=True, eq=False)
class Cast:
    """People as one camera sees them: start, step (N, 2, 3, 3), rays in each part's axes; outlines; near (N, 2) m."""

    start: Array
    step: Array
    outlined: Outlined
    near: Array


def crowd(motion: Motion, first: int, last: int) -> tuple[Crowd, Ints]:
    """The people of frames first … last - 1, one frame after the other, and where each frame's begin (and the end)."""
    present = motion.present[first - 1 : last - 1]
    t, who = np.nonzero(present)
    xy, heading = motion.pos[t + first - 1, who], motion.heading[t + first - 1, who]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    size = motion.height[who], motion.width[who], motion.depth[who]
    c, s = np.cos(heading), np.sin(heading)
    turn = np.zeros((len(who), 3, 3))
    turn[:, 0, 0], turn[:, 0, 1], turn[:, 1, 0], turn[:, 1, 1], turn[:, 2, 2] = s, -c, c, s, 1.0
    people = Crowd(who + 1, pos3, size[0], ellipsoids(pos3, heading, *size), half_axes(*size), turn)
    return people, np.concatenate([[0], np.cumsum(present.sum(axis=1))])


def cut(value: T, rows: slice) -> T:
    """These rows of all arrays of a dataclass, and of the dataclasses in it."""
    kept = {
        f.name: v[rows] if isinstance(v := getattr(value, f.name), np.ndarray) else cut(v, rows)
        for f in fields(value)  # type: ignore[arg-type]
    }
    return type(value)(**kept)


def cast(camera: Camera, rays: PixelRays, people: Crowd) -> Cast:
    """These people before this camera."""
    to_ball = people.turn[:, None] / people.half[..., None]
    start = to_ball @ rays.origin
    start[..., 2] -= np.einsum("npij,npj->npi", to_ball, people.shapes.centre)
    forward = camera.rotation[2]
    depth = (people.shapes.centre - camera.position) @ forward
    near = depth - np.sqrt(np.einsum("i,npij,j->np", forward, people.shapes.shape, forward))
    return Cast(start, to_ball @ rays.direction, outlined(camera, outlines(camera, people.shapes)), near)


def outlined(camera: Camera, ellipses: Outlines) -> Outlined:
    """Outlines ready for the kernels; the boxes of who is not in front are empty."""
    half = np.sqrt(np.diagonal(ellipses.shape, axis1=2, axis2=3))
    boxes = _boxes(camera, (ellipses.centre - half).min(axis=1), (ellipses.centre + half).max(axis=1))
    return Outlined(ellipses.centre, packed_inverse(ellipses.shape), boxes)


def _boxes(camera: Camera, low: Array, high: Array) -> Ints:
    size = np.array(camera.image, dtype=float)
    low, high = (np.clip(np.nan_to_num(edge), 0, size) for edge in (low, high))
    edges = np.stack([np.floor(low[:, 1]), np.ceil(high[:, 1]), np.floor(low[:, 0]), np.ceil(high[:, 0])], axis=1)
    return edges.astype(np.int64)


@dataclass(frozen=True, eq=False)
class Shadows:
    """Shadows on level ground: shape (N, 2, 3), inverse of P S Pᵀ packed; softness (N, 2); their image."""

    shape: Array
    softness: Array
    outlined: Outlined


def shadows(camera: Camera, people: Crowd, sun: Array, penumbra: float, level: bool) -> Shadows:
    """The shadow of ellipsoid (c, S) along `sun` s on the plane z: middle c - s (c_z - z)/s_z, shape P S Pᵀ with
    P = I - s e_zᵀ/s_z. Boxes are of the ground at the feet or, unless `level`, also of walls up to the head."""
    along = np.eye(3) - np.outer(sun / sun[2], [0.0, 0.0, 1.0])
    shape = along @ people.shapes.shape @ along.T
    radius = np.linalg.det(shape[..., :2, :2]) ** 0.25
    softness = 0.5 * penumbra / radius
    foot = people.pos3[:, None, 2]
    middle = people.shapes.centre - sun / sun[2] * (people.shapes.centre[..., 2] - foot)[..., None]
    flat = shape * ((1 + softness) ** 2)[..., None, None]
    found = outlined(camera, outlines(camera, Ellipsoids(middle, flat)))
    if not level:
        found = Outlined(found.middle, found.inverse, _tall(camera, people, sun, flat))
    return Shadows(packed_inverse(shape[..., :2, :2]), softness, found)


def _tall(camera: Camera, people: Crowd, sun: Array, flat: Array) -> Ints:
    """Boxes (N, 4) round all that a shadow can fall on between the person's feet, less one flight of stairs, and head;
    the whole image for who casts behind the camera."""
    half = np.sqrt(np.diagonal(flat, axis1=2, axis2=3))[..., :2]
    low_z, high_z = np.minimum(people.pos3[:, 2], 0.0), people.pos3[:, 2] + people.height
    corners = []
    for z in (low_z, high_z):
        middle = (
            people.shapes.centre[..., :2] - sun[:2] / sun[2] * (people.shapes.centre[..., 2] - z[:, None])[..., None]
        )
        for side in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            here = middle + half * side
            corners.append(np.concatenate([here, np.broadcast_to(z[:, None, None], (*here.shape[:2], 1))], axis=2))
    uv = project(camera, np.stack(corners, axis=1).reshape(-1, 3))[0].reshape(len(people.id), 16, 2)
    behind = np.asarray(np.isnan(uv).any(axis=(1, 2)))[:, None]
    return _boxes(camera, np.where(behind, 0.0, uv.min(axis=1)), np.where(behind, camera.image, uv.max(axis=1)))
