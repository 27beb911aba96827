"""Hulls, mean positions and extents (covariances of positions) of groups in each frame.

They are computed from positions of people whose group ids are known, of the truth or of a tracker's tracks. On the
ground a hull encloses discs of 0.25 m round the members, in the image their boxes or such discs.

`footprint_hulls` makes the hulls of all groups of a sequence at once. The footprint of a person is FOOTPRINT, a regular
16-gon on a circle of 0.25 m. The hull of a group is the convex hull of its members' footprints. It equals the Minkowski
sum of the 16-gon Q and the hull P of the members' positions. Let p_i be a vertex of P and q_k one of Q. p_i + q_k is a
vertex of the sum where their normal cones (directions in which each is the furthest point) share an angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sim.elementary import atan2, dot, unit
from sim.geometry.polygons import convex_hull
from sim.types import Array, Groups, Ints

__all__ = ["box_groups", "footprint_hulls", "groups_over_time", "member_rows"]


def groups_over_time(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, first: int, length: int, px_per_m: float = 1.0
) -> list[Groups]:
    """Returns the Groups of each of the frames first … first + length - 1: groups of two or more, sorted by id.

    frame, id, group (R,): one row per person and frame, in any order; group -1 = alone. pos, vel (R, D): on the ground
    m and m/s. In the image they are px and px/s, and px_per_m is the scale by which the discs round the members are
    drawn. Results are in the same units. extent is the covariance of x and y.
    """
    order, starts = member_rows(frame, id, group)
    hulls = footprint_hulls(pos[order, :2] / px_per_m, np.diff(np.append(starts, len(order))))
    rows = frame[order], id[order], group[order], pos[order], vel[order]
    return _assemble(*rows, starts, [h * px_per_m for h in hulls], first, length)


def box_groups(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, box: Array, first: int, length: int
) -> list[Groups]:
    """Returns the Groups in the image of each of the frames first … first + length - 1; hulls are those of boxes.

    Like `groups_over_time`, but each hull encloses the members' boxes. pos, vel (R, 2): px, px/s. box (R, 4): left,
    top, width, height, px.
    """
    order, starts = member_rows(frame, id, group)
    low, high = box[:, :2], box[:, :2] + box[:, 2:]
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)
    ends = np.append(starts, len(order))
    hulls = [convex_hull(corners[order[a:b]].reshape(-1, 2)) for a, b in pairwise(ends)]
    rows = frame[order], id[order], group[order], pos[order], vel[order]
    return _assemble(*rows, starts, hulls, first, length)


def member_rows(frame: Ints, id: Ints, group: Ints) -> tuple[Ints, Ints]:
    """Returns the indices (M,) of the rows of people who are in a group of two or more, and where each group begins.

    The indices are sorted by frame, group, id. The second array has the position in them of each group's first member
    in each frame. frame, id, group (R,): one row per person and frame; group -1 = alone.
    """
    rows = np.lexsort((id, group, frame))
    rows = rows[group[rows] >= 0]
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    number = np.cumsum(new) - 1
    rows = rows[np.bincount(number)[number] > 1] if len(rows) else rows
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    return rows, np.flatnonzero(new)


def _assemble(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, starts: Ints, hulls: Sequence[Array], first: int,
    length: int,
) -> list[Groups]:  # fmt: skip
    counts = np.diff(np.append(starts, len(id)))
    if not len(starts):
        return [Groups.none()] * length
    middle = np.add.reduceat(pos, starts) / counts[:, None]
    speed = np.add.reduceat(vel, starts) / counts[:, None]
    arm = (pos - np.repeat(middle, counts, axis=0))[:, :2]
    extent = np.add.reduceat(arm[:, :, None] * arm[:, None], starts) / counts[:, None, None]
    members = [id[a:b] for a, b in pairwise([*starts.tolist(), len(id)])]
    cuts = np.searchsorted(frame[starts], np.arange(first, first + length + 1))
    name = group[starts]
    size, nobody = counts.astype(float), Groups.none()
    return [
        Groups(name[a:b], tuple(members[a:b]), middle[a:b], speed[a:b], extent[a:b], size[a:b], tuple(hulls[a:b]))
        if a < b
        else nobody
        for a, b in pairwise(cuts.tolist())
    ]


FOOTPRINT_RADIUS = 0.25  # m: of the disc round a member
FOOTPRINT_SIDES = 16
STEP = 2 * np.pi / FOOTPRINT_SIDES  # rad: width of the normal cone of each footprint vertex
FOOTPRINT = FOOTPRINT_RADIUS * unit(STEP * np.arange(FOOTPRINT_SIDES))  # (16, 2) m, counter-clockwise
CONES = STEP * (np.arange(FOOTPRINT_SIDES) - 0.5)  # rad: the angle at which each vertex's normal cone begins
GROUPS = 512  # groups per pass
FLAT = 1e-9  # rad: a narrower cone is a rounding error, and its vertex lies on an edge


def footprint_hulls(pos: Array, count: Ints) -> list[Array]:
    """Returns the hull (V, 2) of the footprints of each group, counter-clockwise.

    pos (R, 2) m: the members of group 0, then those of group 1, …; count (G,): how many each has. No position may be
    nan. A group without members gets a hull with V = 0.
    """
    hulls: list[Array] = [np.zeros((0, 2))] * len(count)
    first = np.cumsum(count) - count
    # Groups of equal size n together, up to GROUPS of them.
    for n in np.unique(count[count > 0]):
        every = np.flatnonzero(count == n)
        for low in range(0, len(every), GROUPS):
            groups = every[low : low + GROUPS]
            sums = _minkowski_sums(*_gift_wrap(pos[first[groups, None] + np.arange(n)]))
            for group, hull in zip(groups, sums, strict=True):
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
