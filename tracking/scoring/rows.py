"""Both sides of a comparison as rows: people and groups, of the truth and of a tracker, all frames at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from sim.geometry.polygons import edge_distance_pairs, gap_pairs, pack, pack_padded
from sim.types import Array, Bools, Groups, Ints, Tracks, Truth
from tracking.scoring.similarity import Rows, compare, numbered

Surface = Literal["ground", "image"]
"""What group shapes are compared on: metres on the ground, or px."""

INSIDE = 0.3  # m: a person so near a hull is in it, where a method names no members


@dataclass(frozen=True, slots=True, eq=False)
class People:
    """R people in frames: group (R,) -1 alone; pos, vel (R, 2) in the side's own plane and box (R, 4), or None."""

    rows: Rows
    group: Ints
    pos: Array | None
    vel: Array | None
    box: Array | None

    def places(self, surface: Surface, plane: str) -> Array | None:
        """(R, 2) on the ground or in the image (middles of the boxes, else of what is followed there), or None.

        plane: what `pos` is in.
        """
        if surface == "image" and self.box is not None:
            return self.box[:, :2] + self.box[:, 2:] / 2
        own = "image" if plane == "image" else "ground"
        return self.pos if own == surface else None


@dataclass(frozen=True, slots=True, eq=False)
class Crowd:
    """G groups in frames, sorted by frame: pos (G, 2), size (G,), extent (G, 2, 2), hull: polygons.

    Members are K pairs: of (K,) the group's row, who (K,) the member's row among the people, -1 if not among them.
    """

    rows: Rows
    pos: Array
    size: Array
    extent: Array
    hull: tuple[Array, ...]
    of: Ints
    who: Ints

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def count(self) -> Ints:
        """Members of each group (G,)."""
        return np.bincount(self.of, minlength=len(self)).astype(np.int64)

    def keep(self, mask: Bools) -> Crowd:
        """The groups where mask (G,) is true."""
        place, kept = np.cumsum(mask) - 1, mask[self.of]
        return Crowd(
            self.rows.keep(mask), self.pos[mask], self.size[mask], self.extent[mask],
            tuple(h for h, k in zip(self.hull, mask.tolist(), strict=True) if k),
            place[self.of[kept]], self.who[kept],
        )  # fmt: skip


def true_people(truth: Truth, inside: Bools) -> People:
    """The truth's people in the frames f with inside[f]."""
    kept = inside[truth.frame]
    rows = Rows(truth.frame[kept], truth.id[kept])
    pos, vel, box = (None if a is None else a[kept] for a in (truth.pos, truth.vel, truth.box))
    return People(rows, truth.group[kept], pos, vel, box)


def tracked_people(answers: Sequence[Tracks]) -> People:
    """A tracker's people; answers sorted by frame. Boxes only where every answer with people has them."""
    count = [len(t.id) for t in answers]
    frame = np.repeat(np.array([t.index for t in answers], np.int64), count)
    none = np.zeros(0, np.int64)
    id, group = (np.concatenate([none, *(getattr(t, name) for t in answers)]) for name in ("id", "group"))
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in answers)]) for name in ("pos", "vel")
    )
    boxes = [t.box for t in answers if len(t.id)]
    boxed = [b for b in boxes if b is not None]
    box = np.concatenate([np.zeros((0, 4)), *boxed]) if len(boxed) == len(boxes) else None
    return People(Rows(frame, id), group, pos, vel, box)


def crowd(frames: Ints, groups: Sequence[Groups], people: Rows) -> Crowd:
    """The groups of frames (F,), one Groups each; people: the rows in which members are looked up."""
    count = [len(g.id) for g in groups]
    none = np.zeros(0, np.int64)
    rows = Rows(np.repeat(frames, count), np.concatenate([none, *(g.id for g in groups)]))
    members = [m for g in groups for m in (g.members if len(g.members) else (none,) * len(g.id))]
    of = np.repeat(np.arange(len(rows)), [len(m) for m in members])
    who = find(people, Rows(rows.frame[of], np.concatenate([none, *members])))
    return Crowd(
        rows,
        np.concatenate([np.zeros((0, 2)), *(g.pos[:, :2] for g in groups)]),
        np.concatenate([np.zeros(0), *(g.size for g in groups)]),
        np.concatenate([np.zeros((0, 2, 2)), *(g.extent for g in groups)]),
        tuple(h for g in groups for h in (g.hull if len(g.hull) else (np.zeros((0, 2)),) * len(g.id))),
        of,
        who,
    )


def find(rows: Rows, wanted: Rows) -> Ints:
    """The row of each wanted (frame, id), -1 where there is none."""
    if not len(rows):
        return np.full(len(wanted), -1, np.int64)
    ids, place = numbered(rows.id)
    key = rows.frame * len(ids) + place
    order = np.argsort(key, kind="stable")
    at = np.minimum(np.searchsorted(ids, wanted.id), len(ids) - 1)
    sought = wanted.frame * len(ids) + at
    found = order[np.minimum(np.searchsorted(key[order], sought), len(order) - 1)]
    same = (rows.frame[found] == wanted.frame) & (rows.id[found] == wanted.id)
    return np.where(same, found, -1)


def people_inside(groups: Crowd, people: Rows, places: Array, scale: float) -> Crowd:
    """The groups with those people for members whose places (R, 2) lie in their hulls or within 0.3 m (times scale)."""
    hulls, points = pack(groups.hull), pack_padded(places[:, None])
    low, high = hulls.box[:, :2] - INSIDE * scale, hulls.box[:, 2:] + INSIDE * scale

    def inside(i: Ints, j: Ints) -> tuple[Ints, Array]:
        near = np.flatnonzero((places[j] >= low[i]).all(axis=1) & (places[j] <= high[i]).all(axis=1))
        i, j = i[near], j[near]
        flat = hulls.area[i] <= 0  # two vertices or one: nothing can be inside, only near
        gap = np.where(flat, edge_distance_pairs(hulls, points, i, j), gap_pairs(hulls, points, i, j))
        kept = near[gap <= INSIDE * scale]
        return kept, np.ones(len(kept))

    members = compare(groups.rows, people, inside)
    return replace(groups, of=members.i, who=members.j)
