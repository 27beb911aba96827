"""All tracks of a sequence as one table of rows, in metres: the input of the grouping rule."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.truth.merge_split_rules import frames_of
from sim.types import Array, Ints, Tracks
from tracking.grouping.link_rule import LinkRule

DEFAULT_CHORD = 0.5
"""s: a tracker without velocities gets those of chords over this time."""


@dataclass(frozen=True, slots=True, eq=False)
class TracksTable:
    """R rows, one per track and frame, sorted by frame, then id.

    frame (R,) from 0; id (R,) of the track; column (R,) index of the id in `ids` (P,), the sorted ids; pos, vel (R, 2)
    in m and m/s, nan if unknown; group (R,) the tracker's own, -1 for a person alone; length: frames T of the sequence;
    scale: px per metre in the image, else 1.
    """

    frame: Ints
    id: Ints
    column: Ints
    ids: Ints
    pos: Array
    vel: Array
    group: Ints
    length: int
    scale: float

    def positions(self) -> Array:
        """Return positions (T, P, 2) in m by frame and column; nan where a person is absent."""
        return self._dense(self.pos)

    def velocities(self) -> Array:
        """Return velocities (T, P, 2) in m/s by frame and column; nan where a person is absent."""
        return self._dense(self.vel)

    def labels(self) -> Ints:
        """Return group ids (T, P) by frame and column; -1 where a person is alone or absent."""
        out = np.full((self.length, len(self.ids)), -1, np.int64)
        out[self.frame, self.column] = self.group
        return out

    def _dense(self, values: Array) -> Array:
        out = np.full((self.length, len(self.ids), 2), np.nan)
        out[self.frame, self.column] = values
        return out


def tabulate(tracks: Sequence[Tracks], fps: float, px_per_m: float, rule: LinkRule) -> TracksTable:
    """Return the table of a sequence's tracks (not empty); px_per_m is used only if they are in the image.

    Velocities are the tracker's own. Unknown ones are replaced by chords over 0.5 s. If `rule.smooth` is above 0, all
    are replaced by chords over that time.
    Raises InputError if the tracks are in the image and px_per_m is not a number above 0.
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
    order = np.lexsort((id, frame))
    frame, id, group, pos, vel = frame[order], id[order], group[order], pos[order], vel[order]
    ids, column = np.unique(id, return_inverse=True)
    length = int(max(t.index for t in tracks))
    unknown = np.isnan(vel[:, 0])
    if rule.smooth > 0 or unknown.any():
        chords = backward_velocity(frame, column, pos, fps, rule.smooth or DEFAULT_CHORD)
        vel = chords if rule.smooth > 0 else np.where(unknown[:, None], chords, vel)
    return TracksTable(frame, id, column, ids, pos, vel, group, length, scale)


def _named_groups(tracks: Sequence[Tracks]) -> list[Ints]:
    """The group of each track in each frame, -1 for a person alone.

    It is `Tracks.group`, or, if that is -1 in the whole sequence, the group in `Tracks.groups` that lists the track.
    """
    if any((t.group >= 0).any() for t in tracks):
        return [t.group for t in tracks]
    found = []
    for t in tracks:
        members = () if t.groups is None else zip(t.groups.id.tolist(), t.groups.members, strict=False)
        group_of = {p: g for g, people in members for p in people.tolist()}
        found.append(np.array([group_of.get(p, -1) for p in t.id.tolist()], np.int64))
    return found


def backward_velocity(frame: Ints, column: Ints, pos: Array, fps: float, window: float) -> Array:
    """Return velocities (R, 2) in m/s: the chord from the person's earliest row within the last `window` s.

    frame, column (R,), pos (R, 2) in m, as in TracksTable. nan in a person's first row and where the person has no row
    within the window.
    """
    order = np.lexsort((frame, column))
    f, span = frame[order], frames_of(window, fps)
    key = column[order] * (int(f.max(initial=0)) + span + 2) + f
    first = np.searchsorted(key, key - span)
    steps = f - f[first]
    out = np.empty_like(pos)
    chord = (pos[order] - pos[order][first]) * fps / np.maximum(steps, 1)[:, None]
    out[order] = np.where(steps[:, None] > 0, chord, np.nan)
    return out


def boxes_of_rows(tracks: Sequence[Tracks]) -> Array | None:
    """Return the boxes (R, 4) ltwh in px of the table's rows if group hulls are drawn round boxes, else None.

    Hulls are drawn round boxes if the tracks are in the image and every track has a box.
    """
    if tracks[0].plane != "image" or any(t.box is None for t in tracks if len(t.id)):
        return None
    found = [t.box[np.argsort(t.id)] for t in tracks if t.box is not None and len(t.id)]
    return np.concatenate(found) if found else None
