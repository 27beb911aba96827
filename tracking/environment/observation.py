"""The observation of the environment: statistics of detections, tracks and pictures, without any truth.

Each statistic is about the frames since the last decision and lies in [0, 1]. A share is itself. Another quantity
x >= 0 is x / (x + half), so 0.5 stands for `half` in the unit of the statistic. A statistic that is not known is 0."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Frame, Ints, Tracks
from tracking.environment.observation_window import (
    DetectionRows,
    TrackRows,
    consecutive_rows,
    detection_rows,
    nearest_distances,
    nearest_expected,
    track_rows,
)

PIXEL_STEP = 8
"""Every so many rows and columns of a picture count for its brightness."""
NEIGHBOUR = 1.5
"""Greatest distance of two detections that count as neighbours, m."""
WEAK = 0.5
"""Scores below this are weak."""
TWO_PEOPLE = 1.5
"""Least estimated size at which a group counts as two people."""


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
    Statistic("births", 1.0, "1/s", "tracks that appear"),
    Statistic("deaths", 1.0, "1/s", "tracks that disappear"),
    Statistic("age", 2.0, "s", "age of the tracks of the last frame, median"),
    Statistic("speed", 1.3, "m/s", "speed of the tracks, median"),
    Statistic("speed_spread", 0.5, "m/s", "interquartile range of the speeds"),
    Statistic("acceleration", 1.0, "m/s^2", "change of a track's velocity between frames, median"),
    Statistic("crowding", 1.0, "m", "distance from a track to the nearest other track, median"),
    Statistic("gate", 0.2, "m", "standard deviation of a track's position by its own covariance, median"),
    Statistic("correction", 0.05, "m", "distance from a track's expected position to its reported one, median"),
    Statistic(
        "correction_sigma", 1.0, "", "squared correction, in units of the track's covariance per dimension, median"
    ),
    Statistic("grouped", None, "share", "tracks in a group; of trackers of groups, groups of two people or more"),
    Statistic("group_size", 2.0, "people", "people in a group, mean"),
    Statistic("merges", 6.0, "1/min", "reported events merge and form"),
    Statistic("splits", 6.0, "1/min", "reported events split and dissolve"),
    Statistic("seen", None, "share", "frames with detections in the plane of the tracks"),
    Statistic("detections", 10.0, "", "number of detections, mean over frames"),
    Statistic("flicker", 0.3, "", "standard deviation of the number of detections, divided by its mean + 1"),
    Statistic("score", None, "share", "score of the detections, mean"),
    Statistic("weak", None, "share", "detections with a score below 0.5"),
    Statistic("density", 2.0, "people", "other detections within 1.5 m of a detection, mean"),
    Statistic("surplus", None, "share", "detections divided by detections plus tracks"),
    Statistic("orphans", None, "share", "detections that belong to no track"),
    Statistic("missed", None, "share", "tracks to which no detection belongs"),
    Statistic("innovation", 0.1, "m", "distance from a track's expected position to its detections, median"),
    Statistic(
        "innovation_sigma", 2.0, "", "squared innovation, in units of the track's covariance per dimension, median"
    ),
    Statistic("residual", 0.05, "m", "distance from a track's reported position to its detections, median"),
    Statistic("brightness", None, "share", "brightness of the last picture, mean"),
    Statistic("lights", 0.02, "", "relative change of brightness between pictures, mean"),
)
NAMES = tuple(s.name for s in STATISTICS)


class Observer:
    """Collects frames and tracks between two decisions, for the statistics of the observation.

    State: frames and tracks since the last decision, the tracks of the frame before them, the first frame of each id,
    the brightness of the pictures, from 0 (black) to 1.
    """

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._frames: list[Frame] = []
        self._tracks: list[Tracks] = []
        self._before: list[Tracks] = []
        self._first_frame: dict[int, int] = {}
        self._brightness: list[float] = []

    def add(self, frame: Frame, tracks: Tracks) -> None:
        """Adds the next frame, as the tracker got it, and its tracks (one `Tracks`)."""
        self._tracks.append(tracks)
        self._frames.append(Frame(frame.index, frame.t, detections=frame.detections))
        for id in tracks.id.tolist():
            self._first_frame.setdefault(id, tracks.index)
        if frame.image is not None:
            self._brightness.append(float(frame.image[::PIXEL_STEP, ::PIXEL_STEP].mean()) / 255)

    def statistics(self, px_per_m: float) -> NDArray[np.float32]:
        """Returns the statistics (K,) of the frames since the last call, in the order of STATISTICS, and forgets them.

        Unknown ones are 0. Without a scale (px_per_m nan or 0) all lengths and speeds of tracks in the image are.
        """
        values = self._values(px_per_m) if self._tracks else {}
        self._before, self._tracks, self._frames = self._tracks[-1:] or self._before, [], []
        self._brightness = self._brightness[-1:]
        return np.array([squashed(s, values.get(s.name, 0.0)) for s in STATISTICS], np.float32)

    def _values(self, px_per_m: float) -> dict[str, float]:
        last = self._tracks[-1]
        seconds = len(self._tracks) / self.fps
        known = last.plane != "image" or px_per_m > 0
        scale = px_per_m if last.plane == "image" and known else 1.0
        values = {"time": last.index / self.fps, **_group_values(self._tracks, seconds)}
        values |= _picture_values(self._brightness)
        values["age"] = median(np.array([last.index - self._first_frame[i] for i in last.id.tolist()]) / self.fps)
        rows = track_rows([*self._before, *self._tracks], scale)
        values |= self._track_counts(rows, seconds)
        found = detection_rows([f.detections for f in self._frames], last.plane, scale, len(self._before))
        values |= _detection_values(found, rows, len(self._tracks))
        return {**values, "density": found.neighbours(NEIGHBOUR), **self._movement(rows, found)} if known else values

    def _track_counts(self, rows: TrackRows, seconds: float) -> dict[str, float]:
        before, after = consecutive_rows(rows)
        born, ended = np.ones(len(rows), bool), np.ones(len(rows), bool)
        born[after], ended[before] = False, False
        first, last = len(self._before), len(self._before) + len(self._tracks) - 1
        return {
            "tracks": float((rows.frame >= first).sum()) / len(self._tracks),
            "births": float((born & (rows.frame >= first)).sum()) / seconds,
            "deaths": float((ended & (rows.frame < last)).sum()) / seconds,
        }

    def _movement(self, rows: TrackRows, found: DetectionRows) -> dict[str, float]:
        """Returns medians over the window, m and s; d' C^-1 d / 2 for the names in "sigma"."""
        now = rows.frame >= len(self._before)
        before, after = consecutive_rows(rows)
        expected = rows.pos + rows.vel / self.fps
        shift = rows.pos[after] - expected[before]
        change = np.hypot(*(rows.vel[after] - rows.vel[before]).T) * self.fps
        speed = np.hypot(*rows.vel[now].T)
        low, high = np.quantile(speed, [0.25, 0.75]) if len(speed) else (0.0, 0.0)
        values = {
            "speed": median(speed),
            "speed_spread": float(high - low),
            "acceleration": median(change),
            "crowding": median(nearest_distances(rows.pos[now], rows.frame[now])),
            "gate": median(np.sqrt(np.maximum(np.trace(rows.cov[now], axis1=1, axis2=2) / 2, 0.0))),
            "correction": median(np.hypot(*shift.T)),
            "correction_sigma": median(_squared_sigmas(shift, rows.cov[before])),
        }
        return values | (_innovations(rows, expected, found) if found.frames else {})


