"""The groups that `group-pda` follows: their states as arrays, their prediction, and newborn groups from points.

A group is *tentative* until it has been measured for `confirm_time`; then it is *confirmed* and gets an id. Without a
measurement it *coasts*. After `coast_time` it is *lost*, and removed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.grouping.whole_groups import NO_ID
from tracking.papers.group_pda import association_mass_kernels as kernels
from tracking.papers.group_pda.scaled_parameters import SPEED_PRIOR, ScaledParameters


class MemberPlaces(NamedTuple):
    """Where a group's K members, or their pixels, were measured last.

    offset (K, 2): from the group's centroid, in the unit of the points; last_seen (K,): time, s; known (K,) bool: True
    if a member was measured near that place before, so that it may stand in when it is missed (see `remember` in
    association).
    """

    offset: Array
    last_seen: Array
    known: Bools


NOBODY = MemberPlaces(np.zeros((0, 2)), np.zeros(0), np.zeros(0, bool))


class Unshared(NamedTuple):
    """The points (K, 2) of a group, when no other group could have them, last: at time t, s, with its velocity (2,)."""

    t: float
    velocity: Array
    points: Array


@dataclass
class GroupBank:
    """The state of G groups or parts of groups, a row each. Lengths: in the unit of the points (m or px), times: in s.

    x (G, 4): centroid xi and velocity v, in order x, y, vx, vy; P (G, 4, 4) their covariance. extent (G, 2, 2): Sigma,
    covariance of the members' positions about the centroid; size (G,): N, people. id (G,): NO_ID = -1 for a tentative
    group; a part has one of its own. first_seen (G,): time of the first points, of a part those of its group; last_seen
    (G,): of the last points. measured_time (G,): total time measured. null_time (G,): time without a feasible
    association, less measured frames in it. parent (G,): id of the group that the row is a part of, or NO_ID if it is
    no part (see merging_and_splitting). anchor (G, 2): from the centroid to a point that walks, from points, as the
    members who are seen in both of two frames; who comes into view or is hidden moves the centroid alone. colour_hist
    (G, C): people by colour; C = 0 without colours. members: a MemberPlaces of each group; unshared: an Unshared of
    each.
    """

    x: Array
    P: Array
    extent: Array
    size: Array
    id: Ints
    first_seen: Array
    last_seen: Array
    measured_time: Array
    null_time: Array
    parent: Ints
    anchor: Array
    colour_hist: Array
    members: list[MemberPlaces]
    unshared: list[Unshared]

    @classmethod
    def empty(cls, colour_bins: int = 0) -> GroupBank:
        """Returns a bank without groups; colour_bins: columns C of colour_hist, 0 without colours."""
        none, ids = np.zeros(0), np.zeros(0, np.int64)
        four = np.zeros((0, 4))
        return cls(
            four, np.zeros((0, 4, 4)), np.zeros((0, 2, 2)), none, ids, none, none, none, none,
            ids, np.zeros((0, 2)), np.zeros((0, colour_bins)), [], [],
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.id)

    @property
    def confirmed(self) -> Bools:
        """Flags (G,): True for groups with an id; the others are tentative."""
        return np.asarray(self.id != NO_ID)

    @property
    def group(self) -> Ints:
        """Id (G,) of the group that each row is a part of, or is; NO_ID of tentative groups."""
        return np.where(self.confirmed & (self.parent != NO_ID), self.parent, self.id)

    def at(self, rows: Ints | Bools) -> GroupBank:
        """Returns a bank of these rows, a copy."""
        rows, chosen = np.arange(len(self))[rows], dict[str, Any]()
        for f in fields(self):
            value = getattr(self, f.name)
            chosen[f.name] = [value[r] for r in rows.tolist()] if isinstance(value, list) else value[rows]
        return replace(self, **chosen)

    def positions(self, row: int) -> Array:
        """Returns the positions (K, 2) x, y of the members of the group in `row`: last measured places, moved with its
        centroid."""
        return self.members[row].offset + self.x[row, :2]

    def members_of(self, rows: Sequence[int]) -> tuple[Array, Ints, Array, Bools]:
        """Returns the K members of the groups in these rows, ascending: positions (K, 2), rows (K,), times last seen
        (K,), s, and whether they are known, (K,)."""
        members = [self.members[row] for row in rows]
        offset, last_seen, known = (np.concatenate(part) for part in zip(NOBODY, *members, strict=True))
        row = np.repeat(np.array(rows, np.int64), [len(m.known) for m in members])
        return offset + self.x[row, :2], row, last_seen, known

    def keep(self, kept: Bools) -> None:
        """Removes the rows that are False in kept (G,) bool, in place."""
        chosen = self.at(kept)
        for f in fields(self):
            setattr(self, f.name, getattr(chosen, f.name))

    def add(self, other: GroupBank) -> None:
        """Appends the rows of another bank with as many colour bins (else ValueError), in place."""
        for f in fields(self):
            a, b = getattr(self, f.name), getattr(other, f.name)
            setattr(self, f.name, a + b if isinstance(a, list) else np.concatenate([a, b]))

    def predict(self, scaled: ScaledParameters) -> None:
        """Predicts all groups to the next frame, in place: x = F x, P = F P F' + Q (eq. 2.3), F and Q from `scaled`."""
        self.x = self.x @ scaled.F.T
        self.P = scaled.F @ self.P @ scaled.F.T + scaled.Q


def newborn(points: Array, weights: Array, group: Ints, scaled: ScaledParameters, t: float) -> GroupBank:
    """Returns a bank of tentative groups made from points alone (sec. 3.3), with velocity 0, in order of group
    number."""
    count = int(group.max(initial=-1)) + 1
    if not count:
        return GroupBank.empty(scaled.colour_bins)
    inside = group >= 0
    g, y, w = group[inside], points[inside], weights[inside]
    people = np.asarray(np.bincount(g, w, count), float)
    mean = np.stack([np.bincount(g, w * y[:, a], count) for a in range(2)], 1) / people[:, None]
    d = y - mean[g]
    prior, strength = scaled.constraint.prior, scaled.constraint.strength
    square = np.stack([np.bincount(g, w * d[:, a] * d[:, b], count) for a in range(2) for b in range(2)], 1)
    extent = (square.reshape(-1, 2, 2) + strength * prior) / (people + strength)[:, None, None]
    extent /= scaled.kernel_rules[kernels.GATE_FACTOR]
    P = np.zeros((count, 4, 4))
    P[:, [0, 1], [0, 1]] = (scaled.point_sd**2 / np.maximum(people, 1e-3))[:, None] + scaled.point_sd**2
    P[:, [2, 3], [2, 3]] = (scaled.scale * SPEED_PRIOR) ** 2
    many = np.bincount(g, minlength=count).tolist()
    members = [MemberPlaces(d[g == k], np.full(n, t), np.zeros(n, bool)) for k, n in enumerate(many)]
    unshared = [Unshared(t, np.zeros(2), y[g == k]) for k in range(count)]
    zero, now = np.zeros(count), np.full(count, t)
    return GroupBank(
        np.hstack([mean, np.zeros((count, 2))]), P, extent, people, np.full(count, NO_ID),
        now, now.copy(), zero + scaled.dt, zero, np.full(count, NO_ID),
        np.zeros((count, 2)), np.zeros((count, scaled.colour_bins)), members, unshared,
    )  # fmt: skip
