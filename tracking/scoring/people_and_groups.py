"""People and groups of the truth or of a tracker as rows of arrays, all frames together.

`true_people`, `tracked_people` and `group_rows` build the rows from `Truth`, `Tracks` and `Groups`. `people_inside`
finds the members of groups that are reported as hulls only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sim.geometry.polygons import edge_distance_pairs, gap_pairs, pack, pack_padded
from sim.types import Array, Bools, Groups, Ints, Tracks, Truth
from tracking.scoring.candidate_pairs import compare
from tracking.scoring.rows import FrameRows, find_rows

Surface = Literal["ground", "image"]  # Where groups are compared: on the ground in m, or in the image in px.

INSIDE = 0.3  # m: a person at most this far from a hull is a member, where a tracker names no members


@dataclass(frozen=True, slots=True, eq=False)
class PersonRows:
    """R rows, one per person and frame, sorted by frame."""

    rows: FrameRows  # frame number and id of each row
    group: Ints  # (R,): group id, -1 alone
    # pos (R, 2), vel (R, 2): x, y of position and velocity in the plane of this side's data, m and m/s or px and px/s.
    # nan unknown.
    pos: Array | None
    vel: Array | None
    box: Array | None  # (R, 4): left, top, width, height in px.

    def keep(self, mask: Bools | slice) -> PersonRows:
        """Returns the rows that a bool mask (R,) or a slice selects, with all their columns."""
        pos, vel, box = (None if a is None else a[mask] for a in (self.pos, self.vel, self.box))
        return PersonRows(self.rows.keep(mask), self.group[mask], pos, vel, box)

    def positions_on(self, surface: Surface, plane: str) -> Array | None:
        """Returns the positions (R, 2) on a surface, in m on the "ground" or px in the "image"; None if unknown there.
        plane: the plane of `pos`. In the image the centre of the box is preferred to `pos`."""
        if surface == "image" and self.box is not None:
            return self.box[:, :2] + self.box[:, 2:] / 2
        own = "image" if plane == "image" else "ground"
        return self.pos if own == surface else None


@dataclass(frozen=True, slots=True, eq=False)
class GroupRows:
    """G rows, one per group and frame, sorted by frame, and K memberships; len() gives G."""

    rows: FrameRows  # frame number and id of each group row
    pos: Array  # (G, 2): centre x, y. nan unknown.
    hull: tuple[Array, ...]  # G convex polygons (V, 2) round the members, counter-clockwise; (0, 2) unknown
    # of (K,), member (K,): membership k says that the person in row member[k] (-1: not among the people) belongs to the
    # group in row of[k]. pos and hull are in m on the ground, in px in the image.
    of: Ints
    member: Ints

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def count(self) -> Ints:
        """Number of memberships of each group, (G,)."""
        return np.bincount(self.of, minlength=len(self)).astype(np.int64)

    def keep(self, mask: Bools) -> GroupRows:
        """Returns the groups where the mask (G,) is true, with their memberships, `of` renumbered."""
        place, kept = np.cumsum(mask) - 1, mask[self.of]
        return GroupRows(
            self.rows.keep(mask), self.pos[mask],
            tuple(h for h, k in zip(self.hull, mask.tolist(), strict=True) if k),
            place[self.of[kept]], self.member[kept],
        )  # fmt: skip


def true_people(truth: Truth, frames: Bools) -> PersonRows:
    """Returns the truth's people in the frames f where frames[f] is true, sorted by frame."""
    every = PersonRows(FrameRows(truth.frame, truth.id), truth.group, truth.pos, truth.vel, truth.box)
    return every.keep(frames[truth.frame])


def tracked_people(tracks: Sequence[Tracks]) -> PersonRows:
    """Returns one tracker's people as rows; `tracks` are sorted by frame. `box` of the result is None if in any frame
    with people the boxes are missing."""
    count = [len(t.id) for t in tracks]
    frame = np.repeat(np.array([t.index for t in tracks], np.int64), count)
    none = np.zeros(0, np.int64)
    id, group = (np.concatenate([none, *(getattr(t, name) for t in tracks)]) for name in ("id", "group"))
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in tracks)]) for name in ("pos", "vel")
    )
    boxes = [t.box for t in tracks if len(t.id)]
    boxed = [b for b in boxes if b is not None]
    box = np.concatenate([np.zeros((0, 4)), *boxed]) if len(boxed) == len(boxes) else None
    return PersonRows(FrameRows(frame, id), group, pos, vel, box)


