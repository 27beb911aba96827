"""Hulls of footprints: the ground that groups cover, for a whole sequence at once.

A footprint is a 16-gon Q on a disc of 0.25 m. The hull of the members' footprints is the Minkowski sum of Q and the
hull of the members' places: p_i + q_k is a vertex of it where the normal cones of p_i and q_k share an angle.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from sim.geometry.polygons import FOOTPRINT, SIDES
from sim.types import Array, Ints

STEP = 2 * np.pi / SIDES
Q = FOOTPRINT * np.stack([np.cos(STEP * np.arange(SIDES)), np.sin(STEP * np.arange(SIDES))], axis=1)
CONES = STEP * (np.arange(SIDES) - 0.5)  # where the normal cone of each vertex of Q begins; all are STEP wide
CHUNK = 512  # groups worked on at once
FLAT = 1e-9  # rad: a narrower cone is a rounding error, its vertex lies on an edge


def footprint_hull(pos: Array) -> Array:
    """(V, 2) hull of the footprints of people at pos (N, 2)."""
    pos = np.asarray(pos, float).reshape(-1, 2)
    return footprint_hulls(pos, np.array([len(pos)]))[0]


def place_hulls(pos: Array, count: Ints) -> list[Array]:
    """Like `footprint_hulls`, of the places themselves; vertices may be repeated."""
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    for rows, members in _by_size(pos, count):
        for row, hull in zip(rows, _wrap(members)[0], strict=True):
            hulls[row] = hull
    return hulls


def footprint_hulls(pos: Array, count: Ints) -> list[Array]:
    """One hull (V, 2) per group: pos (R, 2) holds the members of one group after the other, count (G,) > 0 each."""
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    for rows, members in _by_size(pos, count):
        for row, hull in zip(rows, _minkowski(*_wrap(members)), strict=True):
            hulls[row] = hull
    return hulls


def _by_size(pos: Array, count: Ints) -> Iterator[tuple[Ints, Array]]:
    """Groups of equal size together: their numbers (G,), places (G, n, 2); so few that their tables stay in the
    cache."""
    first = np.cumsum(count) - count
    for n in np.unique(count[count > 0]):
        every = np.flatnonzero(count == n)
        for low in range(0, len(every), CHUNK):
            rows = every[low : low + CHUNK]
            yield rows, pos[first[rows, None] + np.arange(n)]


def _wrap(pos: Array) -> tuple[Array, Array, Array]:
    """Convex hulls of G sets of n points (G, n, 2) by gift wrapping, all sets in step.

    The way round begins where the normal cone of q_0 does, so that none of Q's cones lies across its ends.

    Returns vertices (G, V, 2), the start of each one's normal cone (G, V) and the cone's width (G, V), 0 for padding.
    """
    rows, n = np.arange(len(pos)), pos.shape[1]
    now = (pos @ np.array([np.cos(CONES[0]), np.sin(CONES[0])])).argmax(axis=1)
    facing = np.full(len(pos), CONES[0] + np.pi / 2)  # direction of the edge that arrives at `now`
    turned = np.zeros(len(pos))
    vertex, start, width = [], [], []
    for _ in range(n + 1):  # the first comes again as the last, with the rest of its cone
        arm = pos - pos[rows, now][:, None]
        there = (arm != 0).any(axis=2)
        turn = np.arctan2(arm[..., 1], arm[..., 0]) - facing[:, None]
        turn = (turn + np.pi / 2) % (2 * np.pi) - np.pi / 2  # a hair to the right is straight on, not all the way round
        turn = np.where(there, np.maximum(turn, 0.0), np.inf)
        least = turn.min(axis=1)
        furthest = np.where(turn <= least[:, None] + FLAT, (arm**2).sum(axis=2), -1.0).argmax(axis=1)
        # The last vertex is where the way round is complete; one place alone turns all the way.
        done = turned + least > 2 * np.pi - FLAT
        cone = np.where(done, 2 * np.pi - turned, least)
        vertex.append(pos[rows, now])
        start.append(facing - np.pi / 2)
        width.append(np.maximum(cone, 0.0))
        facing, turned = facing + cone, turned + cone
        now = np.where(done, now, furthest)
    return np.stack(vertex, axis=1), np.stack(start, axis=1), np.stack(width, axis=1)


def _minkowski(p: Array, start: Array, width: Array) -> list[Array]:
    """Vertices of p_i + q_k in the order of their normals, for each of G sets."""
    after = (CONES - start[..., None]) % (2 * np.pi)  # (G, V, SIDES): from where p_i's cone begins to q_k's
    before = 2 * np.pi - after
    begins_inside = after < width[..., None]
    shared = np.where(
        begins_inside, np.minimum(STEP, width[..., None] - after), np.minimum(STEP - before, width[..., None])
    )
    turned = (start - start[:, :1])[..., None]
    key = np.where(shared > FLAT, turned + np.where(begins_inside, after, 0.0), np.inf).reshape(len(p), -1)
    corner = (p[:, :, None] + Q).reshape(len(p), -1, 2)
    order = np.argsort(key, axis=1)
    used = np.arange(key.shape[1]) < np.isfinite(key).sum(axis=1)[:, None]
    group, _ = np.nonzero(used)
    flat = corner[group, order[used]]
    ends = np.cumsum(used.sum(axis=1)).tolist()
    return [flat[a:b] for a, b in pairwise([0, *ends])]
