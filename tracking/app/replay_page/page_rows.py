"""The rows of truth or tracks on the replay page (one per person or group and frame), and their encoding as columns.

Encoded rows are sorted by id and frame. Numbers are whole: cm on the ground, half px in the image, degrees; each column
holds differences from row to row. Groups and visibility are run lengths.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, fields, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from sim.geometry.boxes import centres
from sim.store.track_files import flatten
from sim.types import Array, Bools, GroupEvent, Groups, Ints, Tracks, Truth
from tracking.app.replay_page.timeline import bars, links

SCALE = {"ground": 100, "space": 100, "image": 2}  # Encoded steps per m or px of a position, by plane.
MOVING = 0.1  # People slower than this (m/s on the ground, px/s in the image) have no direction.
MAX_CORNERS = 24  # Corners of an encoded hull at most.
LEAST_CORNER = {"ground": 0.02, "image": 1.0}  # m, px: corners of a hull that stand out by less are left out.
SPEED_SCALE = {"ground": 10, "image": 1}  # Encoded steps per m/s and px/s.
NIL = -99_999  # Stands for an unknown number (nan) in a column.
Json = dict[str, Any]  # An object that `json` can write.


@dataclass(frozen=True, eq=False)
class PageRows:
    """Truth or one tracker's tracks as R rows in any order, one per person or group and frame; nan where unknown.

    The last four are None but of a tracker of whole groups; in m or px.
    """

    plane: str  # "ground" (m) or "image" (px)
    frame: Ints  # (R,) from 1
    id: Ints
    group: Ints  # (R,) id of the group, -1 for alone
    pos: Array  # (R, 2) x, y
    angle: Array  # (R,) rad, direction of view or movement, from +x towards +y, which in the image is downwards
    box: Array  # (R, 4) left, top, width, height, px
    visibility: Array  # (R,) 0 to 1
    size: Array | None = None  # (R,) estimated number of people
    speed: Array | None = None  # (R,) m/s or px/s
    extent: Array | None = None  # (R, 2, 2) covariance of where the group's people are, m² or px²
    hull: NDArray[np.object_] | None = None  # (R,) polygons (V, 2) x, y, without vertices where unknown

    def ordered(self, rows: Ints) -> PageRows:
        """Returns the rows with the indices `rows`, in this order."""
        columns = {field.name: getattr(self, field.name) for field in fields(self) if field.name != "plane"}
        return replace(self, **{name: column[rows] for name, column in columns.items() if column is not None})


def rows_of_truth(truth: Truth) -> PageRows:
    """Returns the truth's rows: on the ground if positions are labelled, else centres of boxes in the image."""
    n = len(truth.frame)
    box = truth.box if truth.box is not None else np.full((n, 4), np.nan)
    pos = truth.pos if truth.pos is not None else centres(box)
    angle = truth.heading if truth.heading is not None else _directions(truth.vel, n)
    plane = "ground" if truth.pos is not None else "image"
    return PageRows(plane, truth.frame, truth.id, truth.group, pos, angle, box, truth.visibility)


def rows_of_tracks(tracks: SequenceOf[Tracks]) -> PageRows:
    """Returns a tracker's rows, in the order of `tracks`."""
    rows = flatten(list(tracks))
    plane, shown = "image" if rows.plane == "image" else "ground", np.ones(len(rows.id))
    wholes = _wholes(tracks, rows.vel) if rows.unit == "group" else {}
    pos, angle = rows.pos[:, :2], _directions(rows.vel, len(rows.id))
    return PageRows(plane, rows.frame, rows.id, rows.group, pos, angle, rows.box, shown, **wholes)


def _directions(vel: Array | None, n: int) -> Array:
    """Returns the direction (n,) rad of each velocity (n, 2), m/s or px/s; nan where unknown or not faster than 0.1."""
    if vel is None:
        return np.full(n, np.nan)
    moving = np.hypot(vel[:, 0], vel[:, 1]) > MOVING
    return np.where(moving, np.arctan2(vel[:, 1], vel[:, 0]), np.nan)


def encode_rows(rows: PageRows, events: Iterable[GroupEvent]) -> Json:
    """Returns the rows as encoded columns, sorted by id and frame, with events and the group timeline."""
    events, scale = list(events), SCALE[rows.plane]
    rows = rows.ordered(np.lexsort((rows.frame, rows.id)))
    pos, box = rows.pos * scale, rows.box * 2
    people = None if rows.size is None else np.nan_to_num(rows.size)
    return {
        "plane": rows.plane,
        "scale": scale,
        "stints": stints(rows.id, rows.frame),
        "x": deltas(pos[:, 0]),
        "y": deltas(pos[:, 1]),
        "a": deltas(np.degrees(rows.angle)),
        "box": [] if np.isnan(box).all() else [deltas(box[:, k]) for k in range(4)],
        "group": run_lengths(rows.group),
        "vis": run_lengths(np.nan_to_num(rows.visibility * 10, nan=10).round().astype(np.int64)),
        "wholes": _encoded_wholes(rows, scale),
        "events": [_event(e) for e in events if e.start >= 1],
        "bars": bars(rows.frame, rows.group, people),
        "links": links(events),
    }


