"""Members who were measured a moment ago are carried along (ours): a detector's misses do not move a group, or part it.

A group knows the places of its points, not whose they are. From points, a place with nothing near it in this frame is
somebody missed: he stands there as a point of this group only, for `carry_time` after he was measured last. Pixels are
many, and what is missing of them is hidden: there only the outline is kept, to be told while a group coasts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sim.geometry.hull_kernels import convex_hulls
from sim.types import Array, Bools, Ints
from tracking.papers.group_pda.association_kernels import near
from tracking.papers.group_pda.group_bank import Bank
from tracking.papers.group_pda.kernel_parameters import Rules

PAST, MEMORY = 3.0, 64
"""For so long, s, no more than so many of a group's points are kept, to look back from a split."""


@dataclass(frozen=True)
class Claims:
    """Who may have which points (M, 2): weights (M,) people that each stands for; seen (M,) s, when it was measured; d2
    (G, M) inf outside the regions; own (M,) the one group, a row of the bank, that has it anyway, or -1; hits (M,) how
    many groups may have it."""

    points: Array
    weights: Array
    seen: Array
    d2: Array
    own: Ints
    hits: Ints


def claimed(points: Array, weights: Array, d2: Array, own: Ints, t: float) -> Claims:
    """The claims on the points of a frame; own: from `attached`."""
    hits = np.where(own >= 0, 1, np.isfinite(d2).sum(0))
    return Claims(points, weights, np.full(len(points), t), d2, own, hits)


def with_carried(claims: Claims, bank: Bank, rules: Rules, t: float) -> Claims:
    """Members who are not measured, too, of groups that have any points; behind the others, each its group's own."""
    felt = np.asarray(np.isfinite(claims.d2).any(axis=1))
    felt[claims.own[claims.own >= 0]] = True
    place, row, seen = carried(bank, claims.points, rules, t)
    kept = felt[row]
    place, row, seen = place[kept], row[kept], seen[kept]
    return Claims(
        np.concatenate([claims.points, place]),
        np.concatenate([claims.weights, np.ones(len(place))]),
        np.concatenate([claims.seen, seen]),
        np.hstack([claims.d2, np.full((len(bank), len(place)), np.inf)]),
        np.concatenate([claims.own, row]),
        np.concatenate([claims.hits, np.ones(len(place), np.int64)]),
    )


def carried(bank: Bank, points: Array, rules: Rules, t: float) -> tuple[Array, Ints, Array]:
    """Members who are not measured: places (K, 2), group (K,) a row of the bank, when they were measured last (K,)."""
    c, kept = rules.config, []
    if c.carry_time > 0 and not rules.pixels:
        for row, (y, seen, known) in enumerate(bank.places):
            late = known & (t - seen <= c.carry_time + 1e-9)
            if late.any():
                kept.append((y[late] + bank.x[row, :2], np.full(int(late.sum()), row), seen[late]))
    if not kept:
        return np.zeros((0, 2)), np.zeros(0, np.int64), np.zeros(0)
    place, row_of, seen = (np.concatenate(part) for part in zip(*kept, strict=True))
    missed = ~near(place, points, rules.scale * c.carry_reach)
    return place[missed], row_of[missed], seen[missed]


def exclusive(chosen: Bools, d2: Array, looks: Array) -> Bools:
    """(G, M) whose each point is that several groups may have chosen: the likeliest one's, to whose centroid it is
    nearest, given looks (G, M) (tracking.papers.group_pda.colour) or (G, 0).

    Estimates share points (4.1); a person is in one group only.
    """
    mine, shared = chosen.copy(), np.flatnonzero(chosen.sum(0) > 1)
    if len(shared):
        far = d2[:, shared] - 2 * looks[:, shared] if looks.shape[1] else d2[:, shared]
        nearest = np.where(chosen[:, shared], far, np.inf).argmin(0)
        mine[:, shared] = np.arange(len(chosen))[:, None] == nearest
    return mine


def remember(bank: Bank, claims: Claims, chosen: Bools, rules: Rules, t: float) -> None:
    """The places of the points chosen (G, M) as those of the groups; the old ones where a group has none."""
    for row in np.flatnonzero(chosen.any(1)).tolist():
        mine, when = claims.points[chosen[row]], claims.seen[chosen[row]]
        bank.past[row] = [*(p for p in bank.past[row] if p[0] > t - PAST), (t, thinned(mine))]
        place = mine - bank.x[row, :2]
        if not rules.pixels:
            bank.places[row] = (place, when, near(place, bank.places[row][0], rules.scale * rules.config.carry_reach))
            continue
        (place,) = convex_hulls([place])
        bank.places[row] = (place, np.full(len(place), t), np.ones(len(place), bool))


def thinned(points: Array) -> Array:
    """At most MEMORY of the points (M, 2), drawn by where they are: neither their order nor a grid's shows."""
    if len(points) <= MEMORY:
        return points
    scattered = np.sin(points @ np.array([12.9898, 78.233])) * 43758.5453
    return points[np.argsort(scattered - np.floor(scattered), kind="stable")[:MEMORY]]
