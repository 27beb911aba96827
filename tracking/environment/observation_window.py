"""Tracks and detections of a few frames as rows of arrays, in metres, and the matches between them.

The rows are what tracking.environment.observation computes its statistics from. Nothing here knows the truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Detections, Ints, Tracks

FRAME_DISTANCE = 1e6
"""Distance between frames in the third coordinate of the search trees, m; it keeps frames apart."""
REACH = 1.0
"""Greatest distance between the expected position of a track and a detection that belongs to it, m."""
EXTENT_SIGMAS = 2.0
"""Standard deviations of its extent that are added to the reach of a group."""


@dataclass(frozen=True, eq=False)
class TrackRows:
    """R reported track states, frame by frame.

    frame: (R,) counted from 0; id: (R,); pos: (R, 2) m; vel: (R, 2) m/s, 0 if unknown; cov: (R, 2, 2) covariance of the
    position, m²; reach: (R,) distance within which detections belong to the track, m.
    """

    frame: Ints
    id: Ints
    pos: Array
    vel: Array
    cov: Array
    reach: Array

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True, eq=False)
class DetectionRows:
    """D detections, frame by frame.

    frame: (D,) counted like the frames of the TrackRows; pos: (D, 2) m; score: (D,); frames: the frames whose
    detections are known, frames without a detection included; first: the first frame of the window.
    """

    frame: Ints
    pos: Array
    score: Array
    frames: tuple[int, ...]
    first: int

    def __len__(self) -> int:
        return len(self.frame)

    def neighbours(self, reach: float) -> float:
        """Returns the mean number of other detections of the same frame within `reach` m of a detection, 0 if none."""
        if not len(self):
            return 0.0
        tree = _tree(self.pos, self.frame)
        return float((tree.count_neighbors(tree, reach) - len(self)) / len(self))


def track_rows(tracks: Sequence[Tracks], scale: float) -> TrackRows:
    """Returns the tracks of consecutive frames as rows. scale: units of their plane per metre."""
    frame = np.repeat(np.arange(len(tracks)), [len(t.id) for t in tracks])
    id = np.concatenate([np.zeros(0, np.int64), *(t.id for t in tracks)])
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in tracks)]) / scale
        for name in ("pos", "vel")
    )
    cov = np.concatenate([np.zeros((0, 2, 2)), *(t.cov[:, :2, :2] for t in tracks)]) / scale**2
    return TrackRows(frame, id, pos, np.nan_to_num(vel), cov, np.concatenate([np.zeros(0), *(map(_reach, tracks))]))


def _reach(t: Tracks) -> Array:
    """(N,) m, REACH for a person, more for a group by EXTENT_SIGMAS times the root mean square of its extent."""
    reach = np.full(len(t.id), REACH)
    if t.unit != "group" or t.groups is None or not len(t.groups.id):
        return reach
    spread = np.sqrt(np.maximum(np.trace(t.groups.extent, axis1=1, axis2=2) / 2, 0.0))
    by_id = dict(zip(t.groups.id.tolist(), np.nan_to_num(spread).tolist(), strict=True))
    return reach + EXTENT_SIGMAS * np.array([by_id.get(i, 0.0) for i in t.id.tolist()])


def detection_rows(detections: Sequence[Detections | None], plane: str, scale: float, first: int) -> DetectionRows:
    """Returns the detections of frames first, first + 1, … as rows.

    Frames without detections (None), or with detections in another plane than `plane`, are left out. A detection
    without score has score 1. scale: units of the plane per metre.
    """
    known = [(first + k, d) for k, d in enumerate(detections) if d is not None and (d.plane == plane or not len(d.pos))]
    frame = np.repeat([f for f, _ in known], [len(d.pos) for _, d in known]).astype(np.int64)
    pos = np.concatenate([np.zeros((0, 2)), *(d.pos[:, :2] for _, d in known)]) / scale
    score = [d.score if len(d.score) else np.ones(len(d.pos)) for _, d in known]
    return DetectionRows(frame, pos, np.concatenate([np.zeros(0), *score]), tuple(f for f, _ in known), first)


def consecutive_rows(rows: TrackRows) -> tuple[Ints, Ints]:
    """Returns the pairs of rows of the same track in consecutive frames: earlier rows (K,), later rows (K,)."""
    order = np.lexsort((rows.frame, rows.id))
    a, b = order[:-1], order[1:]
    same: Bools = (rows.id[a] == rows.id[b]) & (rows.frame[a] + 1 == rows.frame[b])
    return a[same], b[same]


def nearest_distances(pos: Array, frame: Ints) -> Array:
    """Returns the distance from each position (N, 2) to the nearest other one of the same frame, m.

    Positions that are alone in their frame (N,) are left out, so the result may be shorter than N.
    """
    if len(pos) < 2:
        return np.zeros(0)
    distance = _tree(pos, frame).query(_with_frame(pos, frame), k=2)[0][:, 1]
    return np.asarray(distance[distance < FRAME_DISTANCE / 2])


def nearest_expected(expected: Array, frame: Ints, reach: Array, detections: DetectionRows) -> Ints:
    """Returns for each detection (D,) the index of the nearest expected position (N, 2) of its frame.

    It is -1 if that position is farther away than its `reach` (N,), m, or if there is none. frame: (N,).
    """
    if not len(expected) or not len(detections):
        return np.full(len(detections), -1)
    distance, nearest = _tree(expected, frame).query(_with_frame(detections.pos, detections.frame))
    return np.where(distance <= reach[nearest], nearest, -1)


def _with_frame(pos: Array, frame: Ints) -> Array:
    """(N, 3) positions with a third coordinate that keeps frames apart."""
    return np.column_stack([pos, frame * FRAME_DISTANCE])


def _tree(pos: Array, frame: Ints):  # type: ignore[no-untyped-def]
    from scipy.spatial import cKDTree

    return cKDTree(_with_frame(pos, frame))