def _event(event: GroupEvent) -> list[Any]:
    """Returns [kind, start, end, emitted, before, after, members, [x, y]] of an event."""
    pos = [round(v, 2) if math.isfinite(v) else None for v in event.pos]
    return [event.kind, event.start, event.end, event.emitted, event.before, event.after, event.members, pos]


def _wholes(tracks: SequenceOf[Tracks], vel: Array) -> dict[str, Any]:
    """Returns the columns of whole groups of all rows of `tracks`."""
    no_hull, columns = np.zeros((0, 2)), list[tuple[Array, Array, float]]()
    for t in tracks:
        groups = t.groups or Groups.none()
        every = zip(groups.hull or (no_hull,) * len(groups.id), groups.extent, groups.size, strict=True)
        known = dict(zip(groups.id.tolist(), every, strict=True))
        columns += [known.get(name, (no_hull, np.full((2, 2), np.nan), math.nan)) for name in t.id.tolist()]
    return {
        "size": np.array([size for _, _, size in columns], float),
        "speed": np.hypot(vel[:, 0], vel[:, 1]),
        "extent": np.array([extent for _, extent, _ in columns]).reshape(-1, 2, 2),
        "hull": np.fromiter((hull for hull, _, _ in columns), object, len(columns)),
    }


def _encoded_wholes(rows: PageRows, scale: int) -> Json | None:
    if rows.size is None or rows.speed is None or rows.extent is None or rows.hull is None:
        return None
    axes = ellipses(rows.extent)
    hulls = [simplified(hull, LEAST_CORNER[rows.plane]) for hull in rows.hull]
    return {
        "size": deltas(rows.size * 10),
        "speed": deltas(rows.speed * SPEED_SCALE[rows.plane]),
        "ellipse": [deltas(axes[:, 0] * scale), deltas(axes[:, 1] * scale), deltas(np.degrees(axes[:, 2]))],
        "hull": [deltas(hull * scale) for hull in hulls],
    }


def ellipses(extent: Array) -> Array:
    """Returns the ellipses (R, 3) of covariances (R, 2, 2): standard deviation along the long and the short axis, and
    direction of the long axis, rad; nan for a covariance that is not finite."""
    known: Bools = np.asarray(np.isfinite(extent).all(axis=(1, 2)))
    values, vectors = np.linalg.eigh(np.where(known[:, None, None], extent, np.eye(2)))
    sigma = np.sqrt(np.maximum(values, 0.0))
    angle = np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]) % np.pi
    return np.where(known[:, None], np.stack([sigma[:, 1], sigma[:, 0], angle], axis=1), np.nan)


def simplified(hull: Array, least: float) -> Array:
    """Returns a convex polygon (V, 2) simplified by Douglas and Peucker: without corners that are nearer than `least`,
    in its unit, to the remaining outline."""
    if len(hull) > 3:
        corners = hull.astype(np.float32)
        kept = (corners[:, None] == cv2.approxPolyDP(corners, least, closed=True)[:, 0]).all(axis=2).any(axis=1)
        hull = hull[kept] if kept.sum() > 2 else hull
    return hull if len(hull) <= MAX_CORNERS else hull[:: math.ceil(len(hull) / MAX_CORNERS)]


def deltas(column: NDArray[np.float64]) -> list[int]:
    """Returns the column (N,), rounded to whole numbers, as its first value and the differences between neighbours; nan
    and infinity count as -99999. Two columns (N, 2) are interleaved."""
    whole = np.where(np.isfinite(column), np.rint(column), NIL).astype(np.int64)
    listed: list[int] = np.diff(whole, axis=0, prepend=0).ravel().tolist()
    return listed


def run_lengths(column: Ints) -> list[int]:
    """Returns the column (N,) as value, count, value, count, … of its runs of equal values; [] for an empty column."""
    if not len(column):
        return []
    first = np.flatnonzero(np.r_[True, np.diff(column) != 0])
    listed: list[int] = np.stack([column[first], np.diff(np.r_[first, len(column)])], axis=1).ravel().tolist()
    return listed


def stints(ids: Ints, frame: Ints) -> list[list[int]]:
    """Returns [id, first frame, number of frames] of each stint: one id in consecutive frames. [] without rows."""
    if not len(ids):
        return []
    first = np.flatnonzero(np.r_[True, (np.diff(ids) != 0) | (np.diff(frame) != 1)])
    length = np.diff(np.r_[first, len(ids)])
    table: list[list[int]] = np.stack([ids[first], frame[first], length], axis=1).tolist()
    return table
