"""Counts per interval of time: people, groups and events, crossings of lines, and who enters, leaves or is in zones.

Only observed frames count. An interval without any has unknown counts, no zeros; rates and means are per observed time.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scenarios.errors import reject
from sim.types import Array, Bools, Ints
from tracking.export.places import LINE, Passages, Places, depth, passages
from tracking.export.table_options import MINUTE, TableOptions

# Margin round lines and edges of zones, m: the radius of a footprint. Someone who has crossed stands wholly beyond.
MARGIN = 0.25
# Standard deviations of a position that the margin is at least: a compromise of errors that last for some time, as a
# tracker's, and errors that are new in each frame, which need more (`python -m benchmarks counts` has both).
SIGMAS = 2.5


@dataclass(frozen=True, eq=False)
class CountedRows:
    """What is counted.

    Attributes:
        fps: Frames per second; frame 1 is at time 0.
        observed: Frames (F,) in which people were looked for, ascending.
        frame: Frame (R,) of each row of a person, and `id` (R,) the person; in any order.
        pos: Positions (R, 2 or more), m or px.
        sigma: Standard deviation (R,) of each position on an axis, in the same unit; nan if unknown.
        seen: Flags (R,): False for positions that are only predicted. These are on no side of a place.
        unit: Unit of the positions, "m" or "px".
        metre: Length of 1 m in this unit; nan if unknown.
    """

    fps: float
    observed: Ints
    frame: Ints
    id: Ints
    pos: Array
    sigma: Array
    seen: Bools
    unit: str
    metre: float


class PlaceCounts:
    """Who passes the places of a sequence, and who is inside; computed once, for several tables.

    State: `frame`, `id` and `pos` of the rows with finite positions, sorted by (id, frame); `found`, the `Passages` of
    each place by name.
    """

    def __init__(self, rows: CountedRows, places: Places, options: TableOptions) -> None:
        order = np.lexsort((rows.frame, rows.id))
        order = order[np.isfinite(rows.pos[order, :2]).all(axis=1)]
        self.fps, self.options, self.places = rows.fps, options, places
        self.frame, self.id, self.pos = rows.frame[order], rows.id[order], rows.pos[order, :2]
        self.found: dict[str, Passages] = {}
        if not places:
            return
        reject(
            not rows.metre > 0, "", "positions in px, without their scale", "pixels per metre, for their margin",
            "give --px-per-m", "--line, --zone",
        )  # fmt: skip
        margin = np.full(len(order), (MARGIN if options.margin is None else options.margin) * rows.metre)
        if options.margin is None:
            margin = np.fmax(margin, SIGMAS * rows.sigma[order])
        for name, corners in places.items():
            self._warn_if_outside(name, corners, rows.unit)
            most = np.inf if len(corners) == LINE else depth(corners) / 2  # in a small zone there is room to be inside
            beyond = np.where(rows.seen[order], np.minimum(margin, most), np.inf)
            self.found[name] = passages(self.id, self.pos, corners, beyond, rows.unit == "px")

    def _warn_if_outside(self, name: str, corners: Array, unit: str) -> None:
        if not len(self.pos):
            return
        low, high = self.pos.min(axis=0), self.pos.max(axis=0)
        if ((corners.max(axis=0) < low) | (corners.min(axis=0) > high)).any():
            area = " and ".join(f"{k} from {a:.4g} to {b:.4g}" for k, a, b in zip("xy", low, high, strict=True))
            warnings.warn(f"{name} lies outside all positions, which have {area} {unit}", stacklevel=2)

    def is_line(self, name: str) -> bool:
        """Returns True if the place is a line, False if it is a zone."""
        return len(self.places[name]) == LINE

    def crossings(self) -> dict[str, Any]:
        """Returns the columns of a table with one row for each passage between start and end, by place and time."""
        end = math.inf if self.options.end is None else self.options.end
        columns: dict[str, Any] = {"place": [], "direction": [], "id": [], "frame": []}
        for name, found in self.found.items():
            order = np.lexsort((self.id[found.row], self.frame[found.row]))
            row, forward = found.row[order], found.forward[order]
            time = (self.frame[row] - 1) / self.fps
            kept = (time > self.options.start - 1e-9) & (time < end - 1e-9)
            words = ("to_left", "to_right") if self.is_line(name) else ("enter", "leave")
            columns["place"] += [name] * int(kept.sum())
            columns["direction"] += [words[0] if ahead else words[1] for ahead in forward[kept].tolist()]
            columns["id"] += self.id[row[kept]].tolist()
            columns["frame"] += self.frame[row[kept]].tolist()
        columns |= {key: np.array(columns[key], np.int64) for key in ("id", "frame")}
        return {**columns, "t_s": (columns["frame"] - 1) / self.fps}

    def dwell(self, people: Ints) -> dict[str, Array]:
        """Returns for each zone the seconds (N,) that each of the people was seen inside. people (N,): ids, sorted."""
        who = np.searchsorted(people, self.id)
        return {
            f"{name}_dwell_s": np.bincount(who, found.inside, len(people)) / self.fps
            for name, found in self.found.items()
            if not self.is_line(name)
        }


class Intervals:
    """Successive intervals of time, and sums over each; `start` and `end` (K,) in s, `frames` (K,) observed."""

    def __init__(self, rows: CountedRows, options: TableOptions) -> None:
        fps, last = rows.fps, float(rows.observed[-1] / rows.fps) if len(rows.observed) else 0.0
        reject(
            options.every * fps < 1 - 1e-9, "", f"{options.every:g} s", f"one frame, {1 / fps:.3g} s, or longer",
            "write 10s or 1m", "--every",
        )  # fmt: skip
        reject(
            options.start > 0 and options.start >= last, "", f"{options.start:g} s",
            f"a time before the end of what was observed, {last:g} s", "begin earlier", "--start",
        )  # fmt: skip
        end = last if options.end is None else min(last, options.end)
        self.options, self.fps = options, fps
        number = np.arange(max(0, math.ceil((end - options.start) / options.every - 1e-9)))
        self.start = options.start + number * options.every
        self.end = np.minimum(options.start + (number + 1) * options.every, end)
        self.stop = end
        self.frames = self.sums(rows.observed)

    def __len__(self) -> int:
        return len(self.start)

    def of(self, frame: Ints) -> Ints:
        """Returns the number of the interval of each frame, -1 for frames before the first or after the last."""
        time = (frame - 1) / self.fps
        number = np.floor((time - self.options.start) / self.options.every + 1e-9).astype(np.int64)
        return np.where((number >= 0) & (time < self.stop - 1e-9) & (number < len(self)), number, -1)

    def sums(self, frame: Ints) -> Ints:
        """Returns the number (K,) of the rows in each interval; frame: of each row."""
        return np.bincount(self.of(frame) + 1, minlength=len(self) + 1)[1:]

    def distinct(self, frame: Ints, id: Ints) -> Ints:
        """Returns the number (K,) of different ids in each interval. frame, id: of each row."""
        pairs = np.unique(np.stack([self.of(frame), id], axis=1), axis=0)
        return np.bincount(pairs[:, 0] + 1, minlength=len(self) + 1)[1:]


def counted_or_unknown(count: Ints, frames: Ints) -> Any:
    """Returns counts (K,) of intervals, masked where no frame was observed."""
    return np.ma.MaskedArray(count, frames == 0) if (frames == 0).any() else count


def mean_or_unknown(total: Array | Ints, number: Array | Ints) -> Array:
    """Returns total / number (K,), nan where the number is 0."""
    return np.where(number > 0, total / np.maximum(number, 1e-9), np.nan)


def place_columns(counted: PlaceCounts, intervals: Intervals) -> dict[str, Any]:
    """Returns the columns of the table `counts` that belong to places."""
    columns: dict[str, Any] = {}
    frames = intervals.frames
    minutes = frames / intervals.fps / MINUTE
    for name, found in counted.found.items():
        words = ("to_left", "to_right") if counted.is_line(name) else ("enter", "leave")
        for word, rows in zip(words, (found.row[found.forward], found.row[~found.forward]), strict=True):
            number = intervals.sums(counted.frame[rows])
            columns[f"{name}_{word}"] = counted_or_unknown(number, frames)
            columns[f"{name}_{word}_per_min"] = mean_or_unknown(number, minutes)
        if not counted.is_line(name):
            frame, id = counted.frame[found.inside], counted.id[found.inside]
            people, seen = intervals.distinct(frame, id), intervals.sums(frame)
            columns[f"{name}_people"] = counted_or_unknown(people, frames)
            columns[f"{name}_people_mean"] = mean_or_unknown(seen, frames)
            columns[f"{name}_dwell_mean_s"] = mean_or_unknown(seen / intervals.fps, people)
    return columns


def interval_counts(
    rows: CountedRows, counted: PlaceCounts, groups: Mapping[str, Ints] | None, events: Ints
) -> dict[str, Any]:
    """Returns the columns of the table `counts`: how many people, groups and events are in each interval.

    groups: "listed", the frames with known groups, and of each group in each frame "frame" and "id"; None: not known.
    events: the first frame of each event.
    """
    intervals = Intervals(rows, counted.options)
    frames = intervals.frames
    order = np.lexsort((rows.frame, rows.id))
    first = rows.frame[order][np.unique(rows.id[order], return_index=True)[1]]
    columns: dict[str, Any] = {
        "minute": np.floor(intervals.start / MINUTE + 1e-9).astype(np.int64),
        "t_start_s": intervals.start, "t_end_s": intervals.end, "observed_s": frames / rows.fps,
        "people": counted_or_unknown(intervals.distinct(rows.frame, rows.id), frames),
        "people_new": counted_or_unknown(intervals.sums(first), frames),
        "people_mean": mean_or_unknown(intervals.sums(rows.frame), frames),
    }  # fmt: skip
    if groups is not None:
        listed = intervals.sums(groups["listed"])
        columns["groups"] = counted_or_unknown(intervals.distinct(groups["frame"], groups["id"]), listed)
        columns["groups_mean"] = mean_or_unknown(intervals.sums(groups["frame"]), listed)
    columns["events"] = counted_or_unknown(intervals.sums(events), frames)
    return columns | place_columns(counted, intervals)
