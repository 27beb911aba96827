"""Two groups of `group-pda` on the points of one: the one with less of its own is lost (ours).

Where groups share points, each is measured by all of them, so a group that has left, or is hidden, would follow another
for ever. For a while that is right: who is hidden comes out again.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.types import Array, Ints
from tracking.filters.components import regions_overlap
from tracking.papers.group_pda.group_bank import Bank
from tracking.papers.group_pda.kernel_parameters import Rules

DOUBLE = 0.55
"""Share of two groups that must be measured: else they may be one and the same, a hidden one on another's points."""


def doubtful(bank: Bank, i: int, j: int) -> bool:
    """Are so few people measured of two groups that they may be one?"""
    return bool(DOUBLE * (bank.size[i] + bank.size[j]) > bank.own[i] + bank.own[j])


class Doubles:
    """State: for how long each two groups that lie on each other were doubtful, s, less the time they were not."""

    def __init__(self) -> None:
        self.clock: dict[tuple[int, int], float] = {}

    def step(self, bank: Bank, rules: Rules, t: float) -> None:
        """Lose one of each two groups that were doubtful for `coast_time`: it claims nothing until it is back."""
        rows = np.flatnonzero(bank.named & (bank.seen >= t))
        met = {(int(bank.id[i]), int(bank.id[j])): (i, j) for i, j in _on_each_other(bank, rows, rules.config.gate)}
        clock = {}
        for ids, (i, j) in met.items():
            clock[ids] = self.clock.get(ids, 0.0) + (rules.dt if doubtful(bank, i, j) else -rules.dt)
        self.clock = {ids: s for ids, s in clock.items() if s > 0}
        for ids in [ids for ids, s in self.clock.items() if s > rules.config.coast_time + 1e-9]:
            less = _less(bank, *met[ids])
            bank.seen[less] = min(bank.seen[less], t - max(rules.config.coast_time, rules.dt) - 1e-6)
            self.clock = {pair: s for pair, s in self.clock.items() if bank.id[less] not in pair}


def _on_each_other(bank: Bank, rows: Ints, gate: float) -> Iterator[tuple[int, int]]:
    near = regions_overlap(bank.x[rows, :2], bank.extent[rows], gate)
    return ((int(rows[i]), int(rows[j])) for i, j in np.argwhere(np.triu(near, 1)).tolist())


def _less(bank: Bank, i: int, j: int) -> int:
    """The row of the one that has less of its own; then the younger."""
    share: Array = bank.own[[i, j]] / bank.size[[i, j]]
    return min((i, j), key=lambda row: (share[0] if row == i else share[1], -bank.born[row], -bank.id[row]))
