"""What a tracker's run tells without any truth: the numbers that the environment observes and a policy works on.

Each statistic is about the frames since the last decision and lies in [0, 1]. A share is itself; another quantity
x >= 0 is x / (x + half), so that 0.5 stands for `half`. One that is not known is 0. All are computed from the frames
and the reported tracks alone, for any tracker.

Detections are compared with predictions: the places of the last frame's tracks, moved by their velocities. A detection
belongs to a track if each is the other's nearest, within REACH. Distances are in m; of boxes in heights of a person.
The normalised innovation squared (NIS) is the squared distance over the predicted variance of the track, by dimension;
the detection's own noise, which no tracker reports, is left out of it, so a large value need not mean a wrong model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.types import Array, Detections, Frame, Ints, Tracks

TWO_PEOPLE = 1.5  # least estimated size at which a group counts as two people
REACH = 1.0  # m, or heights of a person: furthest detection that belongs to a track
COMMON = 3  # fewest pairs of which a common movement is taken
BRIEF = 1.0  # s: tracks that end younger are brief


@dataclass(frozen=True)
class Statistic:
    """One number of the observation."""

    name: str
    half: float | None  # the value that 0.5 stands for, in `unit`; None for a share, which stands for itself
    unit: str  # such as "m/s", "" for plain numbers, "share" for shares
    meaning: str


STATISTICS = (
    Statistic("time", 20.0, "s", "frames so far, over their rate"),
    Statistic("since", 2.0, "s", "time since the last decision"),
    Statistic("rate", 10.0, "frames/s", "frames per second"),
    Statistic("observed", None, "share", "frames with a detection; from pixels, frames with a picture"),
    Statistic("detections", 10.0, "", "detections of a frame, mean over frames that have some"),
    Statistic("score_low", None, "share", "scores of the detections, 10 % quantile"),
    Statistic("score", None, "share", "scores of the detections, median"),
    Statistic("score_high", None, "share", "scores of the detections, 90 % quantile"),
    Statistic("tracks", 10.0, "", "tracks of a frame, mean"),
    Statistic("associated", None, "share", "detections that belong to a track"),
    Statistic("extra", 1.0, "", "detections of a frame that belong to no track, mean over frames that have some"),
    Statistic("found", None, "share", "tracks that have a detection, in frames that have some"),
    Statistic("coasting", None, "share", "tracks that the tracker says it only predicted, mean over frames"),
    Statistic("gap", 0.5, "s", "time since the last detection of a track, mean"),
    Statistic("residual", 0.1, "m or heights", "distance of a detection from its track's prediction, root mean square"),
    Statistic("nis", 1.0, "", "normalised innovation squared, median; without the tracker's covariances it is unknown"),
    Statistic("shift", 0.1, "m or heights", "movement common to all tracks beside the prediction, root mean square"),
    Statistic("births", 1.0, "per s", "new tracks, but for those of frame 1"),
    Statistic("deaths", 1.0, "per s", "tracks that ended"),
    Statistic("brief", None, "share", "ended tracks that were younger than 1 s"),
    Statistic("speed", 1.3, "m/s", "speed of the tracks, median"),
    Statistic("grouped", None, "share", "tracks in a group; of trackers of groups, groups of two people or more"),
    Statistic("regrouped", 1.0, "per s", "tracks whose group changes"),
)
NAMES = tuple(s.name for s in STATISTICS)


class Signals:
    """Collects frames and tracks between two decisions.

    State: of the last frame its tracks; by id when a track began, and when it last had a detection; lists, one entry a
    frame or a pair, since the last decision.
    """

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self._last: Tracks | None = None
        self._begun: dict[int, float] = {}
        self._found: dict[int, float] = {}
        self._clear()

    def _clear(self) -> None:
        self._tracks = list[Tracks]()
        self._count, self._scores = list[int](), list[Array]()
        self._pictures = self._belong = self._of = self._born = self._died = self._brief = 0
        self._moved, self._coasting = 0, list[float]()
        self._gaps, self._residuals, self._nis, self._shifts = (list[float]() for _ in range(4))

    def add(self, frame: Frame, tracks: Tracks) -> None:
        """Adds the next frame, as the tracker got it, and the tracks of this frame."""
        found, last = frame.detections, self._last
        self._pictures += frame.image is not None
        if found is not None:
            self._count.append(len(found.pos))
            self._scores.append(found.score if len(found.score) else np.ones(len(found.pos)))
        if found is not None and len(found.pos) and last is not None:
            self._compare(found, last, (frame.index - last.index) / self.fps, frame.t)
        now = frame.t
        here = {int(id) for id in tracks.id}
        for id in here - self._begun.keys():
            self._begun[id] = self._found[id] = now
            self._born += last is not None
        for id in self._begun.keys() - here:
            self._died += 1
            self._brief += now - self._begun.pop(id) < BRIEF
            del self._found[id]
        self._gaps += [now - self._found[id] for id in here]
        if len(tracks.seen):
            self._coasting.append(float(1.0 - tracks.seen.mean()))
        if last is not None:
            _, a, b = np.intersect1d(tracks.id, last.id, assume_unique=True, return_indices=True)
            self._moved += int(np.count_nonzero(tracks.group[a] != last.group[b]))
        self._last = tracks
        self._tracks.append(tracks)

    def _compare(self, found: Detections, last: Tracks, dt: float, now: float) -> None:
        places = _comparable(found, last, dt)
        if places is None:
            return
        seen, expected, variance = places
        self._of += len(expected)
        off = seen[:, None] - expected[None]
        far = np.hypot(off[..., 0], off[..., 1])
        row, column = _mutual(far)
        self._belong += len(row)
        for id in last.id[column].tolist():
            if id in self._found:
                self._found[id] = now
        self._residuals += np.square(far[row, column]).tolist()
        known = (variance[column] > 0).all(axis=1)
        with np.errstate(over="ignore"):  # a variance may come near 0
            self._nis += (np.square(off[row, column][known]) / variance[column][known]).mean(axis=1).tolist()
        if len(row) >= COMMON:
            common = np.median(off[row, column], axis=0)
            self._shifts.append(float(np.square(common).sum()))

    def statistics(self, px_per_m: float) -> NDArray[np.float32]:
        """Returns the statistics (K,) of the frames added since the last call, in the order of STATISTICS.

        The frames are then forgotten. Unknown statistics are 0. px_per_m: image scale; if it is nan or 0, the speed of
        tracks in the image is unknown.
        """
        values = self._values(px_per_m) if self._tracks else {}
        self._clear()
        return np.array([squashed(s, values.get(s.name, 0.0)) for s in STATISTICS], np.float32)

    def _values(self, px_per_m: float) -> dict[str, float]:
        tracks, span = self._tracks, len(self._tracks) / self.fps
        some, total = sum(n > 0 for n in self._count), sum(self._count)
        rows = sum(len(t.id) for t in tracks)
        values = {
            "time": tracks[-1].index / self.fps, "since": span, "rate": self.fps, "tracks": rows / len(tracks),
            "observed": (some if self._count else self._pictures) / len(tracks), "births": self._born / span,
            "deaths": self._died / span, "regrouped": self._moved / span, "grouped": _share_in_groups(tracks),
        }  # fmt: skip
        if self._died:
            values["brief"] = self._brief / self._died
        if some:
            low, middle, high = np.quantile(np.concatenate(self._scores), [0.1, 0.5, 0.9]).tolist()
            values |= {"detections": total / some, "score_low": low, "score": middle, "score_high": high}
            values["associated"] = self._belong / total
            values["extra"] = (total - self._belong) / some
        if self._of:
            values["found"] = self._belong / self._of
        for name, squares in (("residual", self._residuals), ("shift", self._shifts)):
            if squares:
                values[name] = float(np.sqrt(np.mean(squares)))
        for name, each, middle_of in (
            ("nis", self._nis, np.median), ("gap", self._gaps, np.mean), ("coasting", self._coasting, np.mean),
        ):  # fmt: skip
            if each:
                values[name] = float(middle_of(each))
        scale = px_per_m if tracks[-1].plane == "image" else 1.0
        speed = np.concatenate([np.hypot(t.vel[:, 0], t.vel[:, 1]) for t in tracks])
        known = np.isfinite(speed)
        return {**values, "speed": float(np.median(speed[known])) / scale} if scale > 0 and known.any() else values


def _comparable(found: Detections, last: Tracks, dt: float) -> tuple[Array, Array, Array] | None:
    """Returns places of detections (M, 2), predicted places of tracks (N, 2) and their variances (N, 2), in m or
    heights of a person; None if they have no place in common."""
    if last.unit != "person" or not len(last.id):
        return None
    move = np.nan_to_num(last.vel[:, :2] * dt)
    half = last.cov.shape[1] // 2
    var = last.cov[:, [0, 1], [0, 1]] + 2 * dt * last.cov[:, [0, 1], [half, half + 1]]
    var = var + dt * dt * last.cov[:, [half, half + 1], [half, half + 1]]
    var[(last.cov == np.eye(2 * half)).all(axis=(1, 2))] = np.nan  # the identity: not told
    if found.plane == last.plane:
        if last.plane == "image":
            tall = _height(last)
            return None if tall is None else (found.pos / tall, (last.pos + move) / tall, var / tall**2)
        return found.pos[:, :2], last.pos[:, :2] + move, var
    if found.box is None or last.box is None:
        return None
    tall = _height(last)
    if tall is None:
        return None
    seen, before = (each[:, :2] + each[:, 2:] / 2 for each in (found.box, last.box))
    return seen / tall, before / tall, np.full((len(before), 2), np.nan)


def _height(tracks: Tracks) -> float | None:
    known = None if tracks.box is None else tracks.box[:, 3][np.isfinite(tracks.box[:, 3])]
    return float(np.median(known)) if known is not None and len(known) and np.median(known) > 0 else None


def _mutual(far: Array) -> tuple[Ints, Ints]:
    """Returns rows and columns of the distances (M, N) that are least in both and at most REACH."""
    far = np.where(np.isfinite(far), far, np.inf)
    nearest, back = far.argmin(axis=1), far.argmin(axis=0)
    row = np.arange(len(far))
    kept = (back[nearest] == row) & (far[row, nearest] <= REACH)
    return row[kept], nearest[kept]


def _share_in_groups(tracks: list[Tracks]) -> float:
    if tracks[-1].unit == "group":
        size = np.concatenate([np.zeros(0), *(t.groups.size for t in tracks if t.groups is not None)])
        grouped = size[np.isfinite(size)] >= TWO_PEOPLE
    else:
        grouped = np.concatenate([t.group for t in tracks]) >= 0
    return float(grouped.mean()) if len(grouped) else 0.0


def squashed(statistic: Statistic, value: float) -> float:
    """Returns the value of a statistic mapped to [0, 1]: a share as it is, another value x as x / (x + half)."""
    if statistic.half is None:
        return value
    return 1.0 if value == math.inf else value / (value + statistic.half)
