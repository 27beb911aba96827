"""Tracks and detections of a few frames as rows of arrays, in metres, and the matches between them.

`track_rows` and `detection_rows` build the rows, from which tracking.environment.observation computes its statistics.
Other functions find rows of one track in consecutive frames, and nearest neighbours. Nothing here knows the truth.
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
    """R reported tracks in frames, frame by frame."""

    frame: Ints  # (R,) from 0 at the first frame given
    id: Ints  # (R,)
    pos: Array  # (R, 2) x, y in m
    vel: Array  # (R, 2) m/s, 0 if unknown
    cov: Array  # (R, 2, 2) covariance of the position, m²
    reach: Array  # (R,) distance within which detections belong to the track, m

    def __len__(self) -> int:
        return len(self.frame)


@dataclass(frozen=True, eq=False)
class DetectionRows:
    """D detections of a window, frame by frame."""

    frame: Ints  # (D,) counted like the frames of the TrackRows
    pos: Array  # (D, 2) x, y in m
    score: Array  # (D,) in [0, 1]; 1 if unknown
    frames: tuple[int, ...]  # whose detections are known, frames without a detection included
    first: int  # frame of the window

    def __len__(self) -> int:
        return len(self.frame)

    def neighbours(self, reach: float) -> float:
        """Returns the mean number of other detections of the same frame within `reach` (m) of a detection."""
        if not len(self):
            return 0.0
        tree = _tree(self.pos, self.frame)
        return float((tree.count_neighbors(tree, reach) - len(self)) / len(self))


def track_rows(tracks: Sequence[Tracks], scale: float) -> TrackRows:
    """Returns the tracks of consecutive frames as rows in m; frame k of the list gets number k, from 0."""
    frame = np.repeat(np.arange(len(tracks)), [len(t.id) for t in tracks])
    id = np.concatenate([np.zeros(0, np.int64), *(t.id for t in tracks)])
    pos, vel = (
        np.concatenate([np.zeros((0, 2)), *(getattr(t, name)[:, :2] for t in tracks)]) / scale
        for name in ("pos", "vel")
    )
    cov = np.concatenate([np.zeros((0, 2, 2)), *(t.cov[:, :2, :2] for t in tracks)]) / scale**2
    return TrackRows(
        frame, id, pos, np.nan_to_num(vel), cov, np.concatenate([np.zeros(0), *(_reach(t, scale) for t in tracks)])
    )


def _reach(t: Tracks, scale: float) -> Array:
    """Returns the distance (N,) in m within which detections belong to each of the N tracks of a frame."""
    reach = np.full(len(t.id), REACH)
    if t.unit != "group" or t.groups is None or not len(t.groups.id):
        return reach
    spread = np.sqrt(np.maximum(np.trace(t.groups.extent, axis1=1, axis2=2) / 2, 0.0)) / scale
    by_id = dict(zip(t.groups.id.tolist(), np.nan_to_num(spread).tolist(), strict=True))
    return reach + EXTENT_SIGMAS * np.array([by_id.get(i, 0.0) for i in t.id.tolist()])


def detection_rows(detections: Sequence[Detections | None], plane: str, scale: float, first: int) -> DetectionRows:
    """Returns the detections of consecutive frames as rows in m; entry k of the list gets frame number first + k."""
    known = [(first + k, d) for k, d in enumerate(detections) if d is not None and (d.plane == plane or not len(d.pos))]
    frame = np.repeat([f for f, _ in known], [len(d.pos) for _, d in known]).astype(np.int64)
    pos = np.concatenate([np.zeros((0, 2)), *(d.pos[:, :2] for _, d in known)]) / scale
    score = [d.score if len(d.score) else np.ones(len(d.pos)) for _, d in known]
    return DetectionRows(frame, pos, np.concatenate([np.zeros(0), *score]), tuple(f for f, _ in known), first)


def consecutive_rows(rows: TrackRows) -> tuple[Ints, Ints]:
    """Returns the indices of pairs of rows of one track in consecutive frames: earlier rows (K,), later rows (K,)."""
    order = np.lexsort((rows.frame, rows.id))
    a, b = order[:-1], order[1:]
    same: Bools = (rows.id[a] == rows.id[b]) & (rows.frame[a] + 1 == rows.frame[b])
    return a[same], b[same]


def nearest_distances(pos: Array, frame: Ints) -> Array:
    """Returns the distance in m from each of N positions to the nearest other one of the same frame."""
    if len(pos) < 2:
        return np.zeros(0)
    distance = _tree(pos, frame).query(_with_frame(pos, frame), k=2)[0][:, 1]
    return np.asarray(distance[distance < FRAME_DISTANCE / 2])


def nearest_expected(expected: Array, frame: Ints, reach: Array, detections: DetectionRows) -> Ints:
    """Returns for each of D detections the nearest expected position of its frame within reach; -1 for none."""
    if not len(expected) or not len(detections):
        return np.full(len(detections), -1)
    distance, nearest = _tree(expected, frame).query(_with_frame(detections.pos, detections.frame))
    return np.where(distance <= reach[nearest], nearest, -1)


def _with_frame(pos: Array, frame: Ints) -> Array:
    # The third column keeps frames apart in a k-d tree.
    return np.column_stack([pos, frame * FRAME_DISTANCE])


def _tree(pos: Array, frame: Ints):  # type: ignore[no-untyped-def]
    from scipy.spatial import cKDTree

    return cKDTree(_with_frame(pos, frame))
