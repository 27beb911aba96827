"""The groups that `group-pda` follows: their states as arrays, birth, merging, splitting, loss.

A group is tentative until it was measured for `confirm_time`, then it has an id and is told. It coasts where it is not
measured, is lost after `coast_time` (it then claims nothing, waiting for a newborn to take its id back), and dies after
`recapture_time`. null: the length of its spell without a feasible association, which every good frame shortens.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.papers.group_pda import association_kernels as kernels
from tracking.papers.group_pda.kernel_parameters import Rules

UNNAMED = -1
LISTS = ("places", "past")


@dataclass
class Bank:
    """G groups. State of each:

    x (G, 4) xi, v; P (G, 4, 4); extent (G, 2, 2) Sigma; size (G,) N, people. id (G,), UNNAMED tentative. born, seen
    (G,): s, first and last measurement; measured (G,): s in all; null (G,): s without a feasible association. own (G,):
    people in this frame who are nearer to no other group. parent (G,): id of the group that a tentative one left, or
    UNNAMED, and origin (G, 2), where. look (G, C): people by colour, C = 0 where none are looked at. places: of each
    its points (K, 2) relative to xi, when each was measured last (K,), s, and whether it was there before, too (K,).
    past: of each its points of the last seconds, (time, points).
    """

    x: Array
    P: Array
    extent: Array
    size: Array
    id: Ints
    born: Array
    seen: Array
    measured: Array
    null: Array
    own: Array
    parent: Ints
    origin: Array
    look: Array
    places: list[tuple[Array, Array, Bools]]
    past: list[list[tuple[float, Array]]]

    @classmethod
    def empty(cls, colours: int = 0) -> Bank:
        """No groups, of so many colours."""
        none, ids, two = np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 2))
        four = np.zeros((0, 4))
        return cls(
            four, np.zeros((0, 4, 4)), np.zeros((0, 2, 2)), none, ids, none, none, none, none, none, ids, two,
            np.zeros((0, colours)), [], [],
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.id)

    @property
    def named(self) -> Bools:
        """(G,) not tentative."""
        return np.asarray(self.id != UNNAMED)

    def keep(self, kept: Bools) -> None:
        """Drop the others."""
        for f in fields(self):
            value = getattr(self, f.name)
            new = [v for v, k in zip(value, kept, strict=True) if k] if f.name in LISTS else value[kept]
            setattr(self, f.name, new)

    def add(self, other: Bank) -> None:
        """Take in more groups, behind these."""
        for f in fields(self):
            a, b = getattr(self, f.name), getattr(other, f.name)
            setattr(self, f.name, a + b if f.name in LISTS else np.concatenate([a, b]))

    def predict(self, rules: Rules) -> None:
        """x = F x, P = F P F' + Q (2.3)."""
        self.x = self.x @ rules.F.T
        self.P = rules.F @ self.P @ rules.F.T + rules.Q


def newborn(points: Array, weights: Array, group: Ints, rules: Rules, t: float) -> Bank:
    """Tentative groups out of measurements (3.3): sample mean, covariance and number of each, at rest.

    group (M,): 0, 1, … or -1 for none.
    """
    count = int(group.max(initial=-1)) + 1
    if not count:
        return Bank.empty(rules.colours)
    inside = group >= 0
    g, y, w = group[inside], points[inside], weights[inside]
    people = np.asarray(np.bincount(g, w, count), float)
    mean = np.stack([np.bincount(g, w * y[:, a], count) for a in range(2)], 1) / people[:, None]
    d = y - mean[g]
    prior, strength, c = rules.constraint.prior, rules.constraint.strength, rules.config
    square = np.stack([np.bincount(g, w * d[:, a] * d[:, b], count) for a in range(2) for b in range(2)], 1)
    extent = (square.reshape(-1, 2, 2) + strength * prior) / (people + strength)[:, None, None]
    extent /= rules.numbers[kernels.CUT]
    P = np.zeros((count, 4, 4))
    P[:, [0, 1], [0, 1]] = (rules.noise**2 / np.maximum(people, 1e-3))[:, None] + rules.noise**2
    P[:, [2, 3], [2, 3]] = (rules.scale * c.speed_prior) ** 2
    many = np.bincount(g, minlength=count).tolist()
    places = [(d[g == k], np.full(n, t), np.zeros(n, bool)) for k, n in enumerate(many)]
    nil, now = np.zeros(count), np.full(count, t)
    return Bank(
        np.hstack([mean, np.zeros((count, 2))]), P, extent, people, np.full(count, UNNAMED),
        now, now.copy(), nil + rules.dt, nil, people.copy(), np.full(count, UNNAMED), mean.copy(),
        np.zeros((count, rules.colours)), places, [[] for _ in range(count)],
    )  # fmt: skip


def children(parent: Bank, row: int, points: Array, weights: Array, group: Ints, rules: Rules, t: float) -> Bank:
    """The groups into which one splits: newborn from its points; ours: with its velocity and age."""
    c = rules.config
    made = newborn(points, weights, group, rules, t)
    made.born[:], made.measured[:] = parent.born[row], parent.measured[row]
    made.look[:] = parent.look[row]
    if parent.id[row] == UNNAMED:
        made.parent[:], made.origin[:] = parent.parent[row], parent.origin[row]
    if c.inherit_velocity:
        made.x[:, 2:] = parent.x[row, 2:]
        made.P[:, 2:, 2:] = parent.P[row, 2:, 2:] + (rules.scale * c.split_speed) ** 2 * np.eye(2)
    return made


def merged(bank: Bank, rows: Ints) -> Bank:
    """One group out of several (3.1): means by size, extents with the spread of the centroids.

    P is that of a weighted mean of independent centroids, sum w^2 P_i: their spread is the group's extent, no error.
    """
    size = np.asarray(bank.size[rows].sum())
    w = bank.size[rows] / size
    x = w @ bank.x[rows]
    d = bank.x[rows, :2] - x[:2]
    extent = np.einsum("k,kij->ij", w, bank.extent[rows] + d[:, :, None] * d[:, None, :])
    P = np.einsum("k,kij->ij", w * w, bank.P[rows])
    heir = rows[np.lexsort((bank.id[rows], bank.born[rows], -np.rint(bank.size[rows])))[0]]  # most people, the older
    moved = [(y + bank.x[r, :2] - x[:2], seen, known) for r in rows.tolist() for y, seen, known in (bank.places[r],)]
    y, seen, known = zip(*moved, strict=True)
    places = (np.concatenate(y), np.concatenate(seen), np.concatenate(known))
    one = slice(heir, heir + 1)
    return Bank(
        x[None], P[None], extent[None], size[None].copy(), bank.id[one], bank.born[rows].min(keepdims=True),
        bank.seen[rows].max(keepdims=True), bank.measured[rows].max(keepdims=True), np.zeros(1), size[None],
        np.full(1, UNNAMED), x[None, :2].copy(), bank.look[rows].sum(0, keepdims=True), [places], [[]],
    )  # fmt: skip
