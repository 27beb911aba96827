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
NEAR = 0.05  # A unit or a rounded scale is tried if it differs from the fitted one by at most this share of it.
STEPS = 6  # Refinements of an estimated scale.
SHIFTS = (1, -1, 2, -2, 5, -5, 10, -10)
RATES = (2, 3, 4, 5, 6, 10, 12, 15, 25, 30)
SCALES = (1 / 3, 0.5, 2 / 3, 0.75, 4 / 3, 1.5, 2.0, 3.0, 4.0)
UNITS = {0.01: "cm", 0.001: "mm", 0.3048: "ft"}  # Lengths in m that positions are given in by mistake.
# Sides in px of square pictures that detectors stretch a picture to; 1: shares of the picture.
SQUARES = (1, 320, 416, 512, 608, 640, 768, 800, 960, 1024, 1280)
SIDE = 3.0  # Side in m of the square that stands for a position.

# What the tracks are: a text of another program, arrays, or a run of ours, whose detections were read wrongly.
Given = Literal["text", "run", "arrays"]
Scale = tuple[float, float]


def _from_corners(a: Array) -> Array:
    return np.concatenate([a[:, :2], a[:, 2:] - a[:, :2]], axis=1)


# Left, top, width, height from four columns, or x, y from two, by the names of the columns in a header line. The first
# of four and of two are those of files without one.
ORDERS: dict[str, Callable[[Array], Array]] = {
    "left,top,width,height": lambda a: a,
    "x1,y1,x2,y2": _from_corners,
    "cx,cy,width,height": lambda a: np.concatenate([a[:, :2] - a[:, 2:] / 2, a[:, 2:]], axis=1),
    "y1,x1,y2,x2": lambda a: _from_corners(a[:, [1, 0, 3, 2]]),
    "x1,x2,y1,y2": lambda a: _from_corners(a[:, [0, 2, 1, 3]]),
    "top,left,height,width": lambda a: a[:, [1, 0, 3, 2]],
    "x,y": lambda a: a,
    "y,x": lambda a: a[:, ::-1],
}
USUAL = {4: "left,top,width,height", 2: "x,y"}  # By the number of columns.


