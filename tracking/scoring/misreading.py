"""Why hardly any tracked person matches a label: other columns, another scale, shifted frames, or another sequence.

Boxes that other programs wrote as corners, as centres, or in pictures of another size are read as left, top, width,
height without an error, and score nearly 0. `likely_misreading` tries other readings of the same numbers on some
frames. A reading is an order of the columns, a factor for each axis, and a map of the frame numbers. It is judged by
the share of boxes that match a label by an IoU of at least 0.5. A position in m counts as a square of such a side that
two of them 1 m apart along an axis have an IoU of 0.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Literal

import numpy as np

from sim.types import Array, Bools, Ints, Tracks, Truth
from tracking.scoring.candidate_pairs import FOUND, box_pairs, same_frame
from tracking.scoring.rows import FrameRows

FEW = 0.2  # Share of matching boxes below which other readings are tried.

NONE = 0.02  # Share of matching boxes below which there is a warning, whatever is found.

CLEARLY = 0.3  # Share by which another reading must match more boxes.

ABOUT = 0.85  # A simpler reading is preferred if it matches at least this part of what another one does.

PAIRS = 20_000  # Most pairs of boxes that are looked at, unless one frame has more.

STEPS = 6  # Refinements of an estimated scale.

SHIFTS = (1, -1, 2, -2, 5, -5, 10, -10)
RATES = (2, 3, 4, 5, 6, 10, 12, 15, 25, 30)
SCALES = (1.0, 1 / 3, 0.5, 2 / 3, 0.75, 4 / 3, 1.5, 2.0, 3.0, 4.0)
UNITS = {0.01: "cm", 0.001: "mm", 0.3048: "ft"}  # Lengths in m that positions are given in by mistake.

# Sides in px of square pictures that detectors stretch a picture to; 1: shares of the picture.
SQUARES = (1, 320, 416, 512, 608, 640, 768, 800, 960, 1024, 1280)

SIDE = 3.0  # Side in m of the square that stands for a position.

# What the tracks are: a text of another program, arrays, or a run of ours, whose detections were read wrongly.
Given = Literal["text", "run", "arrays"]

Order = Callable[[Array], Array]


def _from_corners(a: Array) -> Array:
    return np.concatenate([a[:, :2], a[:, 2:] - a[:, :2]], axis=1)


# Left, top, width, height from four columns, by the names of the columns in a header line; the first is that of files
# without one.
BOX_ORDERS: dict[str, Order] = {
    "left,top,width,height": lambda a: a,
    "x1,y1,x2,y2": _from_corners,
    "cx,cy,width,height": lambda a: np.concatenate([a[:, :2] - a[:, 2:] / 2, a[:, 2:]], axis=1),
    "y1,x1,y2,x2": lambda a: _from_corners(a[:, [1, 0, 3, 2]]),
    "x1,x2,y1,y2": lambda a: _from_corners(a[:, [0, 2, 1, 3]]),
    "top,left,height,width": lambda a: a[:, [1, 0, 3, 2]],
}

POINT_ORDERS: dict[str, Order] = {"x,y": lambda a: a, "y,x": lambda a: a[:, ::-1]}


@dataclass(frozen=True)
class Side:
    """The people of the truth or of the tracks, R rows sorted by frame."""

    rows: FrameRows  # frame and id
    values: Array  # boxes (R, 4) in px, or positions (R, 2) in m

    @property
    def points(self) -> bool:
        """True if the values are positions."""
        return bool(self.values.shape[1] == 2)

    @property
    def boxes(self) -> Array:
        """The boxes, (R, 4), or the squares that stand for the positions."""
        return np.c_[self.values - SIDE / 2, np.full_like(self.values, SIDE)] if self.points else self.values

    @property
    def centres(self) -> Array:
        """The centres of the boxes, or the positions, (R, 2)."""
        return self.values if self.points else self.values[:, :2] + self.values[:, 2:] / 2

    def keep(self, mask: Bools) -> Side:
        """Returns the rows where the mask (R,) is true."""
        return Side(self.rows.keep(mask), self.values[mask])

    def within(self, frames: Ints) -> Side:
        """Returns the rows of these frames."""
        return self.keep(np.isin(self.rows.frame, frames))

    def read(self, order: Order, scale: tuple[float, float] = (1.0, 1.0)) -> Side:
        """Returns the rows with their columns in another order, and scaled."""
        values = order(self.values)
        return Side(self.rows, values * np.tile(scale, values.shape[1] // 2))

    def in_frames(self, frame: Ints) -> Side:
        """Returns the rows with other frame numbers (R,), sorted by them."""
        by_frame = np.argsort(frame, kind="stable")
        return Side(FrameRows(frame[by_frame], self.rows.id[by_frame]), self.values[by_frame])


@dataclass(frozen=True)
class Reading:
    """A way to read the tracks, and how well it matches."""

    columns: str  # their order, by names of a header line
    scale: tuple[float, float] = (1.0, 1.0)  # factors of x and y
    frames: str = ""  # how the frames are numbered, in words; "" as they are
    labels: bool = False  # the labels are read so, not the tracks
    simple: bool = False  # the scale follows from the size of the pictures
    share: float = 0.0  # of boxes that match

    @property
    def effort(self) -> int:
        """How far the reading is from the usual one; the lower, the simpler."""
        other = self.columns not in ("left,top,width,height", "x,y")
        scaled = 0 if self.scale == (1.0, 1.0) else 2 if self.scale[0] == self.scale[1] or self.simple else 4
        return bool(self.frames) + other + scaled + self.labels


def likely_misreading(
    truth: Truth, tracks: SequenceOf[Tracks], *, size: tuple[int, int] | None = None, given: Given = "text"
) -> str:
    """Returns a warning if hardly any tracked person matches a label though both sides have people, else "".

    size: width and height of the pictures, px, None if unknown. given: what the tracks are, for the remedy.
    """
    sides = _comparable(truth, tracks)
    if sides is None:
        return ""
    true, est = sides
    usual = Reading("x,y" if true.points else "left,top,width,height")
    together = np.intersect1d(true.rows.frame, est.rows.frame)
    found: list[Reading] = []
    if len(together):
        a, b = _some(together, true, est)
        usual = replace(usual, share=_share(a, b))
        if usual.share >= FEW:
            return ""
        found += _other_orders(a, b)
        found += _other_scales(a, b, size)
    found += _other_frames(true, est, usual)
    best = _simplest(found, usual.share)
    if best is None and usual.share >= NONE:
        return ""
    what = "positions" if true.points else "boxes"
    words = f"{usual.share:.0%} of the tracked {what} match labels ({'1 m' if true.points else 'IoU 0.5'})"
    if not len(together):
        words = f"no frame in common: labels in frames {_span(true)}, tracks in frames {_span(est)}"
    if best is not None:
        return f"{words}; {_words(best)}, {best.share:.0%} would. {_remedy(best, usual, size, given)}"
    tried = " No other columns, scale or shift of frames match better." if len(together) else ""
    check = "the detections that were tracked" if given == "run" else "the columns"
    return f"{words}.{tried} Check {check}, and that these are tracks of this very sequence"


def _comparable(truth: Truth, tracks: SequenceOf[Tracks]) -> tuple[Side, Side] | None:
    some = [t for t in tracks if len(t.id)]
    if not len(truth.frame) or not some or some[0].unit == "group":
        return None
    frame, id = np.repeat([t.index for t in some], [len(t.id) for t in some]), np.concatenate([t.id for t in some])
    boxes = [t.box for t in some if t.box is not None]
    labels, rows = FrameRows(truth.frame, truth.id), FrameRows(frame, id)
    if truth.box is not None and len(boxes) == len(some):
        sides = Side(labels, truth.box), Side(rows, np.concatenate(boxes))
    elif truth.pos is not None and some[0].plane != "image":
        sides = Side(labels, truth.pos), Side(rows, np.concatenate([t.pos[:, :2] for t in some]))
    else:
        return None
    true, est = (side.keep(np.asarray(np.isfinite(side.values).all(axis=1))) for side in sides)
    return (true, est) if len(true.rows) and len(est.rows) else None


def _some(frames: Ints, true: Side, est: Side) -> tuple[Side, Side]:
    a, b = (np.searchsorted(s.rows.frame, [frames, frames + 1]) for s in (true, est))
    pairs = int(((a[1] - a[0]) * (b[1] - b[0])).sum())
    chosen = frames[:: max(1, -(-pairs // PAIRS))]
    return true.within(chosen), est.within(chosen)


def _share(true: Side, est: Side) -> float:
    pairs = box_pairs(true.rows, est.rows, true.boxes, est.boxes)
    near = pairs.s >= FOUND
    matched = min(len(np.unique(pairs.i[near])), len(np.unique(pairs.j[near])))
    return matched / max(min(len(true.rows), len(est.rows)), 1)


def _other_orders(true: Side, est: Side) -> Iterator[Reading]:
    _, *others = (POINT_ORDERS if true.points else BOX_ORDERS).items()
    for name, order in others:
        yield Reading(name, share=_share(true, est.read(order)))
        yield Reading(name, labels=True, share=_share(true.read(order), est))


def _other_scales(true: Side, est: Side, size: tuple[int, int] | None) -> Iterator[Reading]:
    for name, order in (POINT_ORDERS if true.points else BOX_ORDERS).items():
        plain = est.read(order)
        if (plain.boxes[:, 2:] <= 0).any(axis=1).mean() > FEW:
            continue
        starts = [np.full(2, s) for s in (UNITS if true.points else SCALES)]
        starts.append(_length(true) / np.maximum(_length(plain), 1e-12))
        starts += [np.array(size, float)] if size is not None and not true.points else []
        readings = [_scaled(true, plain, Reading(name), _refined(true, plain, start)) for start in starts]
        yield _rounded(true, plain, max(readings, key=lambda r: r.share), size)


def _length(side: Side) -> Array:
    return np.asarray(np.median(np.abs(side.values[:, -2:]), axis=0))


def _scaled(true: Side, est: Side, reading: Reading, scale: Array) -> Reading:
    factors = float(scale[0]), float(scale[1])
    return replace(reading, scale=factors, share=_share(true, est.read(lambda a: a, factors)))


def _refined(true: Side, est: Side, scale: Array) -> Array:
    """Returns the scale (2,) after some steps that each fit the nearer half of the pairs of nearest boxes best."""
    portions = list(same_frame(est.rows.frame, true.rows.frame))
    j, i = (np.concatenate([p[k] for p in portions]) for k in (0, 1))
    a, b = true.centres[i], est.centres[j]
    side, first = true.boxes[i, 2:], np.flatnonzero(np.diff(j, prepend=-1))
    for _ in range(STEPS):
        apart = (((a - scale * b) / side) ** 2).sum(axis=1)
        least = np.minimum.reduceat(apart, first)
        limit = np.repeat(np.minimum(least, np.median(least)), np.diff(first, append=len(j)))
        near = apart <= limit
        fitted = (a[near] * b[near]).sum(axis=0) / np.maximum((b[near] ** 2).sum(axis=0), 1e-12)
        scale = np.where(fitted > 0, fitted, scale)
    return scale


def _rounded(true: Side, est: Side, found: Reading, size: tuple[int, int] | None) -> Reading:
    one = float(np.sqrt(found.scale[0] * found.scale[1]))
    simple = [(u, u) for u in UNITS] if true.points else []
    simple += [(f, f) for f in (float(Fraction(one).limit_denominator(4)), one)]
    simple += [] if size is None else [(size[0] / side, size[1] / side) for side in SQUARES]
    for scale in simple:
        near = all(abs(s / f - 1) < 0.05 for s, f in zip(scale, found.scale, strict=True))
        reading = _scaled(true, est, found, np.array(scale)) if near else found
        if near and reading.share >= ABOUT * found.share:
            return replace(reading, simple=True)
    return found


def _other_frames(true: Side, est: Side, usual: Reading) -> Iterator[Reading]:
    frame, labelled = est.rows.frame, true.rows.frame
    ends = {int(labelled[0] - frame[0]), int(labelled[-1] - frame[-1])}
    maps = {f"{k:+d}": frame + k for k in sorted({*SHIFTS, *ends} - {0}, key=abs)}
    maps |= {f"1, {1 + n}, {1 + 2 * n}, …": (frame - 1) * n + 1 for n in RATES}
    maps["id"] = est.rows.id
    found = []
    for words, numbers in maps.items():
        inside = (numbers >= 1) & (numbers <= labelled[-1])
        moved = est.keep(inside).in_frames(numbers[inside])
        common = np.intersect1d(labelled, moved.rows.frame)
        if len(common) and 2 * inside.sum() >= len(frame):
            found.append(replace(usual, frames=words, share=_share(*_some(common, true, moved))))
    most = max((r.share for r in found), default=0.0)
    yield from [r for r in found if r.share >= ABOUT * most][:1]


def _simplest(found: list[Reading], share: float) -> Reading | None:
    most = max((r.share for r in found), default=0.0)
    good = [r for r in found if r.share >= ABOUT * most and most >= share + CLEARLY]
    return min(good, key=lambda r: (r.effort, -r.share), default=None)


def _span(side: Side) -> str:
    return f"{side.rows.frame[0]} to {side.rows.frame[-1]}"


def _factor(scale: tuple[float, float]) -> str:
    return ",".join(f"{s:.5g}" for s in (scale[:1] if scale[0] == scale[1] else scale))


def _words(best: Reading) -> str:
    if best.frames == "id":
        return "with ids in column 1 and frames in column 2"
    if best.frames:
        return f"with frames numbered {best.frames}" if "," in best.frames else f"with {best.frames} on frame numbers"
    parts = [] if best.columns in ("left,top,width,height", "x,y") else [f"read as {best.columns}"]
    parts += [] if best.scale == (1.0, 1.0) else [f"multiplied by {_factor(best.scale)}"]
    return f"{'with labels ' if best.labels else ''}{' and '.join(parts)}"


def _remedy(best: Reading, usual: Reading, size: tuple[int, int] | None, given: Given) -> str:
    if best.frames and best.frames != "id":
        return "Number the frames of both alike"
    if given == "arrays":
        return f"Give {'x,y in m' if usual.columns == 'x,y' else 'left, top, width, height in px'}, as of the truth"
    text = "the labels" if best.labels else "the text that was tracked" if given == "run" else "the tracks"
    points, parts = usual.columns == "x,y", []
    unit = UNITS.get(best.scale[0]) if points else None
    columns = best.columns if unit is None else ",".join(f"{axis}_{unit}" for axis in best.columns.split(","))
    if best.frames or columns != usual.columns:
        first = "id,frame" if best.frames else "frame,id"
        parts.append(f"name all columns in a first line of {text}: {first},{columns},…")
    if best.scale != (1.0, 1.0) and points and unit is None:
        parts.append(f"give the positions of {text} in m")
    elif best.scale != (1.0, 1.0) and not points:
        command = " to `flockscope track`" if given == "run" else ""
        parts.append(f"add --box-scale {_factor(best.scale)}{command}{_made(best, size)}")
    words = " and ".join(parts)
    return words[0].upper() + words[1:]


def _made(best: Reading, size: tuple[int, int] | None) -> str:
    if size is None:
        return ""
    width, height = (side / factor for side, factor in zip(size, best.scale, strict=True))
    return " (shares of the picture)" if width < 2 else f" (boxes of pictures of {width:.0f} × {height:.0f})"
