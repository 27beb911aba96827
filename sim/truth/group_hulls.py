"""Groups over time: the truth measured from motion and intent, and the shape of groups for anybody's people.

sim.truth.group_membership says who is together when, sim.truth.identity which group is which; here both become labels,
events and hulls.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sim.geometry.footprints import footprint_hulls
from sim.geometry.polygons import convex_hull
from sim.types import Array, Groups, Ints


def frame_groups(id: Ints, group: Ints, pos: Array, vel: Array) -> Groups:
    """The groups (2 or more people) of one frame: people id (N,), group (N,) -1 alone, pos, vel (N, 2 or 3) in m.

    hull: of the members' footprints on the ground; pos, vel: means; extent: covariance of the places (over n).
    """
    return groups_over_time(np.zeros(len(id), np.int64), id, group, pos, vel, 0, 1)[0]


def groups_over_time(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, first: int, length: int, px_per_m: float = 1.0
) -> list[Groups]:
    """`frame_groups` of frames first … first + length - 1, from rows sorted by frame. In px with px_per_m other than 1:
    footprints are then discs round the places in the image."""
    rows, starts = _sorted_groups(frame, id, group)
    counts = np.diff(np.append(starts, len(rows)))
    hulls = footprint_hulls(pos[rows, :2] / px_per_m, counts)
    return _assemble(frame, id, group, pos, vel, rows, starts, [h * px_per_m for h in hulls], first, length)


def box_groups(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, box: Array, first: int, length: int
) -> list[Groups]:
    """Like `groups_over_time`, in the image: hulls of the members' boxes (R, 4) ltwh."""
    rows, starts = _sorted_groups(frame, id, group)
    low, high = box[:, :2], box[:, :2] + box[:, 2:]
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)
    ends = np.append(starts, len(rows))
    hulls = [convex_hull(corners[rows[a:b]].reshape(-1, 2)) for a, b in pairwise(ends)]
    return _assemble(frame, id, group, pos, vel, rows, starts, hulls, first, length)


def _sorted_groups(frame: Ints, id: Ints, group: Ints) -> tuple[Ints, Ints]:
    """Rows of people in groups of 2 or more, sorted by (frame, group, id), and where each group starts among them."""
    rows = np.lexsort((id, group, frame))
    rows = rows[group[rows] >= 0]
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    number = np.cumsum(new) - 1
    rows = rows[np.bincount(number)[number] > 1] if len(rows) else rows
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    return rows, np.flatnonzero(new)


def _assemble(
    frame: Ints,
    id: Ints,
    group: Ints,
    pos: Array,
    vel: Array,
    rows: Ints,
    starts: Ints,
    hulls: Sequence[Array],
    first: int,
    length: int,
) -> list[Groups]:
    if not len(starts):
        return [Groups.none()] * length
    counts = np.diff(np.append(starts, len(rows)))
    middle = np.add.reduceat(pos[rows], starts) / counts[:, None]
    speed = np.add.reduceat(vel[rows], starts) / counts[:, None]
    arm = (pos[rows] - np.repeat(middle, counts, axis=0))[:, :2]
    extent = np.add.reduceat(arm[:, :, None] * arm[:, None], starts) / counts[:, None, None]
    people = id[rows]
    members = [people[a:b] for a, b in pairwise([*starts.tolist(), len(rows)])]
    cuts = np.searchsorted(frame[rows[starts]], np.arange(first, first + length + 1))
    name = group[rows[starts]]
    size = counts.astype(float)
    return [
        Groups(name[a:b], tuple(members[a:b]), middle[a:b], speed[a:b], extent[a:b], size[a:b], tuple(hulls[a:b]))
        if a < b
        else Groups.none()
        for a, b in pairwise(cuts)
    ]
