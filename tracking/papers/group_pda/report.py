"""What `group-pda` reports in a frame: the confirmed groups with their hulls, and the events.

Input: the bank of groups, whose lengths are in the unit of the points (m on the ground or px in the image), and the
frame's events as `WholeGroupEvent`s. Output: the `Tracks` of the frame with unit "group".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.geometry.hull_kernels import convex_hulls
from sim.types import Array, Groups, Plane, Tracks
from tracking.grouping.whole_groups import WholeGroupEvent, reported_event
from tracking.papers.group_pda import association_mass_kernels as kernels
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.scaled_parameters import ScaledParameters


@dataclass(frozen=True)
class ReportFrame:
    """The frame that is reported.

    index: its number, from 1; t: time, s; plane: "ground" (m) or "image" (px); fps: frames per second. outline (V, 2):
    a polygon round the origin, in the plane's unit, that stands for what covers the ground or the image about one
    member's place: a footprint, a usual box, or a cell of the pixel grid.
    """

    index: int
    t: float
    plane: Plane
    fps: float
    outline: Array


def report_tracks(
    bank: GroupBank, events: list[WholeGroupEvent], scaled: ScaledParameters, frame: ReportFrame
) -> Tracks:
    """Returns Tracks with unit "group", sorted by id, of the confirmed groups measured within the last
    `report_coast` s."""
    rows = np.flatnonzero(bank.confirmed & (frame.t - bank.last_seen <= scaled.config.report_coast + 1e-9))
    rows = rows[np.argsort(bank.id[rows])]
    id, x = bank.id[rows], bank.x[rows]
    groups = Groups(
        id,
        tuple(np.zeros(0, np.int64) for _ in rows),
        x[:, :2],
        x[:, 2:],
        bank.extent[rows],
        bank.size[rows] / scaled.kernel_rules[kernels.DETECT_PROB],
        _hulls([bank.positions(r) for r in rows.tolist()], frame.outline),
    )
    return Tracks(
        frame.index, frame.t, frame.plane, "group", id, id.copy(), x[:, :2].copy(), x[:, 2:].copy(), bank.P[rows],
        None, np.ones(len(rows)), groups, tuple(reported_event(e, frame.index, frame.t, frame.fps) for e in events),
    )  # fmt: skip


def _hulls(places: list[Array], outline: Array) -> tuple[Array, ...]:
    # The places on their own hull suffice, and are few.
    return convex_hulls([(corner[:, None] + outline).reshape(-1, 2) for corner in convex_hulls(places)])
