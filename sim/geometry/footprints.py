"""Hulls of footprints: the ground that groups of people cover, for all groups of a sequence at once.

The footprint of a person is FOOTPRINT, a regular 16-gon on a circle of 0.25 m. The hull of a group is the convex hull
of its members' footprints. It equals the Minkowski sum of the 16-gon Q and the hull P of the members' positions. Let
p_i be a vertex of P and q_k one of Q. p_i + q_k is a vertex of the sum where their normal cones (directions in which
each is the furthest point) share an angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sim.elementary import atan2, dot, unit
from sim.types import Array, Ints

FOOTPRINT_RADIUS = 0.25  # m
FOOTPRINT_SIDES = 16
STEP = 2 * np.pi / FOOTPRINT_SIDES  # rad: width of the normal cone of each footprint vertex
FOOTPRINT = FOOTPRINT_RADIUS * unit(STEP * np.arange(FOOTPRINT_SIDES))  # (16, 2) m, counter-clockwise
CONES = STEP * (np.arange(FOOTPRINT_SIDES) - 0.5)  # rad: the angle at which each vertex's normal cone begins
CHUNK = 512  # groups per pass
FLAT = 1e-9  # rad: a narrower cone is a rounding error, and its vertex lies on an edge


def footprint_hull(pos: Array) -> Array:
    """Return the convex hull (V, 2), x and y in m, counter-clockwise, of the footprints of N people at pos (N, 2) m.

    A footprint is a regular 16-gon on a circle of 0.25 m round the person; one person has 16 vertices. (0, 2) if nobody
    is given. Positions must not be nan: the result then has no meaning.
    """
    pos = np.asarray(pos, float).reshape(-1, 2)
    return footprint_hulls(pos, np.array([len(pos)]))[0]


def footprint_hulls(pos: Array, count: Ints) -> list[Array]:
    """Return a list of one convex hull (V, 2) in m per group, counter-clockwise: the hull of its members' footprints.

    A footprint is a regular 16-gon on a circle of 0.25 m round the person. pos (R, 2) m holds the members of group 0,
    then those of group 1, and so on; count (G,) is the number of members of each group. The hull of a group without
    members is (0, 2). Positions must not be nan. Raises IndexError if the counts add up to more than R; further rows
    are ignored.
    """
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    for groups, members in _groups_of_equal_size(pos, count):
        for group, hull in zip(groups, _minkowski_sums(*_gift_wrap(members)), strict=True):
            hulls[group] = hull
    return hulls


def position_hulls(pos: Array, count: Ints) -> list[Array]:
    """Return a list of one convex hull (V, 2) in m per group, counter-clockwise: the hull of its members' positions.

    pos (R, 2) m holds the members of group 0, then those of group 1, and so on; count (G,) is the number of members of
    each group. A vertex may be repeated, the first one as the last. A group without members has (0, 2). Positions must
    not be nan. Raises IndexError if the counts add up to more than R; further rows are ignored.
    """
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    for groups, members in _groups_of_equal_size(pos, count):
        for group, hull in zip(groups, _gift_wrap(members)[0], strict=True):
            hulls[group] = hull
    return hulls


def _groups_of_equal_size(pos: Array, count: Ints) -> Iterator[tuple[Ints, Array]]:
    """Yield groups of equal size n together: their indices (K,), from 0 on, and members' positions (K, n, 2) in m.

    K is at most CHUNK (512). Smaller groups come first; groups without members are left out. pos (R, 2) m: the members
    of group 0, then those of group 1, and so on; count (G,): number of members of each group.
    """
    first = np.cumsum(count) - count
    for n in np.unique(count[count > 0]):
        every = np.flatnonzero(count == n)
        for low in range(0, len(every), CHUNK):
            groups = every[low : low + CHUNK]
            yield groups, pos[first[groups, None] + np.arange(n)]


def _gift_wrap(pos: Array) -> tuple[Array, Array, Array]:
    """Return the convex hulls of G sets of n points, pos (G, n, 2) in m, by gift wrapping all sets in step; n is at
    least 1.

    Returns vertices (G, V, 2) in m, counter-clockwise, the angle at which each vertex's normal cone (directions in
    which it is the furthest point) begins (G, V) rad, and the width of that cone (G, V) rad; V = n + 1. Padding
    vertices repeat the last vertex and have width 0. Each walk round a hull begins where the normal cone of footprint
    vertex 0 begins, at -π/16, so that no footprint cone lies across both ends of the walk. The walk ends at its first
    vertex.
    """
    rows, n = np.arange(len(pos)), pos.shape[1]
    now = dot(pos, unit(CONES[0])).argmax(axis=1)
    facing = np.full(len(pos), CONES[0] + np.pi / 2)  # direction of the edge that arrives at `now`
    turned = np.zeros(len(pos))
    vertex, start, width = [], [], []
    for _ in range(n + 1):  # the first vertex comes again as the last one, with the rest of its cone
        arm = pos - pos[rows, now][:, None]
        elsewhere = (arm != 0).any(axis=2)
        turn = atan2(arm[..., 1], arm[..., 0]) - facing[:, None]
        turn = (turn + np.pi / 2) % (2 * np.pi) - np.pi / 2  # a rounding error to the right is straight on
        turn = np.where(elsewhere, np.maximum(turn, 0.0), np.inf)
        least = turn.min(axis=1)
        furthest = np.where(turn <= least[:, None] + FLAT, dot(arm, arm), -1.0).argmax(axis=1)
        # The last vertex is where the turn is complete; a single position turns all the way.
        done = turned + least > 2 * np.pi - FLAT
        cone = np.where(done, 2 * np.pi - turned, least)
        vertex.append(pos[rows, now])
        start.append(facing - np.pi / 2)
        width.append(np.maximum(cone, 0.0))
        facing, turned = facing + cone, turned + cone
        now = np.where(done, now, furthest)
    return np.stack(vertex, axis=1), np.stack(start, axis=1), np.stack(width, axis=1)


def _minkowski_sums(p: Array, start: Array, width: Array) -> list[Array]:
    """Return a list of G arrays (V, 2) in m, counter-clockwise: hulls of footprints, each a hull p plus the 16-gon
    FOOTPRINT.

    Such a Minkowski sum has the vertices p_i + q_k, of vertex i of the hull and k of the 16-gon, whose normal cones
    share an angle, in the order of that angle. p (G, V, 2) m, start (G, V) rad and width (G, V) rad are the result of
    `_gift_wrap`: vertices of the hulls of positions, and where the normal cone of each begins and how wide it is.
    """
    after = (CONES - start[..., None]) % (2 * np.pi)  # (G, V, 16): angle from the start of p_i's cone to that of q_k's
    before = 2 * np.pi - after
    begins_inside = after < width[..., None]
    shared = np.where(
        begins_inside, np.minimum(STEP, width[..., None] - after), np.minimum(STEP - before, width[..., None])
    )
    turned = (start - start[:, :1])[..., None]
    key = np.where(shared > FLAT, turned + np.where(begins_inside, after, 0.0), np.inf).reshape(len(p), -1)
    corner = (p[:, :, None] + FOOTPRINT).reshape(len(p), -1, 2)
    order = np.argsort(key, axis=1, kind="stable")
    used = np.arange(key.shape[1]) < np.isfinite(key).sum(axis=1)[:, None]
    group, _ = np.nonzero(used)
    flat = corner[group, order[used]]
    ends = np.cumsum(used.sum(axis=1)).tolist()
    return [flat[a:b] for a, b in pairwise([0, *ends])]
