"""What the replay page holds: rows of people as rounded, delta-coded columns, so that long recordings stay small.

Rows are sorted by (id, frame); a *stint* is a run of one id over consecutive frames. Numbers are integers (metres
times 100, px times 2, degrees), each column the differences from row to row; groups and visibility are run lengths.
A page decodes them with cumulative sums (view_data.js).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Camera, GroupEvent, Groups, Ints, Scene, Sequence, Tracks, Truth
from tracking.app.lineage import bars, links

NIL = -99_999
"""Stands for an unknown number in a column."""

SCALE = {"ground": 100, "space": 100, "image": 2}
MAX_HULL = 24

Json = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Rows:
    """One side of the page, R rows in any order: pos (R, 2), angle (R,) radians, box (R, 4) ltwh; nan where unknown.

    hull: a polygon per row where a row is a whole group.
    """

    plane: str
    frame: Ints
    id: Ints
    group: Ints
    pos: Array
    angle: Array
    box: Array
    visibility: Array
    hull: tuple[Array, ...] = ()


def truth_rows(truth: Truth) -> Rows:
    """The truth's rows; on the ground where it is known, else in the image."""
    n = len(truth.frame)
    pos = truth.pos if truth.pos is not None else _centres(truth.box, n)
    angle = truth.heading if truth.heading is not None else _angles(truth.vel, n)
    box = truth.box if truth.box is not None else np.full((n, 4), np.nan)
    plane = "ground" if truth.pos is not None else "image"
    return Rows(plane, truth.frame, truth.id, truth.group, pos, angle, box, truth.visibility)


def track_rows(tracks: SequenceOf[Tracks]) -> Rows:
    """A tracker's rows."""
    some = [t for t in tracks if len(t.id)]
    if not some:
        return Rows(
            "ground", *(np.zeros(0, np.int64),) * 3, np.zeros((0, 2)), np.zeros(0), np.zeros((0, 4)), np.zeros(0)
        )
    counts = [len(t.id) for t in some]
    box = [t.box if t.box is not None else np.full((len(t.id), 4), np.nan) for t in some]
    vel = np.concatenate([t.vel[:, :2] for t in some])
    return Rows(
        "image" if some[0].plane == "image" else "ground",
        np.repeat(np.array([t.index for t in some], np.int64), counts),
        np.concatenate([t.id for t in some]),
        np.concatenate([t.group for t in some]),
        np.concatenate([t.pos[:, :2] for t in some]),
        _angles(vel, len(vel)),
        np.concatenate(box),
        np.ones(len(vel)),
        tuple(hull for t in some for hull in _hulls(t)) if some[0].unit == "group" else (),
    )


def _hulls(tracks: Tracks) -> list[Array]:
    """The hull of each row of a tracker of groups (empty where it gives none)."""
    groups: Groups = tracks.groups or Groups.none()
    known = dict(zip(groups.id.tolist(), groups.hull, strict=True))
    return [_thin(known.get(name, np.zeros((0, 2)))) for name in tracks.id.tolist()]


def _thin(hull: Array) -> Array:
    return hull if len(hull) <= MAX_HULL else hull[:: math.ceil(len(hull) / MAX_HULL)]


def _centres(box: Array | None, n: int) -> Array:
    return np.full((n, 2), np.nan) if box is None else box[:, :2] + box[:, 2:] / 2


def _angles(vel: Array | None, n: int) -> Array:
    """Where people face, from their velocity; unknown for those who stand."""
    if vel is None:
        return np.full(n, np.nan)
    moving = np.hypot(vel[:, 0], vel[:, 1]) > 0.1
    return np.where(moving, np.arctan2(vel[:, 1], vel[:, 0]), np.nan)


