"""Leads people round walls and through gates (doors, narrow gaps) while the simulation runs, each alone where the group
cannot walk as one.

A group walks in its formation while all members see its middle, and the middle sees the next point of the way. Else,
and at a gate, it goes in file: each member walks to the next point of the way that they have not passed. Who does not
see that point walks to the corner at which the shortest way there begins. Who is ahead waits for the last one, for 20
s; from then on each walks alone. At a gate where two people cannot pass each other, the sides take turns; in
others people keep to the right while others come.
"""

from __future__ import annotations

import numpy as np

from sim.clock import SCRIPT_RATE
from sim.crowd.forces import HELD, HOLDER, SHUT
from sim.crowd.group_state import GroupState
from sim.elementary import length
from sim.geometry.walls import blocked
from sim.types import Array, Bools

WAIT_TIME = 20.0  # s after which nobody waits for the group any more
TOGETHER = 2.5  # m: people who see each other so near have not lost each other


class Wayfinding:
    """Who walks alone in one running simulation, and where to. State: gate_state: whose turn it is at each gate;
    since (G,): s since which each group goes in file; parted: people have lost their groups."""

    def __init__(self, groups: GroupState) -> None:
        self.groups = groups
        navigator = groups.navigator
        self.gate_state = np.zeros((len(navigator.gates), 3))
        self.parted = False
        self.since = np.zeros(len(groups.arrays.length))

    def advance(self, t: float, state: Array) -> bool:
        """Decides at time t (s) who walks alone; returns True if `GroupState.rows` must be called afterwards.

        state (P, 4): x, y, vx, vy by column, nan while absent.
        """
        groups, navigator = self.groups, self.groups.navigator
        if not len(navigator.closed) or not groups.present.any():
            return False
        from sim.crowd.wayfinding_kernels import find_ways

        arrays = groups.arrays
        waits = (groups.queue_of >= 0) | groups.held
        group_of = np.ascontiguousarray(groups.group_of)  # of one person, numba takes the column for another type
        changed, late = find_ways(
            t, state, groups.present, waits, group_of, groups.targets, groups.waypoint, groups.alone,
            groups.aims, groups.share, groups.gone, arrays.route, arrays.kind, groups.gate, groups.beyond,
            arrays.length, arrays.current, arrays.filing, self.since, arrays.finish, navigator.nodes, navigator.far,
            navigator.closed, navigator.first, self.gate_state, 1 / SCRIPT_RATE, WAIT_TIME,
        )  # fmt: skip
        if (late or self.parted) and not round(t * SCRIPT_RATE) % SCRIPT_RATE:
            self._part_the_lost(t, state)
        self.since[groups.group_of[self.waiting()]] = t  # who waits for a door has not lost the others
        return bool(changed)

    def waiting(self) -> Bools:
        """Returns flags (P,): True for people whose next point of the way is a door that is shut, or has opened for
        others first."""
        groups, arrays, g = self.groups, self.groups.arrays, self.groups.group_of
        kept = np.flatnonzero((self.gate_state[:, HOLDER] >= SHUT) | (self.gate_state[:, HELD] < 0.0))
        if not len(kept):
            return np.zeros(len(g), np.bool_)
        gate = groups.gate[g, np.where(arrays.filing[g], groups.waypoint, arrays.current[g])]
        bidden = arrays.arrived[g] | (groups.queue_of >= 0) | groups.held
        return np.asarray(groups.present & ~bidden & np.isin(gate, kept))

    def _part_the_lost(self, t: float, state: Array) -> None:
        """Marks, once a second, who walks without the group: those whom others of the group waited for in vain.

        The people of a group who see each other within TOGETHER m remain together.
        """
        groups, arrays = self.groups, self.groups.arrays
        groups.apart[:] = -1
        self.parted = False
        navigator = groups.navigator
        walls = np.concatenate([navigator.walls, navigator.gates[self.gate_state[:, HOLDER] == SHUT]])
        for g in np.flatnonzero(arrays.filing & (t - self.since >= WAIT_TIME)).tolist():
            columns = np.array([c for c in groups.members[g] if groups.present[c]], np.int64)
            if len(columns) < 2:
                continue
            pos = state[columns, :2]
            near = length(pos[:, None] - pos) < TOGETHER
            a, b = np.broadcast_arrays(pos[:, None], pos[None])
            near &= ~blocked(a, b, walls)
            for _ in range(len(columns).bit_length()):
                near = np.any(near[:, :, None] & near, axis=1)
            first = columns[near.argmax(axis=1)]  # of those whom each sees, over others or not
            lost = first != columns[0]
            groups.apart[columns[lost]] = first[lost]
            self.parted |= bool(lost.any())
