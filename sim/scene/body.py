"""The shape of a person, and its exact outline in an image. Home of the body's proportions and of the 1.7 m person.

A person of height h is two upright ellipsoids, body and head (BODY, HEAD), turned by the heading; with `Motion.looks`
it can have limbs and what is worn in place of them (sim.scene.figure): K ellipsoids, of which the first is the body or
torso and the second the head. Outlines and boxes are those of all K. What people hold has rows of its own. An ellipsoid
with centre c and shape S = A diag(a²) Aᵀ (half axes a, axis directions the columns of A), in camera coordinates, is the
dual quadric [[S - ccᵀ, -c], [-cᵀ, -1]]. A pinhole camera with matrix K (focal lengths, image centre) maps it to the
dual conic C* = K (S - c cᵀ) Kᵀ: an ellipse with centre m = (C*₁₃, C*₂₃)/C*₃₃ and shape E = m mᵀ - C*₁..₂/C*₃₃ (Hartley
& Zisserman, Multiple View Geometry, 8.3). Its points u obey (u - m)ᵀ E⁻¹ (u - m) <= 1, and its box is m ± sqrt(diag E).
All outlines are closed-form; nothing is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.elementary import cos, length, product, sin, turned, unit
from sim.scene import figure
from sim.scene.figure import Parts
from sim.scene.terrain import height_at
from sim.types import Array, Camera, Ints, Motion

PERSON_HEIGHT = 1.7  # m: height of the standard person, who gives an image its scale
SHOULDER_SHARE = 0.27  # width across the shoulders, as a share of the height
DEPTH_SHARE = 0.16  # depth along the heading, as a share of the height

BODY_PART, HEAD_PART = 0, 1  # places on the part axis, the second axis of Ellipsoids and Outlines
XX, XY, YY = 0, 1, 2  # entries of a symmetric 2 x 2 matrix packed by `packed_inverse`


@dataclass(frozen=True)
class BodyPart:
    """The shape of one ellipsoid, body or head, of every person; all numbers are shares without unit."""

    centre: float  # height of its centre above the ground, share of the person's height
    across: float  # half axis to the right; share of the height for HEAD, of the person's width for BODY
    along: float  # half axis along the heading; share of the height for HEAD, of the person's depth for BODY
    up: float  # half axis upwards, share of the height


BODY = BodyPart(centre=0.44, across=0.5, along=0.5, up=0.44)
HEAD = BodyPart(centre=figure.HEAD_SHARE, across=0.045, along=0.057, up=0.07)


@dataclass(frozen=True)
class Ellipsoids:
    """The K parts of N people or things in the world, as ellipsoids (X - centre)ᵀ shape⁻¹ (X - centre) <= 1."""

    centre: Array  # (N, K, 3) x, y, z in m; the second axis is body, head if K is 2
    shape: Array  # (N, K, 3, 3) symmetric matrices in m², the squared half axes turned by heading and pitch


@dataclass(frozen=True)
class Outlines:
    """Silhouettes of N people in an image, as ellipses (u - centre)ᵀ shape⁻¹ (u - centre) <= 1, K each.

    centre (N, K, 2) px and shape (N, K, 2, 2) px²; the second axis is that of Ellipsoids. An ellipse is nan if its
    ellipsoid is not wholly in front of the camera.
    """

    centre: Array
    shape: Array


@dataclass(frozen=True)
class RecordedBodies:
    """B bodies of a Motion, one row per person and frame, sorted by frame, then id."""

    frame: Ints  # (B,) frame number, from 1 on
    id: Ints  # (B,) person id = column of the Motion + 1
    pos3: Array  # (B, 3) feet: x, y, z in m
    shapes: Ellipsoids  # B rows


def half_axes(height: Array, width: Array | None = None, depth: Array | None = None) -> Array:
    """Returns the half axes (N, 2, 3) m of N people. Second axis: body, head; third: across, along the heading, up.

    height, width, depth (N,): m; None: of the usual proportions. Width and depth change the body only.
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
    """Returns body and head of N upright people.

    pos3 (N, 3): feet x, y, z in m. heading (N,): rad. height, width, depth: as for `half_axes`.
    """
    half = half_axes(height, width, depth)
    c, s = cos(heading), sin(heading)
    a = half * half
    shape = np.zeros((len(height), 2, 3, 3))
    shape[..., 0, 0] = a[..., 0] * (s * s)[:, None] + a[..., 1] * (c * c)[:, None]
    shape[..., 1, 1] = a[..., 0] * (c * c)[:, None] + a[..., 1] * (s * s)[:, None]
    shape[..., 0, 1] = shape[..., 1, 0] = (a[..., 1] - a[..., 0]) * (c * s)[:, None]
    shape[..., 2, 2] = a[..., 2]
    centre = np.repeat(pos3[:, None], 2, axis=1)
    centre[..., 2] += height[:, None] * np.array([BODY.centre, HEAD.centre])
    return Ellipsoids(centre, shape)


