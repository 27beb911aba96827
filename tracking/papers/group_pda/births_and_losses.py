"""Births, confirmation and loss of `group-pda`'s groups: how a group's life begins and ends.

A new group is tentative (without id). It is confirmed, and gets an id, once it has been measured long enough. A new
group beside a member of a group is a part of that group (see merging_and_splitting). A group without points for too
long is lost. As in the truth, only groups of several people enter and leave.

Each function changes the bank of groups in place. Events of confirmed groups are returned as `WholeGroupEvent`s.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.filters.components import partition
from tracking.grouping.group_events import ARRIVAL
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.group_pda.association import walking_reach
from tracking.papers.group_pda.group_bank import GroupBank, newborn
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

ALONE = 1.5  # People: fewer are one person, whose coming and going is no event.

ExpectedMembers = tuple[Array, Array, Ints]


def expected_members(bank: GroupBank, scaled: ScaledParameters, t: float) -> ExpectedMembers:
    """Returns where the K members of the confirmed groups that were measured lately should be at time t (s).

    place (K, 2), reach (K,): how far from it each may be, in the unit of the points. group (K,): id of its row, a
    group's or a part's."""
    recent = t - bank.last_seen <= max(scaled.config.carry_time, scaled.dt) + 1e-9
    rows = np.flatnonzero(bank.confirmed & recent).tolist()
    place, row, last_seen, _ = bank.members_of(rows)
    return place, walking_reach(scaled, t - last_seen), bank.id[row]


def add_newborns(
    bank: GroupBank, points: Array, weights: Array, expected: ExpectedMembers, scaled: ScaledParameters, t: float
) -> None:
    """Appends to the bank the tentative groups that the unclaimed points form under the group constraint G_y (sec.
    3.3)."""
    group = partition(points, weights, scaled.constraint)
    born, (place, reach, of) = newborn(points, weights, group, scaled, t), expected
    for k in range(len(born) if len(place) else 0):
        d2 = np.square(points[group == k][:, None] - place).sum(2).min(0)
        d2[d2 > reach**2] = np.inf
        if np.isfinite(d2.min()):
            row = int(np.flatnonzero(bank.id == of[d2.argmin()])[0])
            born.parent[k], born.first_seen[k] = bank.group[row], bank.first_seen[row]
    bank.add(born)


def confirm(
    bank: GroupBank, scaled: ScaledParameters, t: float, ids: GroupIds, begin: float
) -> Iterator[WholeGroupEvent]:
    """Gives ids to tentative groups that were measured for longer than `confirm_time`; yields an enter event of each of
    several people that is no part of a group. begin: time, s, of the first observed frame; who is there so soon after
    it does not enter."""
    for row in np.flatnonzero(~bank.confirmed & (bank.measured_time > scaled.config.confirm_time + 1e-9)).tolist():
        if bank.parent[row] != NO_ID and not (bank.group == bank.parent[row]).any():
            # its group is gone
            bank.parent[row], bank.first_seen[row] = NO_ID, t - bank.measured_time[row] + scaled.dt
        bank.id[row] = ids.new()
        entered = bank.first_seen[row] > begin + ARRIVAL and bank.size[row] > ALONE
        if bank.parent[row] == NO_ID and entered:
            place = tuple(bank.x[row, :2].tolist())
            yield WholeGroupEvent("enter", float(bank.first_seen[row]), (), (int(bank.id[row]),), place)


def remove_lost(bank: GroupBank, scaled: ScaledParameters, t: float) -> Iterator[WholeGroupEvent]:
    """Removes groups and parts that were not measured for too long, at time t (s); yields a leave event of each group
    of several people of which no part is left. Else the largest part has its id."""
    # At least dt: this frame is still to be measured, and a frame before was missed.
    patience = np.maximum(np.where(bank.confirmed, scaled.config.coast_time, scaled.config.confirm_time), scaled.dt)
    dead: Bools = t - bank.last_seen > patience + 1e-9
    for row in np.flatnonzero(dead & bank.confirmed & (bank.parent == NO_ID)).tolist():
        parts = np.flatnonzero(~dead & (bank.group == bank.id[row]))
        if len(parts):
            heir = parts[bank.size[parts].argmax()]
            bank.id[heir], bank.parent[heir] = bank.id[row], NO_ID
        elif bank.size[row] > ALONE:
            last_seen = float(bank.last_seen[row])
            place = bank.x[row, :2] - (t - last_seen) * bank.x[row, 2:]
            yield WholeGroupEvent("leave", last_seen, (int(bank.id[row]),), (), tuple(place.tolist()))
    bank.keep(~dead)
