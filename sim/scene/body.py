"""The shape of a person, and its exact outline in an image. Home of the body's proportions and of the 1.7 m person.

A person of height h is two upright ellipsoids, body and head (BODY, HEAD), turned by the heading. An ellipsoid with
centre c and shape S = A diag(a²) Aᵀ, in camera coordinates, is the dual quadric [[S - ccᵀ, -c], [-cᵀ, -1]]. A pinhole
camera maps it to the dual conic C* = K (S - c cᵀ) Kᵀ: an ellipse with centre m = (C*₁₃, C*₂₃)/C*₃₃ and shape E = m mᵀ -
C*₁..₂/C*₃₃ (Hartley & Zisserman, Multiple View Geometry, 8.3). Its points obey (u - m)ᵀ E⁻¹ (u - m) <= 1, and its box
is m ± sqrt(diag E). All outlines are closed-form; nothing is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.scene.terrain import height_at
from sim.types import Array, Camera, Ints, Motion

PERSON_HEIGHT = 1.7  # m: height of the standard person, who gives an image its scale
SHOULDER_SHARE = 0.27  # width across the shoulders, as a share of the height
DEPTH_SHARE = 0.16  # depth along the heading, as a share of the height

BODY_PART, HEAD_PART = 0, 1  # places on the part axis, the second axis of Ellipsoids and Outlines
XX, XY, YY = 0, 1, 2  # entries of a symmetric 2 x 2 matrix packed by `packed_inverse`


@dataclass(frozen=True)
class BodyPart:
    """One ellipsoid of a person of height 1: height of its centre, half axes across, along the heading, and up.

    For BODY, `across` and `along` are shares of the person's own width and depth, not of the height.
    """

    centre: float
    across: float
    along: float
    up: float


BODY = BodyPart(centre=0.44, across=0.5, along=0.5, up=0.44)
HEAD = BodyPart(centre=0.93, across=0.045, along=0.057, up=0.07)


@dataclass(frozen=True)
class Ellipsoids:
    """Bodies and heads of N people: centre (N, 2, 3) m, shape (N, 2, 3, 3) m². The second axis is body, head."""

    centre: Array
    shape: Array


@dataclass(frozen=True)
class Outlines:
    """Silhouettes of N people, two ellipses each: centre (N, 2, 2) px, shape (N, 2, 2, 2) px².

    The second axis is body, head. An ellipse is nan if its ellipsoid is not wholly in front of the camera.
    """

    centre: Array
    shape: Array


@dataclass(frozen=True)
class RecordedBodies:
    """All bodies of a Motion, B rows sorted by frame, then id: frame (B,) from 1 on, id (B,), feet pos3 (B, 3) m,
    shapes."""

    frame: Ints
    id: Ints
    pos3: Array
    shapes: Ellipsoids


def half_axes(height: Array, width: Array | None = None, depth: Array | None = None) -> Array:
    """Return the half axes (N, 2, 3) m of bodies and heads: across, along the heading, up.

    height, width, depth (N,) m; without width or depth, SHOULDER_SHARE or DEPTH_SHARE of the height.
    """
    width = SHOULDER_SHARE * height if width is None else width
    depth = DEPTH_SHARE * height if depth is None else depth
    half = np.empty((len(height), 2, 3))
    half[:, BODY_PART] = np.stack([BODY.across * width, BODY.along * depth, BODY.up * height], axis=1)
    half[:, HEAD_PART] = height[:, None] * np.array([HEAD.across, HEAD.along, HEAD.up])
    return half


def ellipsoids(
    pos3: Array, heading: Array, height: Array, width: Array | None = None, depth: Array | None = None
) -> Ellipsoids:
    """Return the ellipsoids of N people with feet at pos3 (N, 3) m who face heading (N,) rad; sizes as `half_axes`."""
    half = half_axes(height, width, depth)
    c, s = np.cos(heading), np.sin(heading)
    a = half**2
    shape = np.zeros((len(height), 2, 3, 3))
    shape[..., 0, 0] = a[..., 0] * (s * s)[:, None] + a[..., 1] * (c * c)[:, None]
    shape[..., 1, 1] = a[..., 0] * (c * c)[:, None] + a[..., 1] * (s * s)[:, None]
    shape[..., 0, 1] = shape[..., 1, 0] = (a[..., 1] - a[..., 0]) * (c * s)[:, None]
    shape[..., 2, 2] = a[..., 2]
    centre = np.repeat(pos3[:, None], 2, axis=1)
    centre[..., 2] += height[:, None] * np.array([BODY.centre, HEAD.centre])
    return Ellipsoids(centre, shape)


def bodies_at(motion: Motion, t: Ints, p: Ints) -> tuple[Array, Ellipsoids]:
    """Return feet (N, 3) m and ellipsoids of the people in columns p (N,) of a Motion, in its time rows t (N,).

    The feet are on the ground of the scene, stairs included.
    """
    xy = motion.pos[t, p]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    return pos3, ellipsoids(pos3, motion.heading[t, p], motion.height[p], motion.width[p], motion.depth[p])


def recorded_bodies(motion: Motion) -> RecordedBodies:
    """Return the bodies of all people in all frames in which they are present."""
    t, p = np.nonzero(motion.present)
    return RecordedBodies(t + 1, p + 1, *bodies_at(motion, t, p))


def outlines(camera: Camera, people: Ellipsoids) -> Outlines:
    """Return the exact outline of each ellipsoid in the image; nan where it is not wholly in front of a pinhole
    camera."""
    R = camera.rotation
    c = (people.centre - camera.position) @ R.T
    S = R @ people.shape @ R.T
    if camera.kind == "top":
        scale = camera.px_per_m
        return Outlines(c[..., :2] * scale + camera.centre_px, S[..., :2, :2] * scale**2)
    Q = S - c[..., :, None] * c[..., None, :]
    in_front = (Q[..., 2, 2] < 0) & (c[..., 2] > 0)
    q = np.where(in_front, Q[..., 2, 2], np.nan)
    f = np.array(camera.focal_px)
    m = Q[..., :2, 2] / q[..., None] * f
    E = m[..., :, None] * m[..., None, :] - Q[..., :2, :2] / q[..., None, None] * (f[:, None] * f[None, :])
    return Outlines(m + camera.centre_px, E)


def outline_boxes(ellipses: Outlines) -> Array:
    """Return boxes (N, 4) ltwh px round body and head: amodal, not clipped to the image; nan if an outline is nan."""
    half = np.sqrt(np.diagonal(ellipses.shape, axis1=2, axis2=3))
    low, high = (ellipses.centre - half).min(axis=1), (ellipses.centre + half).max(axis=1)
    return np.concatenate([low, high - low], axis=1)


def person_boxes(
    camera: Camera, pos3: Array, heading: Array, height: Array, width: Array | None = None, depth: Array | None = None
) -> Array:
    """Return the boxes (N, 4) ltwh px of people with feet at pos3 (N, 3) m: `outline_boxes` of their `ellipsoids`."""
    return outline_boxes(outlines(camera, ellipsoids(pos3, heading, height, width, depth)))


def packed_inverse(shape: Array) -> Array:
    """Return E⁻¹ of symmetric matrices E (..., 2, 2) as (..., 3): its entries 11, 12, 22 (slots XX, XY, YY)."""
    a, b, d = shape[..., 0, 0], shape[..., 0, 1], shape[..., 1, 1]
    return np.asarray(np.stack([d, -b, a], axis=-1) / (a * d - b * b)[..., None])


def contour(ellipses: Outlines, points: int = 16) -> Array:
    """Return points on the outlines (N, 2 * points, 2) px, those of the body first; nan where an outline is nan.

    They are m + L (cos, sin) with L Lᵀ = E, at `points` evenly spaced angles.
    """
    angle = 2 * np.pi * np.arange(points) / points
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    a, b, d = ellipses.shape[..., 0, 0], ellipses.shape[..., 0, 1], ellipses.shape[..., 1, 1]
    l00 = np.sqrt(a)
    l10 = b / l00
    l11 = np.sqrt(np.maximum(d - l10**2, 0.0))
    u = ellipses.centre[..., :1] + l00[..., None] * circle[:, 0]
    v = ellipses.centre[..., 1:] + l10[..., None] * circle[:, 0] + l11[..., None] * circle[:, 1]
    return np.stack([u, v], axis=-1).reshape(len(a), 2 * points, 2)


def occlusion_distance(camera: Camera, pos3: Array, height: Array) -> Array:
    """Return a distance (N,) m that orders people from near to far: of two on one line of sight, the nearer hides.

    Pinhole: the horizontal distance from the camera to the body's axis. A ray meets upright bodies in this order,
    whatever the camera's tilt. From above: the height of the camera over the top of the head.
    """
    if camera.kind == "top":
        return np.asarray(camera.position[2] - pos3[:, 2] - height)
    return np.asarray(np.hypot(pos3[:, 0] - camera.position[0], pos3[:, 1] - camera.position[1]))