def recorded_bodies(motion: Motion, first: int = 1, end: int | None = None) -> RecordedBodies:
    """Returns the bodies of all people present in frames first … end - 1, standing on the ground or on stairs.

    first: from 1. end: None means up to the last frame.
    """
    t, p = np.nonzero(motion.present[first - 1 : None if end is None else end - 1])
    t += first - 1
    xy = motion.pos[t, p]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    if motion.looks is None:
        shapes = ellipsoids(pos3, motion.heading[t, p], motion.height[p], motion.width[p], motion.depth[p])
    else:
        shapes = placed(pos3, motion.heading[t, p], parts_of_people(motion, t, p))
    return RecordedBodies(t + 1, p + 1, pos3, shapes)


def parts_of_people(motion: Motion, t: Ints, p: Ints) -> Parts:
    """Returns the parts of N people. t, p (N,): rows and columns of the motion."""
    height, width, depth, looks = motion.height[p], motion.width[p], motion.depth[p], motion.looks
    if looks is not None and looks.limbs:
        parts = figure.limbs(height, width, depth, looks.phase[t, p], looks.swing[t, p])
    else:
        offset = np.zeros((len(p), 2, 3))
        offset[..., 2] = height[:, None] * np.array([BODY.centre, HEAD.centre])
        parts = Parts(offset, half_axes(height, width, depth), np.zeros((len(p), 2)))
    return parts if looks is None or not looks.worn.size else figure.with_worn(parts, height, looks.worn[p])


def recorded_things(motion: Motion, first: int = 1, end: int | None = None) -> RecordedBodies | None:
    """Returns the things in frames first … end - 1 as `recorded_bodies` does people; `id` is the number of a thing.

    None if the motion has no things.
    """
    looks = motion.looks
    if looks is None or not len(looks.kind):
        return None
    t, m = np.nonzero(np.isfinite(looks.turn[first - 1 : None if end is None else end - 1]))
    t += first - 1
    xy = looks.place[t, m]
    pos3 = np.column_stack([xy, height_at(motion.scene, xy)])
    parts = figure.things(looks.kind[m], looks.size[m], looks.step[t, m])
    return RecordedBodies(t + 1, m + 1, pos3, placed(pos3, looks.turn[t, m], parts))


def placed(pos3: Array, heading: Array, parts: Parts) -> Ellipsoids:
    """Returns the parts of N shapes at places on the ground, pos3 (N, 3) m, with headings (N,) rad."""
    across, along = unit(heading - np.pi / 2), unit(heading)
    axes = np.zeros((*parts.pitch.shape, 3, 3))  # columns: the own axes of each part
    c, s = cos(parts.pitch), sin(parts.pitch)
    axes[..., :2, 0] = across[:, None]
    axes[..., :2, 1], axes[..., 2, 1] = along[:, None] * c[..., None], s
    axes[..., :2, 2], axes[..., 2, 2] = -along[:, None] * s[..., None], c
    scaled = axes * parts.half[..., None, :]
    centre = np.repeat(pos3[:, None], parts.pitch.shape[1], axis=1)
    centre[..., :2] += parts.offset[..., :1] * across[:, None] + parts.offset[..., 1:2] * along[:, None]
    centre[..., 2] += parts.offset[..., 2]
    return Ellipsoids(centre, product(scaled, scaled.swapaxes(-1, -2)))


