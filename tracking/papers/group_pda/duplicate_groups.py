"""Two groups of `group-pda` that follow the same people: the one with fewer people of its own becomes lost (ours).

Groups that share points are each measured by all of them. Without this rule a group that is hidden or has left would
follow another one for ever. For `coast_time` that is allowed, as hidden people come out again.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.types import Array, Ints
from tracking.filters.components import regions_overlap
from tracking.papers.group_pda.group_bank import GroupBank
from tracking.papers.group_pda.scaled_parameters import ScaledParameters

LEAST_MEASURED = 0.55  # Two groups may be one and the same if a smaller share of their people together is measured.


def may_be_one(bank: GroupBank, i: int, j: int) -> bool:
    """Returns True if so few people of the groups in rows i and j of the bank are measured that the two may be one
    group."""
    return bool(LEAST_MEASURED * (bank.size[i] + bank.size[j]) > bank.own_people[i] + bank.own_people[j])


class DuplicateGroups:
    """Finds pairs of groups that follow the same people.

    State: clock, a dict: the time, s, by pair of ids (the smaller first) of groups whose search regions overlap.
    A time grows in frames in which the two may be the same group and falls in the others; at 0, or once the regions do
    not overlap, the pair is dropped.
    """

    def __init__(self) -> None:
        self.clock: dict[tuple[int, int], float] = {}

    def step(self, bank: GroupBank, scaled: ScaledParameters, t: float) -> None:
        """Advance the clocks by a frame, at time t (s), and make one group lost of each pair whose clock has passed
        `coast_time`."""
        rows = np.flatnonzero(bank.confirmed & (bank.last_seen >= t))
        rows = rows[np.argsort(bank.id[rows])]
        pairs = {(int(bank.id[i]), int(bank.id[j])): (i, j) for i, j in _overlapping(bank, rows, scaled.config.gate)}
        clock = {}
        for ids, (i, j) in pairs.items():
            clock[ids] = self.clock.get(ids, 0.0) + (scaled.dt if may_be_one(bank, i, j) else -scaled.dt)
        self.clock = {ids: s for ids, s in clock.items() if s > 0}
        for ids in [ids for ids, s in self.clock.items() if s > scaled.config.coast_time + 1e-9]:
            if ids not in self.clock:
                continue  # one of them has just become lost
            row = _with_fewer_own(bank, *pairs[ids])
            lost_at = t - max(scaled.config.coast_time, scaled.dt) - 1e-6
            bank.last_seen[row] = min(bank.last_seen[row], lost_at)
            self.clock = {pair: s for pair, s in self.clock.items() if bank.id[row] not in pair}


def _overlapping(bank: GroupBank, rows: Ints, gate: float) -> Iterator[tuple[int, int]]:
    near = regions_overlap(bank.x[rows, :2], bank.extent[rows], gate)
    return ((int(rows[i]), int(rows[j])) for i, j in np.argwhere(np.triu(near, 1)).tolist())


def _with_fewer_own(bank: GroupBank, i: int, j: int) -> int:
    share: Array = bank.own_people[[i, j]] / bank.size[[i, j]]
    return min((i, j), key=lambda row: (share[0] if row == i else share[1], -bank.first_seen[row], -bank.id[row]))
