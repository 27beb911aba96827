"""Hulls of footprints: the ground that groups of people cover, for all groups of a sequence at once.

The footprint of a person is FOOTPRINT, a regular 16-gon on a circle of 0.25 m. The hull of a group is the convex hull
of its members' footprints. It equals the Minkowski sum of the 16-gon Q and the hull P of the members' positions. Let
p_i be a vertex of P and q_k one of Q. p_i + q_k is a vertex of the sum where their normal cones (directions in which
each is the furthest point) share an angle.
"""

from __future__ import annotations

from collections.abc import Callable
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
    """Returns the hull (V, 2) of the footprints of N people at pos (N, 2); (0, 2) of nobody."""
    pos = np.asarray(pos, float).reshape(-1, 2)
    return footprint_hulls(pos, np.array([len(pos)]))[0]


def footprint_hulls(pos: Array, count: Ints) -> list[Array]:
    """Returns the hull (V, 2) of the footprints of each group, counter-clockwise.

    pos (R, 2) m: the members of group 0, then those of group 1, …; count (G,): how many each has. None may be nan.
    """
    return _hulls(pos, count, lambda members: _minkowski_sums(*_gift_wrap(members)))


def position_hulls(pos: Array, count: Ints) -> list[Array]:
    """Returns the hull (V, 2) of the positions of each group, counter-clockwise; a vertex may be repeated.

    pos (R, 2), count (G,): as of `footprint_hulls`.
    """
    return _hulls(pos, count, lambda members: list(_gift_wrap(members)[0]))


def _hulls(pos: Array, count: Ints, hulls_of: Callable[[Array], list[Array]]) -> list[Array]:
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    first = np.cumsum(count) - count
    # Groups of equal size n together, up to CHUNK of them.
    for n in np.unique(count[count > 0]):
        every = np.flatnonzero(count == n)
        for low in range(0, len(every), CHUNK):
            groups = every[low : low + CHUNK]
            members = pos[first[groups, None] + np.arange(n)]
            for group, hull in zip(groups, hulls_of(members), strict=True):
                hulls[group] = hull
    return hulls


def _gift_wrap(pos: Array) -> tuple[Array, Array, Array]:
    """Returns the hulls of sets pos (G, n, 2): vertices (G, V, 2), where their normal cones begin, and their widths."""
    rows, n = np.arange(len(pos)), pos.shape[1]
    # The walk begins where the cone of footprint vertex 0 does, so that no footprint cone lies across both its ends.
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
    """Returns each hull plus the footprint: the vertices p_i + q_k whose normal cones share an angle, by angle."""
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
