"""What an agent sees: statistics of detections, answers and pictures, all of which a deployed tracker has too.

Nothing here knows what is true. Each statistic is of the frames since the last decision and lies in [0, 1]: a share as
it is, any other quantity x >= 0 as x / (x + half), so that 0.5 stands for `half` in its unit; 0 where nothing is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Bools, Frame, Ints, Tracks
from tracking.environment.observation_window import Found, Rows, assigned, found, near_ones, rows, steps

EVERY = 8
"""px between those of a picture that are looked at."""
NEIGHBOUR = 1.5
"""m: who is nearer counts for the density."""
WEAK = 0.5
"""A score below this is a weak one."""
SEVERAL = 1.5
"""People from which on an estimated size counts as two."""


@dataclass(frozen=True)
class Statistic:
    """One number of the observation: half: the value that 0.5 stands for, None of a share."""

    name: str
    half: float | None
    unit: str
    meaning: str


STATISTICS = (
    Statistic("time", 20.0, "s", "since the first frame"),
    Statistic("tracks", 10.0, "", "tracks reported, mean over frames"),
    Statistic("births", 1.0, "1/s", "tracks that appear"),
    Statistic("deaths", 1.0, "1/s", "tracks that are reported no more"),
    Statistic("age", 2.0, "s", "age of the tracks of the last frame, median"),
    Statistic("speed", 1.3, "m/s", "of the tracks, median"),
    Statistic("speed_spread", 0.5, "m/s", "interquartile range of the speeds"),
    Statistic("acceleration", 1.0, "m/s^2", "change of a track's velocity, median"),
    Statistic("crowding", 1.0, "m", "from a track to the nearest other one, median"),
    Statistic("gate", 0.2, "m", "standard deviation of a track's place by its own covariance, median"),
    Statistic("correction", 0.05, "m", "from where its velocity leads a track to where it is then, median"),
    Statistic("correction_sigma", 1.0, "", "the same squared, in units of its own covariance per dimension, median"),
    Statistic("grouped", None, "share", "tracks that the tracker has put into groups; of groups, those of two or more"),
    Statistic("group_size", 2.0, "people", "in a group, mean"),
    Statistic("merges", 6.0, "1/min", "merges that the tracker reports, form included"),
    Statistic("splits", 6.0, "1/min", "splits that the tracker reports, dissolve included"),
    Statistic("seen", None, "share", "frames with detections in the plane of the tracks"),
    Statistic("detections", 10.0, "", "detections, mean over frames"),
    Statistic("flicker", 0.3, "", "standard deviation of their number, over its mean + 1"),
    Statistic("score", None, "share", "score of the detections, mean"),
    Statistic("weak", None, "share", "detections with a score below 0.5"),
    Statistic("density", 2.0, "people", "detections within 1.5 m of one, mean"),
    Statistic("surplus", None, "share", "detections of detections and tracks: 0.5 where they are as many"),
    Statistic(
        "orphans", None, "share", "detections further than 1 m from where any track was expected (or its extent)"
    ),
    Statistic("missed", None, "share", "tracks without a detection there"),
    Statistic("innovation", 0.1, "m", "from where a track was expected to its detections, median"),
    Statistic("innovation_sigma", 2.0, "", "the same squared, in units of its own covariance per dimension, median"),
    Statistic("residual", 0.05, "m", "from where a track is said to be to its detections, median: the noise"),
    Statistic("brightness", None, "share", "of the last picture, mean"),
    Statistic("lights", 0.02, "", "relative change of brightness between pictures, mean"),
)
NAMES = tuple(s.name for s in STATISTICS)


class Observer:
    """Looks at the frames between two decisions. State: these frames, the last answer before them, first sightings."""

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._frames: list[Frame] = []
        self._answers: list[Tracks] = []
        self._before: list[Tracks] = []
        self._first: dict[int, int] = {}
        self._light: list[float] = []

    def see(self, frame: Frame, answer: Tracks) -> None:
        """Take note of a frame, as the tracker was given it, and of the answer."""
        self._answers.append(answer)
        self._frames.append(Frame(frame.index, frame.t, detections=frame.detections))
        for id in answer.id.tolist():
            self._first.setdefault(id, answer.index)
        if frame.image is not None:
            self._light.append(float(frame.image[::EVERY, ::EVERY].mean()) / 255)

    def look(self, px_per_m: float) -> NDArray[np.float32]:
        """The statistics (K,) in the order of STATISTICS, and a new beginning; px_per_m: of tracks in the image."""
        values = self._values(px_per_m) if self._answers else {}
        self._before, self._answers, self._frames = self._answers[-1:] or self._before, [], []
        self._light = self._light[-1:]
        return np.array([squashed(s, values.get(s.name, 0.0)) for s in STATISTICS], np.float32)

    def _values(self, px_per_m: float) -> dict[str, float]:
        last = self._answers[-1]
        seconds = len(self._answers) / self.fps
        known = last.plane != "image" or px_per_m > 0
        scale = px_per_m if last.plane == "image" and known else 1.0
        values = {"time": last.index / self.fps, **_told(self._answers, seconds), **_lights(self._light)}
        values["age"] = middle(np.array([last.index - self._first[i] for i in last.id.tolist()]) / self.fps)
        own = rows([*self._before, *self._answers], scale)
        values |= self._counts(own, seconds)
        seen = found([f.detections for f in self._frames], last.plane, scale, len(self._before))
        values |= _detected(seen, own, len(self._answers))
        return {**values, "density": seen.neighbours(NEIGHBOUR), **self._movement(own, seen)} if known else values

    def _counts(self, own: Rows, seconds: float) -> dict[str, float]:
        """How many tracks there are, come and go."""
        before, after = steps(own)
        new, old = np.ones(len(own), bool), np.ones(len(own), bool)
        new[after], old[before] = False, False
        first, last = len(self._before), len(self._before) + len(self._answers) - 1
        return {
            "tracks": float((own.frame >= first).sum()) / len(self._answers),
            "births": float((new & (own.frame >= first)).sum()) / seconds,
            "deaths": float((old & (own.frame < last)).sum()) / seconds,
        }

    def _movement(self, own: Rows, seen: Found) -> dict[str, float]:
        """How tracks move, and how far this is from what was expected."""
        now = own.frame >= len(self._before)
        before, after = steps(own)
        expected = own.pos + own.vel / self.fps
        shift = own.pos[after] - expected[before]
        change = np.hypot(*(own.vel[after] - own.vel[before]).T) * self.fps
        speed = np.hypot(*own.vel[now].T)
        low, high = np.quantile(speed, [0.25, 0.75]) if len(speed) else (0.0, 0.0)
        values = {
            "speed": middle(speed),
            "speed_spread": float(high - low),
            "acceleration": middle(change),
            "crowding": middle(near_ones(own.pos[now], own.frame[now])),
            "gate": middle(np.sqrt(np.maximum(np.trace(own.cov[now], axis1=1, axis2=2) / 2, 0.0))),
            "correction": middle(np.hypot(*shift.T)),
            "correction_sigma": middle(_sigma(shift, own.cov[before])),
        }
        return values | (_innovations(own, expected, seen) if seen.frames else {})


def _innovations(own: Rows, expected: Array, seen: Found) -> dict[str, float]:
    """Tracks as they were expected in the next frame against the detections there."""
    looked = np.isin(own.frame + 1, seen.frames)
    here = np.flatnonzero(looked)
    owner = assigned(expected[here], own.frame[here] + 1, own.reach[here], seen)
    taken = owner >= 0
    count = np.bincount(owner[taken], minlength=len(here))
    hit = count > 0
    total = np.stack([np.bincount(owner[taken], seen.pos[taken, k], len(here)) for k in (0, 1)], 1)
    mean = total[hit] / count[hit, None]
    shift = mean - expected[here[hit]]
    before, after = steps(own)
    then = np.full(len(own), -1)
    then[before] = after
    later = then[here[hit]]
    residual = mean[later >= 0] - own.pos[later[later >= 0]]
    return {
        "orphans": share(~taken[seen.frame > 0]),
        "missed": share(~hit),
        "innovation": middle(np.hypot(*shift.T)),
        "innovation_sigma": middle(_sigma(shift, own.cov[here[hit]])),
        "residual": middle(np.hypot(*residual.T)),
    }


def _told(answers: Sequence[Tracks], seconds: float) -> dict[str, float]:
    """What the tracker itself says of groups."""
    kinds = [e.kind for t in answers for e in t.events]
    merges, splits = (sum(kind in pair for kind in kinds) for pair in (("merge", "form"), ("split", "dissolve")))
    told = {"merges": 60 * merges / seconds, "splits": 60 * splits / seconds}
    if answers[-1].unit == "group":
        size = np.concatenate([np.zeros(0), *(t.groups.size for t in answers if t.groups is not None)])
        size = size[np.isfinite(size)]
        return {**told, "grouped": share(size >= SEVERAL), "group_size": float(size.mean()) if len(size) else 0.0}
    label = [t.group[t.group >= 0] for t in answers]
    people, groups = sum(map(len, label)), sum(len(set(g.tolist())) for g in label)
    everybody = sum(len(t.id) for t in answers)
    return {**told, "grouped": people / max(everybody, 1), "group_size": people / max(groups, 1)}


def _detected(seen: Found, own: Rows, frames: int) -> dict[str, float]:
    """How many detections there are in so many frames, and how sure."""
    count = np.bincount(seen.frame - seen.first, minlength=frames)[[f - seen.first for f in seen.frames]]
    if not len(count):
        return {}
    return {
        "seen": len(count) / frames,
        "detections": float(count.mean()),
        "flicker": float(count.std() / (count.mean() + 1)),
        "score": float(seen.score.mean()) if len(seen) else 0.0,
        "weak": share(seen.score < WEAK),
        "surplus": len(seen) / max(len(seen) + int(np.isin(own.frame, seen.frames).sum()), 1),
    }


def _lights(light: Sequence[float]) -> dict[str, float]:
    if not light:
        return {}
    level = np.array(light)
    change = np.abs(np.diff(level)) / np.maximum(level[:-1], 1e-3)
    return {"brightness": float(level[-1]), "lights": float(change.mean()) if len(change) else 0.0}


def _sigma(shift: Array, cov: Array) -> Array:
    """(N,) d' C^-1 d / 2 of shifts (N, 2) and covariances (N, 2, 2); those that cannot be inverted are left out."""
    det = cov[:, 0, 0] * cov[:, 1, 1] - cov[:, 0, 1] * cov[:, 1, 0]
    good = det > 0
    (x, y), c = shift[good].T, cov[good]
    square = c[:, 1, 1] * x * x - (c[:, 0, 1] + c[:, 1, 0]) * x * y + c[:, 0, 0] * y * y
    return np.asarray(square / det[good] / 2)


def middle(values: Array | Ints) -> float:
    """The median, 0 of nothing."""
    return float(np.median(values)) if len(values) else 0.0


def share(which: Bools) -> float:
    """The share of those that are true, 0 of nothing."""
    return float(which.mean()) if len(which) else 0.0


def squashed(statistic: Statistic, value: float) -> float:
    """The value as a number in [0, 1]."""
    if not np.isfinite(value):
        return 0.0 if statistic.half is None else float(value > 0)
    if statistic.half is None:
        return min(max(value, 0.0), 1.0)
    return max(value, 0.0) / (max(value, 0.0) + statistic.half)


def table() -> str:
    """The statistics as a Markdown table for the docs."""
    lines = [
        f"| {k} | `{s.name}` | {'share' if s.half is None else f'{s.half:g} {s.unit}'.strip()} | {s.meaning} |"
        for k, s in enumerate(STATISTICS)
    ]
    return "\n".join(["| | statistic | 0.5 stands for | meaning |", "|---|---|---|---|", *lines, ""])
