"""Splitting of `group-pda`'s groups (sec. 3.3): a group without feasible associations falls apart.

An association (a set of points that may be a group's) is feasible if its points form one group under the group
constraint G_y (tracking.filters.components). `split` partitions the points (M, 2) of a group without feasible
associations by G_y and replaces its row of the bank by one row per part. A group of one part stays, one of noise only
is removed. `children` makes the rows of the parts. Lengths are in the unit of the points (m on the ground or px), times
in s.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.filters.components import partition
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.group_pda.event_onsets import split_onset
from tracking.papers.group_pda.group_bank import GroupBank, newborn
from tracking.papers.group_pda.missed_members import thinned
from tracking.papers.group_pda.scaled_parameters import SPLIT_SPEED, ScaledParameters


def split(
    bank: GroupBank, row: int, points: Array, weights: Array, scaled: ScaledParameters, t: float, ids: GroupIds
) -> WholeGroupEvent | None:
    """Replace the group in `row` by those that its points (M, 2) form under G_y; return the event of a confirmed
    group."""
    group = partition(points, weights, scaled.constraint)
    confirmed = bank.id[row] != NO_ID
    if group.max(initial=-1) < 1:
        bank.null_time[row] = 0.0
        if group.max(initial=-1) == 0:
            return None
        leave = WholeGroupEvent("leave", t, (int(bank.id[row]),), (), tuple(bank.x[row, :2].tolist()))
        bank.remove(row)
        return leave if confirmed else None
    parts = children(bank, row, points, weights, group, scaled, t)
    away = np.hypot(*(parts.x[:, :2] - bank.x[row, :2]).T)
    largest, other = np.lexsort((parts.x[:, 1], parts.x[:, 0], away, -parts.size))[:2].tolist()
    if confirmed:
        parts.id[:] = [bank.id[row] if k == largest else ids.new() for k in range(len(parts))]
    two = [thinned(points[group == k]) for k in (largest, other)]
    onset, place = split_onset(bank.recent_points[row], two, scaled.metres_per_unit, scaled.body_cov, t)
    event = WholeGroupEvent(
        "split", onset, (int(bank.id[row]),), tuple(sorted(parts.id.tolist())), tuple(place.tolist())
    )
    bank.remove(row)
    bank.add(parts)
    return event if confirmed else None


def children(
    bank: GroupBank, row: int, points: Array, weights: Array, group: Ints, scaled: ScaledParameters, t: float
) -> GroupBank:
    """Returns a bank of the groups into which the group in `row` splits; `bank` is not changed."""
    parts = newborn(points, weights, group, scaled, t)
    parts.first_seen[:], parts.measured_time[:] = bank.first_seen[row], bank.measured_time[row]
    parts.colour_hist[:] = bank.colour_hist[row]
    if bank.id[row] == NO_ID:
        parts.parent[:], parts.origin[:] = bank.parent[row], bank.origin[row]
    if scaled.config.corrections:
        parts.x[:, 2:] = bank.x[row, 2:]
        parts.P[:, 2:, 2:] = bank.P[row, 2:, 2:] + (scaled.scale * SPLIT_SPEED) ** 2 * np.eye(2)
    return parts
