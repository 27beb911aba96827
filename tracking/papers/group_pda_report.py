"""What `group-pda` tells: groups with hulls, and events."""

from __future__ import annotations

import numpy as np

from sim.footprints import footprint_hulls
from sim.types import Array, GroupEvent, Groups, Plane, Tracks
from tracking.papers import group_pda_kernels as kernels
from tracking.papers.group_pda_bank import Bank
from tracking.papers.group_pda_changes import Change
from tracking.papers.group_pda_rules import Rules


def tracks(bank: Bank, changes: list[Change], rules: Rules, index: int, t: float, plane: Plane, fps: float) -> Tracks:
    """The groups that have an id and were measured lately."""
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
        _hulls(places, rules, plane),
    )
    return Tracks(
        index, t, plane, "group", id, id.copy(), x[:, :2].copy(), x[:, 2:].copy(), bank.P[rows],
        None, np.ones(len(rows)), groups, tuple(_event(c, index, fps) for c in changes),
    )  # fmt: skip


def _hulls(places: list[Array], rules: Rules, plane: Plane) -> tuple[Array, ...]:
    """Hulls of people's footprints on the ground, of squares of foreground in the image."""
    if not places:
        return ()
    if plane == "image":
        half = max(rules.half_cell, 0.25 * rules.scale * (rules.half_cell == 0)) * np.array(
            [[-1, -1], [1, -1], [1, 1], [-1, 1]]
        )
        return tuple(_hull((p[:, None] + half).reshape(-1, 2)) for p in places)
    return tuple(footprint_hulls(np.concatenate(places), np.array([len(p) for p in places])))


def _hull(points: Array) -> Array:
    import cv2

    found = cv2.convexHull(points.astype(np.float32), clockwise=False)
    return np.asarray(found, float).reshape(-1, 2)


def _event(change: Change, index: int, fps: float) -> GroupEvent:
    start = min(max(round(change.since * fps) + 1, 1), index)
    return GroupEvent(change.kind, start, index, index, change.before, change.after, (), change.pos)