@dataclass(frozen=True)
class Side:
    """The people of the truth or of the tracks, R rows sorted by frame."""

    rows: FrameRows  # frame and id
    values: Array  # boxes (R, 4) in px, or positions (R, 2) in m

    @property
    def boxes(self) -> Array:
        """The boxes, (R, 4), or the squares that stand for the positions."""
        square = self.values.shape[1] == 2
        return np.c_[self.values - SIDE / 2, np.full_like(self.values, SIDE)] if square else self.values

    def keep(self, mask: Bools) -> Side:
        """Returns the rows where the mask (R,) is true."""
        return Side(self.rows.keep(mask), self.values[mask])

    def read(self, columns: str, scale: Scale = (1.0, 1.0)) -> Side:
        """Returns the rows with their columns in another order, and scaled."""
        return Side(self.rows, ORDERS[columns](self.values) * np.tile(scale, self.values.shape[1] // 2))


@dataclass(frozen=True)
class Reading:
    """A way to read the tracks, and how well it matches."""

    columns: str  # their order, by names of a header line
    scale: Scale = (1.0, 1.0)  # factors of x and y
    frames: str = ""  # how the frames are numbered, in words; "" as they are
    labels: bool = False  # the labels are read so, not the tracks
    effort: int = 0  # how far the reading is from the usual one; the lower, the simpler
    share: float = 0.0  # of boxes that match


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
    usual = Reading(USUAL[est.values.shape[1]])
    together = np.intersect1d(true.rows.frame, est.rows.frame)
    found: list[Reading] = []
    if len(together):
        a, b = _some(together, true, est)
        usual = replace(usual, share=_share(a, b))
        if usual.share >= FEW:
            return ""
        found += _other_columns(a, b, size)
    found += _other_frames(true, est, usual)
    best = _simplest(found, usual.share)
    if best is None and usual.share >= NONE:
        return ""
    what, near = ("positions", "1 m") if usual.columns == "x,y" else ("boxes", "IoU 0.5")
    words = f"{usual.share:.0%} of the tracked {what} match labels ({near})"
    if not len(together):
        labels, numbers = (f"{side.rows.frame[0]} to {side.rows.frame[-1]}" for side in sides)
        words = f"no frame in common: labels in frames {labels}, tracks in frames {numbers}"
    if best is not None:
        return f"{words}; {_words(best)}, {best.share:.0%} would. {_remedy(best, usual, given)}"
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
    return true.keep(np.isin(true.rows.frame, chosen)), est.keep(np.isin(est.rows.frame, chosen))


def _share(true: Side, est: Side) -> float:
    pairs = box_pairs(true.rows, est.rows, true.boxes, est.boxes)
    near = pairs.s >= FOUND
    matched = min(len(np.unique(pairs.i[near])), len(np.unique(pairs.j[near])))
    return matched / max(min(len(true.rows), len(est.rows)), 1)


def _other_columns(true: Side, est: Side, size: tuple[int, int] | None) -> Iterator[Reading]:
    points = true.values.shape[1] == 2
    known = [] if points else [(s, s) for s in SCALES]
    known += [] if size is None or points else [(size[0] / side, size[1] / side) for side in SQUARES]
    for name in [name for name in ORDERS if (name in ("x,y", "y,x")) == points]:
        other, plain = int(name not in USUAL.values()), est.read(name)
        if other:
            yield Reading(name, effort=1, share=_share(true, plain))
            yield Reading(name, labels=True, effort=2, share=_share(true.read(name), est))
        fitted = _fitted_scale(true, plain)
        one = float(Fraction(float(np.sqrt(fitted[0] * fitted[1]))).limit_denominator(4))
        near = [(s, s) for s in [*(UNITS if points else ()), one] if np.allclose(s, fitted, rtol=NEAR, atol=0.0)]
        for effort, scale in [*((2, s) for s in [*known, *near]), (4, fitted)]:
            yield Reading(name, scale, effort=other + effort, share=_share(true, est.read(name, scale)))


def _fitted_scale(true: Side, est: Side) -> Scale:
    """Returns the scale after some steps that each fit the nearer half of the pairs of nearest boxes best."""
    portions = list(same_frame(est.rows.frame, true.rows.frame))
    j, i = (np.concatenate([p[k] for p in portions]) for k in (0, 1))
    a, b = (side.boxes[k, :2] + side.boxes[k, 2:] / 2 for side, k in ((true, i), (est, j)))
    first, most = np.flatnonzero(np.diff(j, prepend=-1)), np.array([1e-12, 1e-12])
    length, own = (np.median(np.abs(side.values[:, -2:]), axis=0) for side in (true, est))
    scale = length / np.maximum(own, most)
    for _ in range(STEPS):
        apart = (((a - scale * b) / true.boxes[i, 2:]) ** 2).sum(axis=1)
        least = np.minimum.reduceat(apart, first)
        near = apart <= np.repeat(np.minimum(least, np.median(least)), np.diff(first, append=len(j)))
        fitted = (a[near] * b[near]).sum(axis=0) / np.maximum((b[near] ** 2).sum(axis=0), most)
        scale = np.where(fitted > 0, fitted, scale)
    return float(scale[0]), float(scale[1])


def _other_frames(true: Side, est: Side, usual: Reading) -> Iterator[Reading]:
    frame, labelled = est.rows.frame, true.rows.frame
    ends = {int(labelled[0] - frame[0]), int(labelled[-1] - frame[-1])}
    maps = {f"{k:+d}": frame + k for k in sorted({*SHIFTS, *ends} - {0}, key=abs)}
    maps |= {f"1, {1 + n}, {1 + 2 * n}, …": (frame - 1) * n + 1 for n in RATES}
    maps["id"] = est.rows.id
    for words, numbers in maps.items():
        order = np.argsort(numbers, kind="stable")
        order = order[(numbers[order] >= 1) & (numbers[order] <= labelled[-1])]
        moved = Side(FrameRows(numbers[order], est.rows.id[order]), est.values[order])
        common = np.intersect1d(labelled, moved.rows.frame)
        if len(common) and 2 * len(order) >= len(frame):
            yield replace(usual, frames=words, effort=1, share=_share(*_some(common, true, moved)))


def _simplest(found: list[Reading], share: float) -> Reading | None:
    most = max((r.share for r in found), default=0.0)
    good = [r for r in found if r.share >= ABOUT * most and most >= share + CLEARLY]
    first = next((r for r in good if r.frames), None)
    return min([r for r in good if r is first or not r.frames], key=lambda r: (r.effort, -r.share), default=None)


def _factor(scale: Scale) -> str:
    return ",".join(f"{s:.5g}" for s in (scale[:1] if scale[0] == scale[1] else scale))


def _words(best: Reading) -> str:
    if best.frames == "id":
        return "with ids in column 1 and frames in column 2"
    if best.frames:
        return f"with frames numbered {best.frames}" if "," in best.frames else f"with {best.frames} on frame numbers"
    parts = [] if best.columns in USUAL.values() else [f"read as {best.columns}"]
    parts += [] if best.scale == (1.0, 1.0) else [f"multiplied by {_factor(best.scale)}"]
    return f"{'with labels ' if best.labels else ''}{' and '.join(parts)}"


def _remedy(best: Reading, usual: Reading, given: Given) -> str:
    if best.frames and best.frames != "id":
        return "Number the frames of both alike"
    points, parts = usual.columns == "x,y", []
    if given == "arrays":
        return f"Give {'x,y in m' if points else 'left, top, width, height in px'}, as of the truth"
    text = "the labels" if best.labels else "the text that was tracked" if given == "run" else "the tracks"
    unit = UNITS.get(best.scale[0]) if points else None
    columns = best.columns if unit is None else ",".join(f"{axis}_{unit}" for axis in best.columns.split(","))
    if best.frames or columns != usual.columns:
        first = "id,frame" if best.frames else "frame,id"
        parts.append(f"name all columns in a first line of {text}: {first},{columns},…")
    if best.scale != (1.0, 1.0) and unit is None:
        add = f"add --box-scale {_factor(best.scale)}{' to `flockscope track`' if given == 'run' else ''}"
        parts.append(f"give the positions of {text} in m" if points else add)
    words = " and ".join(parts)
    return words[0].upper() + words[1:]