def group_rows(frames: Ints, groups: Sequence[Groups], people: FrameRows) -> GroupRows:
    """Returns the groups of F frames as rows; frames (F,) gives the frame number of each element of `groups`. The
    members become row indices of `people`, -1 for a member who has no row there."""
    count = [len(g.id) for g in groups]
    none = np.zeros(0, np.int64)
    rows = FrameRows(np.repeat(frames, count), np.concatenate([none, *(g.id for g in groups)]))
    members = [m for g in groups for m in (g.members if len(g.members) else (none,) * len(g.id))]
    of = np.repeat(np.arange(len(rows)), [len(m) for m in members])
    member = find_rows(people, FrameRows(rows.frame[of], np.concatenate([none, *members])))
    return GroupRows(
        rows,
        np.concatenate([np.zeros((0, 2)), *(g.pos[:, :2] for g in groups)]),
        tuple(h for g in groups for h in (g.hull or (np.zeros((0, 2)),) * len(g.id))),
        of,
        member,
    )


@dataclass(frozen=True, slots=True, eq=False)
class TrueGroups:
    """The truth's groups of two or more people in labelled frames, on one surface ("ground" or "image")."""

    groups: GroupRows  # the groups, members as rows of the true people
    # True if the truth has group shapes on the surface. Otherwise all centres are nan, and hulls and extents belong to
    # the other surface.
    comparable: bool

    def in_frames(self, frames: Bools, people: Bools) -> TrueGroups:
        """Returns the groups of the frames f where frames[f] is true. people (R,), bool: which true people are kept;
        members become row indices of the kept ones."""
        groups = self.groups.keep(frames[self.groups.rows.frame])
        number = np.append(np.cumsum(people) - 1, -1)  # the last element keeps -1, an unknown member
        return TrueGroups(replace(groups, member=number[groups.member]), self.comparable)


def true_groups(truth: Truth, labelled: Bools, people: FrameRows, surface: Surface) -> TrueGroups:
    """Returns the truth's groups of two or more members in the labelled frames, on a surface.

    If the truth has groups on the other surface only, these are returned with centres of nan. labelled (length + 1,) is
    bool by frame number; people are all true people, whose row indices become the members.
    """
    wanted, other = truth.groups, truth.groups_px
    if surface == "image":
        wanted, other = other, wanted
    groups = other if wanted is None else wanted
    assert groups is not None, "a labelled frame has groups on some surface"
    index = np.flatnonzero(labelled)
    found = group_rows(index, [groups[f - 1] for f in index.tolist()], people)
    found = found.keep(found.count > 1)
    if wanted is None:
        found = replace(found, pos=np.full_like(found.pos, np.nan))
    return TrueGroups(found, wanted is not None)


def people_inside(groups: GroupRows, people: FrameRows, positions: Array, scale: float) -> GroupRows:
    """Returns the groups with new members: the people inside the hull or at most 0.3 m outside, in the same frame.
    positions (R, 2): of the R people, in the unit of the hulls. scale: units per metre, as px_per_m in the image."""
    hulls, points = pack(groups.hull), pack_padded(positions[:, None])
    low, high = hulls.box[:, :2] - INSIDE * scale, hulls.box[:, 2:] + INSIDE * scale

    def inside(i: Ints, j: Ints) -> tuple[Ints, Array]:
        near = np.flatnonzero((positions[j] >= low[i]).all(axis=1) & (positions[j] <= high[i]).all(axis=1))
        i, j = i[near], j[near]
        gap = gap_pairs(hulls, points, i, j)
        flat = hulls.area[i] <= 0  # a hull of one or two vertices contains no point: only distance counts
        gap[flat] = edge_distance_pairs(hulls, points, i[flat], j[flat])
        kept = near[gap <= INSIDE * scale]
        return kept, np.ones(len(kept))

    members = compare(groups.rows, people, inside)
    return replace(groups, of=members.i, member=members.j)
