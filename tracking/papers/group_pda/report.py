"""What `group-pda` tells: groups with hulls, and events."""

from __future__ import annotations

import numpy as np

from sim.geometry.hull_kernels import convex_hulls
from sim.types import Array, GroupEvent, Groups, Plane, Tracks
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda.group_bank import Bank
from tracking.papers.group_pda.kernel_parameters import Rules
from tracking.papers.group_pda.merging import Change


def tracks(
    bank: Bank, changes: list[Change], rules: Rules, index: int, t: float, plane: Plane, fps: float, outline: Array
) -> Tracks:
    """The groups that have an id and were measured lately; outline (V, 2): of what stands at a place."""
    rows = np.flatnonzero(bank.named & (t - bank.seen <= rules.config.report_coast + 1e-9))
    rows = rows[np.argsort(bank.id[rows])]
    id, x = bank.id[rows], bank.x[rows]
    places = [bank.places[r][0] + bank.x[r, :2] for r in rows.tolist()]
    groups = Groups(
        id,
        tuple(np.zeros(0, np.int64) for _ in rows),
        x[:, :2],
        x[:, 2:],
        bank.extent[rows],
        bank.size[rows] / rules.numbers[kernels.DETECT],
        _hulls(places, outline),
    )
    return Tracks(
        index, t, plane, "group", id, id.copy(), x[:, :2].copy(), x[:, 2:].copy(), bank.P[rows],
        None, np.ones(len(rows)), groups, tuple(_event(c, index, t, fps) for c in changes),
    )  # fmt: skip


def _hulls(places: list[Array], outline: Array) -> tuple[Array, ...]:
    """Convex hulls of an outline (V, 2) round each group's places (K, 2): round those on their own hull."""
    return convex_hulls([(corner[:, None] + outline).reshape(-1, 2) for corner in convex_hulls(places)])


def _event(change: Change, index: int, t: float, fps: float) -> GroupEvent:
    start = min(max(index - round((t - change.since) * fps), 1), index)
    return GroupEvent(change.kind, start, index, index, change.before, change.after, (), change.pos)
