"""The shape of a person and its exact outline in an image.

A person of height h is two upright ellipsoids, body and head (BODY, HEAD), turned by the heading. An ellipsoid with
centre c and shape S = A diag(a²) Aᵀ, in camera coordinates, is the dual quadric [[S - ccᵀ, -c], [-cᵀ, -1]]; a pinhole
camera maps it to the dual conic C* = K (S - c cᵀ) Kᵀ, an ellipse with centre C*₁₃/C*₃₃, C*₂₃/C*₃₃ and shape
E = m mᵀ - C*₁..₂/C*₃₃ (Hartley & Zisserman, Multiple View Geometry, 8.3): its points obey (u - m)ᵀ E⁻¹ (u - m) <= 1 and
its box is m ± sqrt(diag E). Nothing here is sampled.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.types import Array, Camera

SHOULDERS, DEPTH = 0.27, 0.16  # of the height: width across the shoulders, depth along the heading


@dataclass(frozen=True)
class Part:
    """One ellipsoid of a person of height 1: height of its centre, half axes across, along the heading, and up.

    The body's across and along are shares of the person's own width and depth instead.
    """

    centre: float
    across: float
    along: float
    up: float


BODY = Part(centre=0.44, across=0.5, along=0.5, up=0.44)
HEAD = Part(centre=0.93, across=0.045, along=0.057, up=0.07)


@dataclass(frozen=True)
class Ellipsoids:
    """Bodies and heads of N people: centre (N, 2, 3), shape (N, 2, 3, 3) m, the second axis being body, head."""

    centre: Array
    shape: Array


@dataclass(frozen=True)
class Outlines:
    """Silhouettes of N people as two ellipses each: centre (N, 2, 2) px, shape (N, 2, 2, 2) px²; nan if behind."""

    centre: Array
    shape: Array


def half_axes(height: Array, width: Array | None = None, depth: Array | None = None) -> Array:
    """Half axes (N, 2, 3) m of bodies and heads: across, along the heading, up; see `ellipsoids`."""
    width = SHOULDERS * height if width is None else width
    depth = DEPTH * height if depth is None else depth
    half = np.empty((len(height), 2, 3))
    half[:, 0] = np.stack([BODY.across * width, BODY.along * depth, BODY.up * height], axis=1)
    half[:, 1] = height[:, None] * np.array([HEAD.across, HEAD.along, HEAD.up])
    return half


def ellipsoids(
    pos3: Array, heading: Array, height: Array, width: Array | None = None, depth: Array | None = None
) -> Ellipsoids:
    """Ellipsoids of N people standing at pos3 (N, 3) m, heading (N,) rad; width, depth follow height if absent."""
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


def outlines(camera: Camera, people: Ellipsoids) -> Outlines:
    """The image of each ellipsoid, exactly; nan where it does not lie wholly in front of a pinhole camera."""
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
    """Boxes (N, 4) ltwh px round body and head together, amodal and unclipped; nan for who is not in front."""
    half = np.sqrt(np.diagonal(ellipses.shape, axis1=2, axis2=3))
    low, high = (ellipses.centre - half).min(axis=1), (ellipses.centre + half).max(axis=1)
    return np.concatenate([low, high - low], axis=1)


def boxes(
    camera: Camera, pos3: Array, heading: Array, height: Array, width: Array | None = None, depth: Array | None = None
) -> Array:
    """Amodal, unclipped boxes (N, 4) ltwh px of people standing at pos3 (N, 3) m."""
    return outline_boxes(outlines(camera, ellipsoids(pos3, heading, height, width, depth)))


def contour(ellipses: Outlines, points: int = 16) -> Array:
    """Points on the outlines, (N, 2 * points, 2) px: m + L (cos, sin) with L Lᵀ = E; nan for who is not in front."""
    angle = 2 * np.pi * np.arange(points) / points
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    a, b, d = ellipses.shape[..., 0, 0], ellipses.shape[..., 0, 1], ellipses.shape[..., 1, 1]
    l00 = np.sqrt(a)
    l10 = b / l00
    l11 = np.sqrt(np.maximum(d - l10**2, 0.0))
    u = ellipses.centre[..., :1] + l00[..., None] * circle[:, 0]
    v = ellipses.centre[..., 1:] + l10[..., None] * circle[:, 0] + l11[..., None] * circle[:, 1]
    return np.stack([u, v], axis=-1).reshape(len(a), 2 * points, 2)


def distance(camera: Camera, pos3: Array, height: Array) -> Array:
    """What orders people from near to far, (N,): along a line of sight the smaller hides the larger.

    Upright bodies are met by any ray in the order of their axes' horizontal distance from a pinhole camera (whatever
    its tilt); seen from above, the higher head is nearer.
    """
    if camera.kind == "top":
        return np.asarray(camera.position[2] - pos3[:, 2] - height)
    return np.asarray(np.hypot(pos3[:, 0] - camera.position[0], pos3[:, 1] - camera.position[1]))
