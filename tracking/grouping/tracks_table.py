"""All tracks of a sequence as one table of rows, in metres: the input of the grouping rule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.truth.velocities import chords
from sim.types import Array, Bools, Ints, Tracks
from tracking.grouping.motion_history import PeopleRows


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


def tabulate(tracks: Sequence[Tracks], fps: float, px_per_m: float, places: Array | None = None) -> TracksTable:
    """Returns the table of a sequence's person tracks, one `Tracks` per frame, at least one.

    Unknown velocities are replaced by mean velocities over the last 0.5 s. places (R, 2): points on the ground, m, in
    place of the positions of all rows; velocities are then unknown. Raises InputError if the tracks are in the
    image and px_per_m is not a finite number above 0.
    """
    scale = px_per_m if tracks[0].plane == "image" and places is None else 1.0
    rows = people_rows(tracks, scale, places)
    ids, column = np.unique(rows.id, return_inverse=True)
    vel, unknown = rows.vel, np.asarray(np.isnan(rows.vel).any(axis=1))
    if unknown.any():
        vel = np.where(unknown[:, None], chords(rows.frame, rows.id, rows.pos, fps), vel)
    length = int(max(t.index for t in tracks))
    return TracksTable(rows.frame, rows.id, column, ids, rows.pos, vel, rows.group, length, scale, rows.seen)


def people_rows(tracks: Sequence[Tracks], scale: float, places: Array | None) -> PeopleRows:
    """Returns the rows of people of some frames, divided by `scale`; places: as of `tabulate`. Raises InputError if the
    scale is not a finite number above 0."""
    if not math.isfinite(scale) or scale <= 0:
        raise InputError(
            place="px_per_m", got=f"{scale}", expected="a number above 0", remedy="give --px-per-m: tracks are in px"
        )
    frame = np.repeat(np.array([t.index for t in tracks], np.int64) - 1, [len(t.id) for t in tracks])
    id, group = np.concatenate([t.id for t in tracks]), np.concatenate(_named_groups(tracks))
    if places is None:
        pos, vel = (np.concatenate([getattr(t, name)[:, :2] for t in tracks]) / scale for name in ("pos", "vel"))
    else:
        pos, vel = places, np.full_like(places, np.nan)
    rows = PeopleRows(frame, id, pos, vel, group, np.concatenate([t.measured for t in tracks]))
    return rows.take(np.lexsort((id, frame)))


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
