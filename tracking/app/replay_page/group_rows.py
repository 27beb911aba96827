"""What the replay page holds of a tracker that follows groups as wholes: hulls, extents, sizes and speeds by row."""

from __future__ import annotations

import math
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from typing import Any

import numpy as np

from sim.types import Array, Bools, Groups, Ints, Tracks
from tracking.app.replay_page.column_encoding import deltas

MAX_HULL = 24
FINE = {"ground": 0.02, "image": 1.0}
"""m, px: corners of a hull that stand out by less are left out."""

SPEED = {"ground": 10, "image": 1}
"""Steps per m/s and px/s."""


@dataclass(frozen=True, eq=False)
class Wholes:
    """Rows that are groups, as in Groups: hull a polygon each (no vertex: unknown), extent (R, 2, 2), size (R,); speed
    (R,) per second; nan where unknown."""

    hull: tuple[Array, ...]
    extent: Array
    size: Array
    speed: Array


def wholes(tracks: SequenceOf[Tracks]) -> Wholes:
    """The groups of a tracker's rows, in the order of these."""
    rows = [row for t in tracks for row in _rows(t)]
    speed = [np.hypot(t.vel[:, 0], t.vel[:, 1]) for t in tracks]
    extent, size = [row[1] for row in rows], [row[2] for row in rows]
    return Wholes(
        tuple(row[0] for row in rows),
        np.array(extent).reshape(-1, 2, 2),
        np.array(size, float),
        np.concatenate([np.zeros(0), *speed]),
    )


def _rows(tracks: Tracks) -> list[tuple[Array, Array, float]]:
    """Hull, extent and size of each row."""
    groups, no_hull = tracks.groups or Groups.none(), np.zeros((0, 2))
    hulls = groups.hull or (no_hull,) * len(groups.id)
    known = dict(zip(groups.id.tolist(), zip(hulls, groups.extent, groups.size, strict=True), strict=True))
    return [known.get(name, (no_hull, np.full((2, 2), np.nan), math.nan)) for name in tracks.id.tolist()]


def columns(found: Wholes, order: Ints, plane: str, scale: int) -> dict[str, Any]:
    """The rows in this order: sizes by tenths, ellipses as two standard deviations and a direction in degrees, and
    hulls as their first corner and the steps to each next one."""
    axes = ellipses(found.extent[order])
    return {
        "size": deltas(found.size[order] * 10),
        "speed": deltas(found.speed[order] * SPEED[plane]),
        "ellipse": [deltas(axes[:, 0] * scale), deltas(axes[:, 1] * scale), deltas(np.degrees(axes[:, 2]))],
        "hull": [_steps(np.rint(thin(found.hull[k], FINE[plane]) * scale).astype(np.int64)) for k in order],
    }


def ellipses(extent: Array) -> Array:
    """(R, 3) of covariances (R, 2, 2): standard deviations, the larger first, and the direction of that one in
    [0, π); nan where unknown."""
    known: Bools = np.asarray(np.isfinite(extent).all(axis=(1, 2)))
    values, vectors = np.linalg.eigh(np.where(known[:, None, None], extent, np.eye(2)))
    sigma = np.sqrt(np.maximum(values, 0.0))
    angle = np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]) % np.pi
    return np.where(known[:, None], np.stack([sigma[:, 1], sigma[:, 0], angle], axis=1), np.nan)


def thin(hull: Array, least: float) -> Array:
    """A convex polygon without corners that stand out by less than `least` over those beside them (of neighbours only
    one goes; twice), and with no more than MAX_HULL."""
    for odd in (1, 0):
        n = len(hull)
        if n > 3:
            before, after = np.roll(hull, 1, axis=0), np.roll(hull, -1, axis=0)
            along, out = after - before, hull - before
            area = np.abs(along[:, 0] * out[:, 1] - along[:, 1] * out[:, 0])
            flat = area < least * np.hypot(along[:, 0], along[:, 1])
            turn = np.arange(n) % 2 == odd
            turn[-1] &= n % 2 == 0  # of an odd number the last stands beside the first
            hull = hull[~(flat & turn)]
    return hull if len(hull) <= MAX_HULL else hull[:: math.ceil(len(hull) / MAX_HULL)]


def _steps(corners: Ints) -> list[int]:
    listed: list[int] = np.diff(corners, axis=0, prepend=np.zeros((1, 2), np.int64)).ravel().tolist()
    return listed
