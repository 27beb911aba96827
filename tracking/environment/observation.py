"""The observation of the environment: statistics of detections and tracks, without any truth.

Each statistic is about the frames since the last decision and lies in [0, 1]. A share is itself. Another quantity
x >= 0 is x / (x + half), so 0.5 stands for `half` in the unit of the statistic. A statistic that is not known is 0."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Frame, Tracks

TWO_PEOPLE = 1.5  # Least estimated size at which a group counts as two people.


@dataclass(frozen=True)
class Statistic:
    """One number of the observation."""

    name: str
    half: float | None  # the value that 0.5 stands for, in `unit`; None for a share, which stands for itself
    unit: str  # such as "m/s", "" for plain numbers, "share" for shares
    meaning: str


STATISTICS = (
    Statistic("time", 20.0, "s", "time since the first frame"),
    Statistic("tracks", 10.0, "", "number of tracks, mean over frames"),
    Statistic("speed", 1.3, "m/s", "speed of the tracks, median"),
    Statistic("grouped", None, "share", "tracks in a group; of trackers of groups, groups of two people or more"),
    Statistic("detections", 10.0, "", "number of detections, mean over frames"),
    Statistic("score", None, "share", "score of the detections, mean"),
)
NAMES = tuple(s.name for s in STATISTICS)


class Observer:
    """Collects frames and tracks between two decisions, for the statistics of the observation.

    State: the tracks, and the scores of the detections, of each frame since the last decision."""

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._tracks: list[Tracks] = []
        self._scores: list[Array] = []

    def add(self, frame: Frame, tracks: Tracks) -> None:
        """Adds the next frame, as the tracker got it, and the tracks of this frame."""
        self._tracks.append(tracks)
        if frame.detections is not None:
            score = frame.detections.score
            self._scores.append(score if len(score) else np.ones(len(frame.detections.pos)))

    def statistics(self, px_per_m: float) -> NDArray[np.float32]:
        """Returns the statistics (K,) of the frames added since the last call, in the order of STATISTICS.

        The frames are then forgotten. Unknown statistics are 0. px_per_m: image scale; if it is nan or 0, the speed of
        tracks in the image is unknown.
        """
        values = self._values(px_per_m) if self._tracks else {}
        self._tracks, self._scores = [], []
        return np.array([squashed(s, values.get(s.name, 0.0)) for s in STATISTICS], np.float32)

    def _values(self, px_per_m: float) -> dict[str, float]:
        tracks = self._tracks
        count = sum(len(t.id) for t in tracks) / len(tracks)
        values = {"time": tracks[-1].index / self.fps, "tracks": count, "grouped": _share_in_groups(tracks)}
        if self._scores:
            score = np.concatenate(self._scores)
            values |= {"detections": len(score) / len(self._scores), "score": float(score.mean()) if len(score) else 0}
        scale = px_per_m if tracks[-1].plane == "image" else 1.0
        speed = np.concatenate([np.hypot(t.vel[:, 0], t.vel[:, 1]) for t in tracks])
        known = np.isfinite(speed)
        return {**values, "speed": float(np.median(speed[known])) / scale} if scale > 0 and known.any() else values


def _share_in_groups(tracks: list[Tracks]) -> float:
    if tracks[-1].unit == "group":
        size = np.concatenate([np.zeros(0), *(t.groups.size for t in tracks if t.groups is not None)])
        grouped = size[np.isfinite(size)] >= TWO_PEOPLE
    else:
        grouped = np.concatenate([t.group for t in tracks]) >= 0
    return float(grouped.mean()) if len(grouped) else 0.0


def squashed(statistic: Statistic, value: float) -> float:
    """Returns the value of a statistic mapped to [0, 1]: a share as it is, another value x as x / (x + half)."""
    return value if statistic.half is None else value / (value + statistic.half)
