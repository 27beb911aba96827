"""Hulls, mean positions and extents (covariances of positions) of groups in each frame.

They are computed from positions of people whose group ids are known, of the truth or of a tracker's tracks. On the
ground a hull encloses discs of 0.25 m round the members, in the image their boxes or such discs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sim.geometry.polygons import convex_hull, footprint_hulls
from sim.types import Array, Groups, Ints

__all__ = ["box_groups", "groups_over_time"]


@dataclass(frozen=True, eq=False)
class _MemberRows:
    """R rows, one for each person in a group of two or more in one frame, sorted by (frame, group, id)."""

    # frame, id, group (R,): frame number, person id, group id
    frame: Ints
    id: Ints
    group: Ints
    # pos, vel (R, D): position and velocity, in the caller's unit
    pos: Array
    vel: Array
    starts: Ints  # (S,) index of the first row of each group in each frame

    @property
    def counts(self) -> Ints:
        """The number of members of each group in each frame (S,)."""
        return np.diff(np.append(self.starts, len(self.id)))


def groups_over_time(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, first: int, length: int, px_per_m: float = 1.0
) -> list[Groups]:
    """Returns the Groups, of two or more people, of each of the frames first … first + length - 1, by ascending id.

    frame, id, group (R,): people in frames, in any order, group -1 = alone. pos, vel (R, D): m, m/s, or px with a
    px_per_m, the scale of the footprints; results are in the same unit. extent is the covariance of x and y.
    """
    rows, order = _member_rows(frame, id, group, pos, vel)
    hulls = footprint_hulls(pos[order, :2] / px_per_m, rows.counts)
    return _assemble(rows, [h * px_per_m for h in hulls], first, length)


def box_groups(
    frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array, box: Array, first: int, length: int
) -> list[Groups]:
    """Returns the Groups in the image of each of the frames first … first + length - 1; hulls are those of boxes.

    As `groups_over_time`; pos, vel (R, 2): px, px/s. box (R, 4): left, top, width, height, px.
    """
    rows, order = _member_rows(frame, id, group, pos, vel)
    low, high = box[:, :2], box[:, :2] + box[:, 2:]
    corners = np.stack([low, np.stack([high[:, 0], low[:, 1]], 1), high, np.stack([low[:, 0], high[:, 1]], 1)], 1)
    ends = np.append(rows.starts, len(order))
    hulls = [convex_hull(corners[order[a:b]].reshape(-1, 2)) for a, b in pairwise(ends)]
    return _assemble(rows, hulls, first, length)


def _member_rows(frame: Ints, id: Ints, group: Ints, pos: Array, vel: Array) -> tuple[_MemberRows, Ints]:
    """Returns the rows of people in groups of two or more in one frame, and their indices in the given arrays."""
    rows = np.lexsort((id, group, frame))
    rows = rows[group[rows] >= 0]
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    number = np.cumsum(new) - 1
    rows = rows[np.bincount(number)[number] > 1] if len(rows) else rows
    new = (np.diff(frame[rows], prepend=-1) != 0) | (np.diff(group[rows], prepend=-1) != 0)
    return _MemberRows(frame[rows], id[rows], group[rows], pos[rows], vel[rows], np.flatnonzero(new)), rows


def _assemble(rows: _MemberRows, hulls: Sequence[Array], first: int, length: int) -> list[Groups]:
    starts, counts = rows.starts, rows.counts
    if not len(starts):
        return [Groups.none()] * length
    middle = np.add.reduceat(rows.pos, starts) / counts[:, None]
    speed = np.add.reduceat(rows.vel, starts) / counts[:, None]
    arm = (rows.pos - np.repeat(middle, counts, axis=0))[:, :2]
    extent = np.add.reduceat(arm[:, :, None] * arm[:, None], starts) / counts[:, None, None]
    members = [rows.id[a:b] for a, b in pairwise([*starts.tolist(), len(rows.id)])]
    cuts = np.searchsorted(rows.frame[starts], np.arange(first, first + length + 1))
    name = rows.group[starts]
    size, nobody = counts.astype(float), Groups.none()
    return [
        Groups(name[a:b], tuple(members[a:b]), middle[a:b], speed[a:b], extent[a:b], size[a:b], tuple(hulls[a:b]))
        if a < b
        else nobody
        for a, b in pairwise(cuts.tolist())
    ]