def outlines(camera: Camera, people: Ellipsoids) -> Outlines:
    """Returns the exact ellipse in the image of each ellipsoid; lens distortion is ignored."""
    R = camera.rotation
    c = turned(R, people.centre - camera.position)
    S = product(product(R, people.shape), R.T)
    if camera.kind == "top":
        scale = camera.px_per_m
        return Outlines(c[..., :2] * scale + camera.centre_px, S[..., :2, :2] * (scale * scale))
    Q = S - c[..., :, None] * c[..., None, :]
    in_front = (Q[..., 2, 2] < 0) & (c[..., 2] > 0)
    q = np.where(in_front, Q[..., 2, 2], np.nan)
    f = np.array(camera.focal_px)
    m = Q[..., :2, 2] / q[..., None] * f
    E = m[..., :, None] * m[..., None, :] - Q[..., :2, :2] / q[..., None, None] * (f[:, None] * f[None, :])
    return Outlines(m + camera.centre_px, E)


def outline_boxes(ellipses: Outlines) -> Array:
    """Returns the boxes (N, 4), left, top, width, height in px, round all parts, not clipped to the image."""
    half = np.sqrt(np.diagonal(ellipses.shape, axis1=2, axis2=3))
    low, high = (ellipses.centre - half).min(axis=1), (ellipses.centre + half).max(axis=1)
    return np.concatenate([low, high - low], axis=1)


def person_boxes(
    camera: Camera, pos3: Array, heading: Array, height: Array, width: Array | None = None, depth: Array | None = None
) -> Array:
    """Returns the boxes (N, 4), left, top, width, height in px, round N people in the image.

    They are not clipped to the image; nan for people not wholly in front of the camera. Arguments as for `ellipsoids`.
    """
    return outline_boxes(outlines(camera, ellipsoids(pos3, heading, height, width, depth)))


def packed_inverse(shape: Array) -> Array:
    """Returns the inverses of symmetric matrices (..., 2, 2) as (..., 3): entries XX, XY, YY."""
    a, b, d = shape[..., 0, 0], shape[..., 0, 1], shape[..., 1, 1]
    return np.asarray(np.stack([d, -b, a], axis=-1) / (a * d - b * b)[..., None])


def contour(ellipses: Outlines, points: int = 16) -> Array:
    """Returns `points` points on each of the K outlines of N people, (N, K * points, 2) px, the body's first.

    An ellipse with centre m and shape E has the points m + L (cos, sin) with L Lᵀ = E.
    """
    angle = 2 * np.pi * np.arange(points) / points
    circle = unit(angle)
    a, b, d = ellipses.shape[..., 0, 0], ellipses.shape[..., 0, 1], ellipses.shape[..., 1, 1]
    l00 = np.sqrt(a)
    l10 = b / l00
    l11 = np.sqrt(np.maximum(d - l10 * l10, 0.0))
    u = ellipses.centre[..., :1] + l00[..., None] * circle[:, 0]
    v = ellipses.centre[..., 1:] + l10[..., None] * circle[:, 0] + l11[..., None] * circle[:, 1]
    return np.stack([u, v], axis=-1).reshape(len(a), a.shape[1] * points, 2)


def occlusion_distance(camera: Camera, pos3: Array, height: Array) -> Array:
    """Returns a distance (N,) m: of two people on one line of sight, the one with the smaller distance hides the other.

    For a pinhole camera it is the horizontal distance: a ray meets upright bodies in this order, whatever the tilt. For
    kind "top" it is the distance from the head up to the camera. pos3 (N, 3): feet, m. height (N,): m.
    """
    if camera.kind == "top":
        return np.asarray(camera.position[2] - pos3[:, 2] - height)
    return length(pos3[:, :2] - camera.position[:2])
