"""What `stereo` reports in a frame: the confirmed groups with their hulls, and the events.

Hulls go round the expected places of a group's points (space_group.expected_places), seen from above.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.geometry.hull_kernels import convex_hulls
from sim.types import Array, Groups, Plane, Tracks
from tracking.grouping.whole_groups import WholeGroupEvent, reported_event
from tracking.papers.stereo.measurement import POS, VEL
from tracking.papers.stereo.space_group import SpaceGroup


@dataclass(frozen=True)
class ShownFrame:
    """The frame that is reported.

    index: from 1; t: s; fps: frames per second. plane: of the tracks; scale: units of the plane per m. outline (V, 2):
    what a point covers round its place, seen from above, m. size_known: True if each point is a person.
    """

    index: int
    t: float
    fps: float
    plane: Plane
    scale: float
    outline: Array
    size_known: bool


def space_tracks(
    groups: Sequence[SpaceGroup], events: Sequence[WholeGroupEvent], report_coast: float, shown: ShownFrame
) -> Tracks:
    """Returns the Tracks, with unit "group", of the confirmed groups measured within the last `report_coast` s."""
    rows = [g for g in groups if g.confirmed and shown.t - g.last_seen <= report_coast + 1e-9]
    rows = sorted(rows, key=lambda g: g.id)
    axes = 3 if shown.plane == "space" else 2
    order = POS[:axes] + VEL[:axes]
    s = shown.scale
    id = np.array([g.id for g in rows], np.int64)
    x = np.stack([g.ekf.x[order, 0] for g in rows]) if rows else np.zeros((0, 2 * axes))
    P = np.stack([g.ekf.P[np.ix_(order, order)] for g in rows]) if rows else np.zeros((0, 2 * axes, 2 * axes))
    flat = np.ix_(POS[:2], POS[:2])
    extent = np.stack([g.spread[flat] for g in rows]) if rows else np.zeros((0, 2, 2))
    size = np.array([g.count if shown.size_known else np.nan for g in rows])
    hulls = convex_hulls([((g.members + g.pos)[:, None, :2] + shown.outline).reshape(-1, 2) * s for g in rows])
    pos, vel = s * x[:, :axes], s * x[:, axes:]
    found = Groups(id, tuple(np.zeros(0, np.int64) for _ in rows), pos, vel, s**2 * extent, size, hulls)
    return Tracks(
        shown.index, shown.t, shown.plane, "group", id, id.copy(), pos.copy(), vel.copy(), s**2 * P,
        None, np.ones(len(rows)), found, tuple(reported_event(e, shown.index, shown.t, shown.fps, s) for e in events),
    )  # fmt: skip