def side(rows: Rows, events: Iterable[GroupEvent]) -> Json:
    """One side (truth or tracks) as columns, with its events and lineage."""
    events = list(events)
    order = np.lexsort((rows.frame, rows.id))
    frame, ids, group = rows.frame[order], rows.id[order], rows.group[order]
    scale = SCALE[rows.plane]
    pos, box = rows.pos[order] * scale, rows.box[order] * 2
    least = 1 if rows.hull else 2
    return {
        "plane": rows.plane,
        "scale": scale,
        "stints": stints(ids, frame),
        "x": deltas(pos[:, 0]),
        "y": deltas(pos[:, 1]),
        "a": deltas(np.degrees(rows.angle[order])),
        "box": [] if np.isnan(box).all() else [deltas(box[:, k]) for k in range(4)],
        "group": run_lengths(group),
        "vis": run_lengths(np.nan_to_num(rows.visibility[order] * 10, nan=10).round().astype(np.int64)),
        "hull": [np.rint(rows.hull[k] * scale).astype(int).ravel().tolist() for k in order] if rows.hull else [],
        "events": [event_json(e, scale) for e in events if e.start >= 1],
        "bars": [list(asdict(bar).values()) for bar in bars(frame, group, least)],
        "links": [list(asdict(link).values()) for link in links(events)],
    }


def stints(ids: Ints, frame: Ints) -> list[list[int]]:
    """[id, first frame, frames] of each stint of sorted rows."""
    if not len(ids):
        return []
    first = np.flatnonzero(np.r_[True, (np.diff(ids) != 0) | (np.diff(frame) != 1)])
    length = np.diff(np.r_[first, len(ids)])
    table: list[list[int]] = np.stack([ids[first], frame[first], length], axis=1).tolist()
    return table


def deltas(column: NDArray[np.float64]) -> list[int]:
    """A column rounded and differenced; nan becomes NIL."""
    whole = np.where(np.isfinite(column), np.rint(column), NIL).astype(np.int64)
    listed: list[int] = np.diff(whole, prepend=0).tolist()
    return listed


def run_lengths(column: Ints) -> list[int]:
    """value, count, value, count, …"""
    if not len(column):
        return []
    first = np.flatnonzero(np.r_[True, np.diff(column) != 0])
    listed: list[int] = np.stack([column[first], np.diff(np.r_[first, len(column)])], axis=1).ravel().tolist()
    return listed


def event_json(event: GroupEvent, scale: int) -> list[Any]:
    """kind, start, end, emitted, before, after, members, [x, y]."""
    pos = [round(v, 2) if math.isfinite(v) else None for v in event.pos]
    return [event.kind, event.start, event.end, event.emitted, event.before, event.after, event.members, pos]


def detections(sequence: Sequence) -> Json | None:
    """What the detector found, frame by frame: counts, and boxes in px or points (ground: cm)."""
    if not sequence.has_detections:
        return None
    found = [
        (f.index, f.detections)
        for f in sequence.without_pictures()
        if f.detections is not None and len(f.detections.pos)
    ]
    if not found:
        return None
    plane = found[0][1].plane
    pos = np.concatenate([d.pos[:, :2] for _, d in found]) * SCALE[plane]
    boxes = [d.box for _, d in found if d.box is not None]
    box = np.concatenate(boxes) if len(boxes) == len(found) else None
    return {
        "plane": plane,
        "scale": SCALE[plane],
        "frames": [[index, len(d.pos)] for index, d in found],
        "x": deltas(pos[:, 0]),
        "y": deltas(pos[:, 1]),
        "box": [] if box is None else [deltas(box[:, k]) for k in range(4)],
    }


def scene_json(scene: Scene | None) -> Json | None:
    """Walls less doors are the scene's business: its walls come as they are."""
    if scene is None:
        return None
    return {
        "size": _round(scene.size),
        "walls": _round(scene.walls.reshape(-1, 4)),
        "pillars": _round(scene.pillars),
        "doors": _round(scene.doors.reshape(-1, 4)),
        "service": _round(scene.service),
        "stairs": [[*_round(s.foot), *_round(s.head), s.width, s.rise, s.steps, s.landing] for s in scene.stairs],
        "wallHeight": scene.wall_height,
        "pillarHeight": scene.pillar_height,
    }


def camera_json(camera: Camera | None) -> Json | None:
    """What the page needs to draw ground and walls beneath the boxes."""
    if camera is None:
        return None
    return {
        "kind": camera.kind,
        "f": _round(camera.focal_px),
        "c": _round(camera.centre_px),
        "C": _round(camera.position, 4),
        "R": _round(camera.rotation, 6),
        "scale": None if math.isnan(camera.px_per_m) else camera.px_per_m,
    }


def _round(values: Any, digits: int = 3) -> list[Any]:
    listed: list[Any] = np.round(np.asarray(values, float), digits).tolist()
    return listed
