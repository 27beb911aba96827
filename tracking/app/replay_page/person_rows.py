"""What the replay page holds: rows of people as rounded, delta-coded columns, so that long recordings stay small.

Rows are sorted by (id, frame); a *stint* is a run of one id over consecutive frames. Numbers are integers (metres
times 100, px times 2, degrees), each column the differences from row to row; groups and visibility are run lengths.
A page decodes them with cumulative sums (decode.js).
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sim.types import Array, Camera, GroupEvent, Ints, Scene, Sequence, Tracks, Truth
from tracking.app.replay_page import group_rows
from tracking.app.replay_page.column_encoding import deltas, run_lengths, stints
from tracking.app.replay_page.group_rows import Wholes
from tracking.app.replay_page.group_timeline import Bar, bars, links

SCALE = {"ground": 100, "space": 100, "image": 2}

Json = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Rows:
    """One side of the page, R rows in any order: pos (R, 2), angle (R,) radians, box (R, 4) ltwh; nan where unknown.

    wholes: more of each row where the rows are groups.
    """

    plane: str
    frame: Ints
    id: Ints
    group: Ints
    pos: Array
    angle: Array
    box: Array
    visibility: Array
    wholes: Wholes | None = None


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
    count = np.array([len(t.id) for t in tracks], np.int64)
    box = [t.box if t.box is not None else np.full((len(t.id), 4), np.nan) for t in tracks]
    vel = np.concatenate([np.zeros((0, 2)), *(t.vel[:, :2] for t in tracks)])
    no_id = np.zeros(0, np.int64)
    return Rows(
        "image" if any(t.plane == "image" for t in tracks) else "ground",
        np.repeat(np.array([t.index for t in tracks], np.int64), count),
        np.concatenate([no_id, *(t.id for t in tracks)]),
        np.concatenate([no_id, *(t.group for t in tracks)]),
        np.concatenate([np.zeros((0, 2)), *(t.pos[:, :2] for t in tracks)]),
        _angles(vel, len(vel)),
        np.concatenate([np.zeros((0, 4)), *box]),
        np.ones(len(vel)),
        group_rows.wholes(tracks) if any(t.unit == "group" for t in tracks) else None,
    )


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
        "wholes": None if rows.wholes is None else group_rows.columns(rows.wholes, order, rows.plane, scale),
        "events": [event_json(e, scale) for e in events if e.start >= 1],
        "bars": [list(asdict(bar).values()) for bar in _bars(rows)],
        "links": [list(asdict(link).values()) for link in links(events)],
    }


def _bars(rows: Rows) -> list[Bar]:
    if rows.wholes is None:
        return bars(rows.frame, rows.group)
    return bars(rows.frame, rows.group, least=0, people=np.nan_to_num(rows.wholes.size))


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
        "k": camera.radial,
    }


def _round(values: Any, digits: int = 3) -> list[Any]:
    listed: list[Any] = np.round(np.asarray(values, float), digits).tolist()
    return listed
