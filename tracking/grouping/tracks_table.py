"""All tracks of a sequence as one table of rows, in metres: the input of the grouping rule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import InputError
from sim.truth.motion_rows import MotionRows
from sim.truth.velocities import chords
from sim.types import Array, Bools, Ints, Tracks


@dataclass(frozen=True, slots=True, eq=False)
class TracksTable:
    """All person tracks of a sequence as R rows, one per track and frame, sorted by frame, then id; lengths in m."""

    frame: Ints  # (R,): from 0
    id: Ints  # (R,): of the track
    column: Ints  # (R,): index of the id in `ids`
    ids: Ints  # (P,): sorted
    pos: Array
    vel: Array  # (R, 2): m/s, nan if unknown
    group: Ints  # (R,): the tracker's own group id, -1 for a person alone
    length: int  # frames T of the sequence, the number of the last
    scale: float  # px per m by which pos and vel were divided if the tracks are in the image, else 1
    seen: Bools | None = None  # (R,): False where a person is reported by prediction only; None: all are seen

    def motion(self) -> MotionRows:
        """Returns the rows of known position, sorted by person, then frame."""
        return MotionRows.of(self.frame, self.column, self.pos, self.vel, self.group, self.length)

    def measured_motion(self) -> MotionRows | None:
        """Returns the rows of `motion` in which people are measured; all rows of people who never are. None: `motion`
        itself, as everybody is measured always."""
        if self.seen is None or self.seen.all():
            return None
        known = self.seen | ~np.isin(self.column, self.column[self.seen])
        return replace(self, pos=np.where(known[:, None], self.pos, np.nan)).motion()


def tabulate(tracks: Sequence[Tracks], fps: float, px_per_m: float) -> TracksTable:
    """Returns the table of a sequence's person tracks, one `Tracks` per frame, at least one.

    Unknown velocities are replaced by mean velocities over the last 0.5 s. Raises InputError if the tracks are in the
    image and px_per_m is not a finite number above 0.
    """
    scale = px_per_m if tracks[0].plane == "image" else 1.0
    if not math.isfinite(scale) or scale <= 0:
        raise InputError(
            place="px_per_m", got=f"{scale}", expected="a number above 0", remedy="give --px-per-m: tracks are in px"
        )
    count = [len(t.id) for t in tracks]
    frame = np.repeat(np.array([t.index for t in tracks], np.int64) - 1, count)
    id, group = np.concatenate([t.id for t in tracks]), np.concatenate(_named_groups(tracks))
    pos, vel = (np.concatenate([getattr(t, name)[:, :2] for t in tracks]) / scale for name in ("pos", "vel"))
    seen = np.concatenate([t.measured for t in tracks])
    order = np.lexsort((id, frame))
    seen = seen[order]
    frame, id, group, pos, vel = frame[order], id[order], group[order], pos[order], vel[order]
    ids, column = np.unique(id, return_inverse=True)
    length = int(max(t.index for t in tracks))
    unknown: Bools = np.asarray(np.isnan(vel).any(axis=1))
    if unknown.any():
        vel = np.where(unknown[:, None], chords(frame, id, pos, fps), vel)
    return TracksTable(frame, id, column, ids, pos, vel, group, length, scale, seen)


def _named_groups(tracks: Sequence[Tracks]) -> list[Ints]:
    """Returns for each frame the group that the tracker names of each track, in `group` or by members of `groups`."""
    found = []
    for t in tracks:
        members = () if t.groups is None else zip(t.groups.id.tolist(), t.groups.members, strict=False)
        group_of = {p: g for g, people in members for p in people.tolist()}
        listed = np.array([group_of.get(p, -1) for p in t.id.tolist()], np.int64) if group_of else t.group
        # a tracker may name groups by members only; of several that list a person the last counts
        found.append(np.where(t.group >= 0, t.group, listed))
    return found