def _innovations(rows: TrackRows, expected: Array, found: DetectionRows) -> dict[str, float]:
    """Returns shares and medians of detections against expected positions (R, 2) of the rows one frame later, m."""
    looked = np.isin(rows.frame + 1, found.frames)
    here = np.flatnonzero(looked)
    owner = nearest_expected(expected[here], rows.frame[here] + 1, rows.reach[here], found)
    taken = owner >= 0
    count = np.bincount(owner[taken], minlength=len(here))
    hit = count > 0
    total = np.stack([np.bincount(owner[taken], found.pos[taken, k], len(here)) for k in (0, 1)], 1)
    mean = total[hit] / count[hit, None]
    shift = mean - expected[here[hit]]
    before, after = consecutive_rows(rows)
    next_row = np.full(len(rows), -1)
    next_row[before] = after
    later = next_row[here[hit]]
    residual = mean[later >= 0] - rows.pos[later[later >= 0]]
    return {
        "orphans": share(~taken[found.frame > 0]),
        "missed": share(~hit),
        "innovation": median(np.hypot(*shift.T)),
        "innovation_sigma": median(_squared_sigmas(shift, rows.cov[here[hit]])),
        "residual": median(np.hypot(*residual.T)),
    }


def _group_values(tracks: Sequence[Tracks], seconds: float) -> dict[str, float]:
    kinds = [e.kind for t in tracks for e in t.events]
    merges, splits = (sum(kind in pair for kind in kinds) for pair in (("merge", "form"), ("split", "dissolve")))
    values = {"merges": 60 * merges / seconds, "splits": 60 * splits / seconds}
    if tracks[-1].unit == "group":
        size = np.concatenate([np.zeros(0), *(t.groups.size for t in tracks if t.groups is not None)])
        size = size[np.isfinite(size)]
        return {**values, "grouped": share(size >= TWO_PEOPLE), "group_size": float(size.mean()) if len(size) else 0.0}
    labels = [t.group[t.group >= 0] for t in tracks]
    people, groups = sum(map(len, labels)), sum(len(set(g.tolist())) for g in labels)
    count = sum(len(t.id) for t in tracks)
    return {**values, "grouped": people / max(count, 1), "group_size": people / max(groups, 1)}


