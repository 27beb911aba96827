"""A few frames of answers and detections as rows, in metres: who is who from frame to frame, what lies near what."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Detections, Ints, Tracks

APART = 1e6
"""m between frames, where the third coordinate keeps them apart."""
REACH = 1.0
"""m: a detection so near to where a track was expected is taken for its own."""
WIDE = 2.0
"""Standard deviations of its extent by which a group's reach is wider."""


@dataclass(frozen=True, eq=False)
class Rows:
    """R answers: frame (R,) counted from 0, id (R,), pos, vel (R, 2), cov (R, 2, 2) of pos, reach (R,); metres."""

    frame: Ints
    id: Ints
    pos: Array
    vel: Array
    cov: Array
    reach: Array

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True, eq=False)
class Found:
    """D detections: frame (D,) counted as those of the answers, pos (D, 2) m, score (D,); frames: those that have any
    detections at all, empty ones included; first: the frame of the first answer."""

    frame: Ints
    pos: Array
    score: Array
    frames: tuple[int, ...]
    first: int

    def __len__(self) -> int:
        return len(self.frame)

    def neighbours(self, reach: float) -> float:
        """How many others of the same frame are so near, mean."""
        if not len(self):
            return 0.0
        tree = _tree(self.pos, self.frame)
        return float((tree.count_neighbors(tree, reach) - len(self)) / len(self))


def rows(answers: Sequence[Tracks], scale: float) -> Rows:
    """Answers one after the other; scale: units of their plane per metre."""
    frame = np.repeat(np.arange(len(answers)), [len(t.id) for t in answers])
    id = np.concatenate([np.zeros(0, np.int64), *(t.id for t in answers)])
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in answers)]) / scale
        for name in ("pos", "vel")
    )
    cov = np.concatenate([np.zeros((0, 2, 2)), *(t.cov[:, :2, :2] for t in answers)]) / scale**2
    return Rows(frame, id, pos, np.nan_to_num(vel), cov, np.concatenate([np.zeros(0), *(map(_reach, answers))]))


def _reach(t: Tracks) -> Array:
    """(N,) m from a track's place within which detections are its own: wider by the extent of a group."""
    wide = np.full(len(t.id), REACH)
    if t.unit != "group" or t.groups is None or not len(t.groups.id):
        return wide
    spread = np.sqrt(np.maximum(np.trace(t.groups.extent, axis1=1, axis2=2) / 2, 0.0))
    of = dict(zip(t.groups.id.tolist(), np.nan_to_num(spread).tolist(), strict=True))
    return wide + WIDE * np.array([of.get(i, 0.0) for i in t.id.tolist()])


def found(detections: Sequence[Detections | None], plane: str, scale: float, first: int) -> Found:
    """The detections of frames first, first + 1, …; those in another plane than the tracks' are left out."""
    some = [(first + k, d) for k, d in enumerate(detections) if d is not None and (d.plane == plane or not len(d.pos))]
    frame = np.repeat([f for f, _ in some], [len(d.pos) for _, d in some]).astype(np.int64)
    pos = np.concatenate([np.zeros((0, 2)), *(d.pos[:, :2] for _, d in some)]) / scale
    score = [d.score if len(d.score) else np.ones(len(d.pos)) for _, d in some]
    return Found(frame, pos, np.concatenate([np.zeros(0), *score]), tuple(f for f, _ in some), first)


def steps(own: Rows) -> tuple[Ints, Ints]:
    """(K,), (K,) rows of the same track in a frame and in the next one."""
    order = np.lexsort((own.frame, own.id))
    a, b = order[:-1], order[1:]
    same: Bools = (own.id[a] == own.id[b]) & (own.frame[a] + 1 == own.frame[b])
    return a[same], b[same]


def near_ones(pos: Array, frame: Ints) -> Array:
    """(N,) distances to the nearest other place of the same frame; of those who are not alone."""
    if len(pos) < 2:
        return np.zeros(0)
    away = _tree(pos, frame).query(_apart(pos, frame), k=2)[0][:, 1]
    return np.asarray(away[away < APART / 2])


def assigned(expected: Array, frame: Ints, reach: Array, seen: Found) -> Ints:
    """(D,) the nearest expected place (N, 2) of each detection's frame, -1 where none is within its reach (N,)."""
    if not len(expected) or not len(seen):
        return np.full(len(seen), -1)
    away, owner = _tree(expected, frame).query(_apart(seen.pos, seen.frame))
    return np.where(away <= reach[owner], owner, -1)


def _apart(pos: Array, frame: Ints) -> Array:
    """(N, 3) places that are far from each other where their frames differ."""
    return np.column_stack([pos, frame * APART])


def _tree(pos: Array, frame: Ints):  # type: ignore[no-untyped-def]
    from scipy.spatial import cKDTree

    return cKDTree(_apart(pos, frame))
