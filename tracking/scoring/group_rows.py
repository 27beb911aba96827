"""The groups of the truth and of a tracker as rows of arrays, all frames together, and which people are their members.

`true_groups` and `tracked_groups` build the rows. Members of a group that is reported as a hull only are the people
inside the hull.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sim.geometry.polygons import edge_distance_pairs, gap_pairs, pack, pack_padded
from sim.types import Array, Bools, Groups, Ints, Truth
from tracking.scoring.people import ComparedSides, Surface
from tracking.scoring.rows import FrameRows, find_rows, span
from tracking.scoring.similarity import compare

INSIDE = 0.3  # m: a person at most this far from a hull is a member, where a tracker names no members


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

    def part(self, rows: slice) -> GroupRows:
        """Returns the groups in a slice of the rows, from `start` to `stop`, with their memberships."""
        first, end = np.searchsorted(self.of, (rows.start, rows.stop)).tolist()  # `of` ascends
        own = slice(first, end)
        return GroupRows(
            self.rows.keep(rows), self.pos[rows], self.hull[rows], self.of[own] - rows.start, self.member[own]
        )


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

    def in_frames(self, frames: Bools, people: FrameRows) -> TrueGroups:
        """Returns the groups of the frames f where frames[f] is true. people: all true people; members become row
        indices of those in these frames."""
        groups, here = self.groups.part(span(self.groups.rows.frame, frames)), span(people.frame, frames)
        groups = groups.keep(frames[groups.rows.frame])
        number = np.append(np.cumsum(frames[people.frame[here]]) - 1, -1)  # the last keeps -1, an unknown member
        member = np.where(groups.member < 0, -1, groups.member - here.start)
        return TrueGroups(replace(groups, member=number[member]), self.comparable)


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


@dataclass(frozen=True, eq=False)
class TrackedGroups:
    """One tracker's groups in the labelled frames."""

    # all groups; memberships hold rows of the true people. Members mapped to nobody are left out. If the tracker names
    # no members, they are the true people inside the hull.
    every: GroupRows
    # the groups that are scored. Members are rows of the tracked people if the tracker names members, else rows of the
    # true people inside the hull.
    counted: GroupRows
    person: Ints  # (K,): for each of the K memberships of `counted`, the row of the true person, -1 none
    named: bool  # True if the tracker names members, or follows people and has no groups
    known: bool = True  # False if the tracker names no members, and who is inside its hulls is unknown


def tracked_groups(sides: ComparedSides) -> TrackedGroups:
    """Returns the tracker's groups in labelled frames, and which of them are scored.

    If the tracker names members, its groups of two or more members are scored. Otherwise the members of a group are the
    true people inside its hull or at most 0.3 m outside. Then a hull with exactly one person is not scored; a hull with
    nobody is scored, as a false group.
    """
    tracks = [t for t in sides.tracks if sides.frames[t.index]]
    frames = np.array([t.index for t in tracks], np.int64)
    every = group_rows(frames, [t.groups or Groups.none() for t in tracks], sides.est.rows)
    wholes = any(t.unit == "group" for t in tracks)
    if wholes or not len(every.of):
        positions = sides.true.positions_on(sides.surface, "ground")
        known = positions is not None and bool(np.isfinite(sides.scale))
        if positions is not None and known:
            every = people_inside(every, sides.true.rows, positions, sides.scale)
        # a person alone is no group; a hull with nobody inside is a false one
        counted = every.keep(every.count != 1)
        return TrackedGroups(every, counted, counted.member, not (wholes or len(every)), known or not len(every))
    counted = every.keep(every.count > 1)
    person = _true_rows(every, sides.mapping)
    mapped = replace(every, of=every.of[person >= 0], member=person[person >= 0])
    return TrackedGroups(mapped, counted, _true_rows(counted, sides.mapping), named=True)


def _true_rows(groups: GroupRows, mapping: Ints) -> Ints:
    return np.where(groups.member >= 0, np.append(mapping, -1)[groups.member], -1)
