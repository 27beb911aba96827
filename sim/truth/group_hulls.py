"""Hulls, mean positions and extents (covariances of positions) of groups in each frame.

They are computed from positions of people whose group ids are known, of the truth or of a tracker's tracks. On the
ground a hull encloses discs of 0.25 m round the members, in the image their boxes or such discs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from sim.arrays import read_only
from sim.geometry.polygons import footprint_hulls
from sim.types import Array, Groups, Ints

Hulls = Callable[[Ints, Ints], Sequence[Array]]


def groups_over_time(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, first: int, length: int, px_per_m: float = 1.0, *,
    shapes: bool = True,
) -> list[Groups]:  # fmt: skip
    """Returns the Groups of each of the frames first … first + length - 1: groups of two or more, sorted by id.

    frame, id, group (R,): one row per person and frame, in any order; group -1 = alone. pos, vel (R, D): on the ground
    m and m/s. In the image they are px and px/s, and px_per_m is the scale by which the discs round the members are
    drawn. Results are in the same units. extent is the covariance of x and y. shapes: False leaves the hulls out.
    """

    def hulls(rows: Ints, starts: Ints) -> list[Array]:
        around = footprint_hulls(pos[rows, :2] / px_per_m, np.diff(np.append(starts, len(rows))))
        return [h * px_per_m for h in around]

    return groups_in_hulls(frame, id, group, pos, vel, hulls if shapes else None, first, length)


def box_groups(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, box: Array, first: int, length: int, *,
    shapes: bool = True,
) -> list[Groups]:  # fmt: skip
    """Returns the Groups in the image of each of the frames first … first + length - 1; hulls are those of boxes.

    Like `groups_over_time`, but each hull encloses the members' boxes. pos, vel (R, 2): px, px/s. box (R, 4): left,
    top, width, height, px.
    """
    from sim.geometry.hull_kernels import convex_hulls

    low, high = box[:, :2], box[:, :2] + box[:, 2:]
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)

    def hulls(rows: Ints, starts: Ints) -> Sequence[Array]:
        return convex_hulls([part.reshape(-1, 2) for part in np.split(corners[rows], starts[1:])])

    return groups_in_hulls(frame, id, group, pos, vel, hulls if shapes else None, first, length)


def member_rows(frame: Ints, id: Ints, group: Ints) -> tuple[Ints, Ints]:
    """Returns the indices (M,) of the rows of people who are in a group of two or more, and where each group begins.

    The indices are sorted by frame, group, id. The second array has the position in them of each group's first member
    in each frame. frame, id, group (R,): one row per person and frame; group -1 = alone.
    """
    rows = np.lexsort((id, group, frame))
    rows = rows[group[rows] >= 0]
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    number = np.cumsum(new) - 1
    several = np.bincount(number)[number] > 1
    return rows[several], np.flatnonzero(new[several])


def groups_in_hulls(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, hulls: Hulls | None, first: int, length: int
) -> list[Groups]:
    """Returns the Groups of each of the frames first … first + length - 1, with any hulls.

    Like `groups_over_time`. hulls: takes the results of `member_rows`, and returns the hull of each group; None if
    hulls are unknown.
    """
    rows, starts = member_rows(frame, id, group)
    if not len(starts):
        return [Groups.none()] * length
    counts = np.diff(np.append(starts, len(rows)))
    around = () if hulls is None else tuple(read_only(hull) for hull in hulls(rows, starts))
    ids = read_only(id[rows])
    members = tuple(ids[a:b] for a, b in pairwise([*starts.tolist(), len(ids)]))
    middle, speed = (np.add.reduceat(values[rows], starts) / counts[:, None] for values in (pos, vel))
    arm = (pos[rows] - np.repeat(middle, counts, axis=0))[:, :2]
    extent = np.add.reduceat(arm[:, :, None] * arm[:, None], starts) / counts[:, None, None]
    cuts = np.searchsorted(frame[rows[starts]], np.arange(first, first + length + 1))
    columns = map(read_only, (group[rows[starts]], middle, speed, extent, counts.astype(float)))
    (name, middle, speed, extent, size), nobody = columns, Groups.none()
    return [
        Groups.of_settled(name[a:b], members[a:b], middle[a:b], speed[a:b], extent[a:b], size[a:b], around[a:b])
        if a < b
        else nobody
        for a, b in pairwise(cuts.tolist())
    ]