def _detection_values(found: DetectionRows, rows: TrackRows, frames: int) -> dict[str, float]:
    count = np.bincount(found.frame - found.first, minlength=frames)[[f - found.first for f in found.frames]]
    if not len(count):
        return {}
    return {
        "seen": len(count) / frames,
        "detections": float(count.mean()),
        "flicker": float(count.std() / (count.mean() + 1)),
        "score": float(found.score.mean()) if len(found) else 0.0,
        "weak": share(found.score < WEAK),
        "surplus": len(found) / max(len(found) + int(np.isin(rows.frame, found.frames).sum()), 1),
    }


def _picture_values(brightness: Sequence[float]) -> dict[str, float]:
    if not brightness:
        return {}
    level = np.array(brightness)
    change = np.abs(np.diff(level)) / np.maximum(level[:-1], 1e-3)
    return {"brightness": float(level[-1]), "lights": float(change.mean()) if len(change) else 0.0}


def _squared_sigmas(shift: Array, cov: Array) -> Array:
    """Returns d' C^-1 d / 2 of N shifts d (`shift` (N, 2), m) with covariances C (`cov` (N, 2, 2), m²)."""
    det = cov[:, 0, 0] * cov[:, 1, 1] - cov[:, 0, 1] * cov[:, 1, 0]
    good = det > 0
    (x, y), c = shift[good].T, cov[good]
    square = c[:, 1, 1] * x * x - (c[:, 0, 1] + c[:, 1, 0]) * x * y + c[:, 0, 0] * y * y
    return np.asarray(square / det[good] / 2)


def median(values: Array | Ints) -> float:
    """Returns the median of the values (N,), 0 if there are none; nan if one is nan."""
    return float(np.median(values)) if len(values) else 0.0


def share(which: Bools) -> float:
    """Returns the share of true values (N,), between 0 and 1; 0 if there are none."""
    return float(which.mean()) if len(which) else 0.0


def squashed(statistic: Statistic, value: float) -> float:
    """Returns the value of a statistic mapped to [0, 1]: a share is clipped, another value x becomes x / (x + half)."""
    if not np.isfinite(value):
        return 0.0 if statistic.half is None else float(value > 0)
    if statistic.half is None:
        return min(max(value, 0.0), 1.0)
    return max(value, 0.0) / (max(value, 0.0) + statistic.half)


def table() -> str:
    """Returns the statistics as the Markdown table of docs/reference/environment.md."""
    lines = [
        f"| {k} | `{s.name}` | {'share' if s.half is None else f'{s.half:g} {s.unit}'.strip()} | {s.meaning} |"
        for k, s in enumerate(STATISTICS)
    ]
    return "\n".join(["| | statistic | 0.5 stands for | meaning |", "|---|---|---|---|", *lines, ""])
