"""The rows of a tracker that reports groups without people: hulls, extents, sizes and speeds, and their encoding."""

from __future__ import annotations

import math
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.types import Array, Bools, Groups, Ints, Tracks
from tracking.app.replay_page.column_encoding import deltas

MAX_CORNERS = 24
"""Corners of an encoded hull at most."""

LEAST_CORNER = {"ground": 0.02, "image": 1.0}
"""m, px: corners of a hull that stand out by less are left out."""

SPEED_SCALE = {"ground": 10, "image": 1}
"""Encoded steps per m/s and px/s."""


@dataclass(frozen=True, eq=False)
class PageGroupRows:
    """What a tracker of whole groups says of R groups, one per row, in m or px; nan where unknown."""

    hull: tuple[Array, ...]  # R polygons (V, 2) x, y, without vertices where unknown
    extent: Array  # (R, 2, 2) covariance of where the group's people are, m² or px²
    size: Array  # (R,) estimated number of people
    speed: Array  # (R,) m/s or px/s


def rows_of_groups(tracks: SequenceOf[Tracks]) -> PageGroupRows:
    """Returns the groups of all rows of `tracks` (one `Tracks` per frame), in their order."""
    rows = [row for t in tracks for row in _rows(t)]
    speed = [np.hypot(t.vel[:, 0], t.vel[:, 1]) for t in tracks]
    extent, size = [row[1] for row in rows], [row[2] for row in rows]
    return PageGroupRows(
        tuple(row[0] for row in rows),
        np.array(extent).reshape(-1, 2, 2),
        np.array(size, float),
        np.concatenate([np.zeros(0), *speed]),
    )


def _rows(tracks: Tracks) -> list[tuple[Array, Array, float]]:
    """Returns (hull (V, 2), extent (2, 2), size) of each row of one frame."""
    groups, no_hull = tracks.groups or Groups.none(), np.zeros((0, 2))
    hulls = groups.hull or (no_hull,) * len(groups.id)
    known = dict(zip(groups.id.tolist(), zip(hulls, groups.extent, groups.size, strict=True), strict=True))
    return [known.get(name, (no_hull, np.full((2, 2), np.nan), math.nan)) for name in tracks.id.tolist()]


def encode_groups(rows: PageGroupRows, order: Ints, plane: str, scale: int) -> dict[str, Any]:
    """Returns the rows in the order `order` as encoded columns."""
    axes = ellipses(rows.extent[order])
    hulls = [simplified(rows.hull[k], LEAST_CORNER[plane]) for k in order]
    return {
        "size": deltas(rows.size[order] * 10),
        "speed": deltas(rows.speed[order] * SPEED_SCALE[plane]),
        "ellipse": [deltas(axes[:, 0] * scale), deltas(axes[:, 1] * scale), deltas(np.degrees(axes[:, 2]))],
        "hull": [_steps(np.rint(hull * scale).astype(np.int64)) for hull in hulls],
    }


def ellipses(extent: Array) -> Array:
    """Returns (R, 3) of covariances (R, 2, 2)."""
    known: Bools = np.asarray(np.isfinite(extent).all(axis=(1, 2)))
    values, vectors = np.linalg.eigh(np.where(known[:, None, None], extent, np.eye(2)))
    sigma = np.sqrt(np.maximum(values, 0.0))
    angle = np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]) % np.pi
    return np.where(known[:, None], np.stack([sigma[:, 1], sigma[:, 0], angle], axis=1), np.nan)


def simplified(hull: Array, least: float) -> Array:
    """Returns a convex polygon (V, 2) without the corners nearer than `least` to the line through their neighbours."""
    for odd in (1, 0):
        n = len(hull)
        if n > 3:
            before, after = np.roll(hull, 1, axis=0), np.roll(hull, -1, axis=0)
            along, out = after - before, hull - before
            area = np.abs(along[:, 0] * out[:, 1] - along[:, 1] * out[:, 0])
            flat = area < least * np.hypot(along[:, 0], along[:, 1])
            candidates = np.arange(n) % 2 == odd
            candidates[-1] &= n % 2 == 0  # with an odd number of corners the last is a neighbour of the first
            hull = hull[~(flat & candidates)]
    return hull if len(hull) <= MAX_CORNERS else hull[:: math.ceil(len(hull) / MAX_CORNERS)]


def _steps(corners: Ints) -> list[int]:
    listed: list[int] = np.diff(corners, axis=0, prepend=np.zeros((1, 2), np.int64)).ravel().tolist()
    return listed
