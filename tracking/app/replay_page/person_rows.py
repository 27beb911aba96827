"""The rows of truth or tracks on the replay page (one per person or group and frame), and their encoding as columns.

Encoded rows are sorted by id and frame. Numbers are whole: cm on the ground, half px in the image, degrees; each column
holds differences from row to row. Groups and visibility are run lengths.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from sim.types import Array, GroupEvent, Ints, Tracks, Truth
from tracking.app.replay_page import group_rows
from tracking.app.replay_page.column_encoding import Json, deltas, run_lengths, stints
from tracking.app.replay_page.group_rows import PageGroupRows
from tracking.app.replay_page.group_timeline import Bar, bars, links

SCALE = {"ground": 100, "space": 100, "image": 2}
"""Encoded steps per m or px of a position, by plane."""

MOVING = 0.1
"""People slower than this (m/s on the ground, px/s in the image) have no direction."""


@dataclass(frozen=True, eq=False)
class PageRows:
    """Truth or one tracker's tracks as R rows in any order, one per person or group and frame; nan where unknown."""

    plane: str  # "ground" (m) or "image" (px)
    frame: Ints  # (R,) from 1
    id: Ints
    group: Ints  # (R,) id of the group, -1 for alone
    pos: Array  # (R, 2) x, y
    angle: Array  # (R,) rad, direction of view or movement, from +x towards +y, which in the image is downwards
    box: Array  # (R, 4) left, top, width, height, px
    visibility: Array  # (R,) 0 to 1
    groups: PageGroupRows | None = None  # of rows that are groups


def rows_of_truth(truth: Truth) -> PageRows:
    """Returns the truth's rows."""
    n = len(truth.frame)
    pos = truth.pos if truth.pos is not None else _centres(truth.box, n)
    angle = truth.heading if truth.heading is not None else _directions(truth.vel, n)
    box = truth.box if truth.box is not None else np.full((n, 4), np.nan)
    plane = "ground" if truth.pos is not None else "image"
    return PageRows(plane, truth.frame, truth.id, truth.group, pos, angle, box, truth.visibility)


def rows_of_tracks(tracks: SequenceOf[Tracks]) -> PageRows:
    """Returns a tracker's rows, in the order of `tracks`."""
    count = np.array([len(t.id) for t in tracks], np.int64)
    box = [t.box if t.box is not None else np.full((len(t.id), 4), np.nan) for t in tracks]
    vel = np.concatenate([np.zeros((0, 2)), *(t.vel[:, :2] for t in tracks)])
    no_id = np.zeros(0, np.int64)
    return PageRows(
        "image" if any(t.plane == "image" for t in tracks) else "ground",
        np.repeat(np.array([t.index for t in tracks], np.int64), count),
        np.concatenate([no_id, *(t.id for t in tracks)]),
        np.concatenate([no_id, *(t.group for t in tracks)]),
        np.concatenate([np.zeros((0, 2)), *(t.pos[:, :2] for t in tracks)]),
        _directions(vel, len(vel)),
        np.concatenate([np.zeros((0, 4)), *box]),
        np.ones(len(vel)),
        group_rows.rows_of_groups(tracks) if any(t.unit == "group" for t in tracks) else None,
    )


def _centres(box: Array | None, n: int) -> Array:
    return np.full((n, 2), np.nan) if box is None else box[:, :2] + box[:, 2:] / 2


def _directions(vel: Array | None, n: int) -> Array:
    """Returns the direction (n,) rad of each velocity (n, 2), m/s or px/s; nan where unknown or not faster than 0.1."""
    if vel is None:
        return np.full(n, np.nan)
    moving = np.hypot(vel[:, 0], vel[:, 1]) > MOVING
    return np.where(moving, np.arctan2(vel[:, 1], vel[:, 0]), np.nan)


def encode_rows(rows: PageRows, events: Iterable[GroupEvent]) -> Json:
    """Returns the rows as encoded columns, sorted by id and frame, with events and the group timeline."""
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
        "wholes": None if rows.groups is None else group_rows.encode_groups(rows.groups, order, rows.plane, scale),
        "events": [_event(e) for e in events if e.start >= 1],
        "bars": [list(asdict(bar).values()) for bar in _bars(rows)],
        "links": [list(asdict(link).values()) for link in links(events)],
    }


def _bars(rows: PageRows) -> list[Bar]:
    if rows.groups is None:
        return bars(rows.frame, rows.group)
    return bars(rows.frame, rows.group, least=0, people=np.nan_to_num(rows.groups.size))


def _event(event: GroupEvent) -> list[Any]:
    """Returns [kind, start, end, emitted, before, after, members, [x, y]] of an event."""
    pos = [round(v, 2) if math.isfinite(v) else None for v in event.pos]
    return [event.kind, event.start, event.end, event.emitted, event.before, event.after, event.members, pos]
