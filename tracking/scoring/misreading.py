"""Why few tracked people match labels, or not exactly: other columns, another scale, shifted frames, another sequence.

Boxes that other programs wrote as corners, as centres, or in pictures of another size are read as left, top, width,
height without an error, and score nearly 0. `likely_misreading` tries other readings of the same numbers on some
frames. A reading is an order of the columns, a factor for each axis, and a map of the frame numbers. It is judged by
the share of boxes that match a label by an IoU of at least 0.5. A position in m counts as a square of such a side that
two of them 1 m apart along an axis have an IoU of 0.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from functools import partial

import numpy as np

from sim.types import LENGTH_UNITS, Array, Bools, Ints, Tracks, Truth
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import FOUND, box_pairs

FEW = 0.2  # Share of matching boxes below which other readings are tried.
NONE = 0.02  # Share of matching boxes below which there is a warning, whatever is found.
CLEARLY = 0.3  # Share by which another reading must match more boxes.
ABOUT = 0.85  # A simpler reading is preferred if it matches at least this part of what another one does.
PAIRS = 20_000  # Most pairs of boxes that are looked at, unless one frame has more.
CLOSER, ENOUGH = 0.8, 50  # Tracks of so many boxes are some frames off if there 1 - IoU is below this part of it here.
SPREAD = 0.25  # Least ratio of the extents of both sides, lest positions that shrink to the origin match labels there.
SHIFTS = sorted((k for k in range(-10, 11) if k), key=abs)
RATES = (2, 3, 4, 5, 6, 10, 12, 15, 25, 30)
SCALES = (1 / 3, 0.5, 2 / 3, 0.75, 0.8, 1.25, 4 / 3, 1.5, 2.0, 2.25, 3.0, 4.0)
# Sides in px of square pictures that detectors stretch a picture to; 1: shares of the picture.
SQUARES = (1, 320, 416, 512, 608, 640, 768, 800, 960, 1000, 1024, 1280)
SIDE = 3.0  # Side in m of the square that stands for a position.

# A way to read the tracks: how far it is from the usual one, minus the share of boxes that match, what is done, remedy.
Reading = tuple[float, float, str, str]


def _from_corners(a: Array) -> Array:
    return np.concatenate([a[:, :2], a[:, 2:] - a[:, :2]], axis=1)


def _in_metres(columns: list[int], metres: float, a: Array) -> Array:
    return a[:, columns] * metres


# Left, top, width, height from four columns, or x, y in m from two, by the names of the columns in a header line. The
# first of four and of two are those of files without one.
BOX_ORDERS: dict[str, Callable[[Array], Array]] = {
    "left,top,width,height": lambda a: a,
    "x1,y1,x2,y2": _from_corners,
    "cx,cy,width,height": lambda a: np.concatenate([a[:, :2] - a[:, 2:] / 2, a[:, 2:]], axis=1),
    "y1,x1,y2,x2": lambda a: _from_corners(a[:, [1, 0, 3, 2]]),
    "x1,x2,y1,y2": lambda a: _from_corners(a[:, [0, 2, 1, 3]]),
    "top,left,height,width": lambda a: a[:, [1, 0, 3, 2]],
}
POSITION_ORDERS: dict[str, Callable[[Array], Array]] = {
    ",".join(axis + f"_{unit}" * (unit != "m") for axis in axes): partial(_in_metres, columns, metres)
    for unit, metres in LENGTH_UNITS.items()
    for axes, columns in (("xy", [0, 1]), ("yx", [1, 0]))
}


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


def likely_misreading(
    truth: Truth, tracks: SequenceOf[Tracks], size: tuple[int, int] | None = None, files: bool = True
) -> str:
    """Returns a warning if hardly any tracked person matches a label though both sides have people, or if people match
    labels of other frames, up to 10 away, more exactly, else "".

    size: width and height of the pictures, px, None if unknown. files: False if the tracks are arrays, for which the
    remedies of files are of no use.
    """
    sides = _comparable(truth, tracks)
    if sides is None:
        return ""
    true, est = sides
    share, found = 0.0, list[Reading]()
    together = np.intersect1d(true.rows.frame, est.rows.frame)
    if len(together):
        some = _some(together, true, est)
        share = _share(*some)
        if share >= FEW:
            return _shifted(true, some[1])
        found += _other_columns(*some, size, truth.px_per_m)
    found += _other_frames(true, est)
    most = max((-reading[1] for reading in found), default=0.0)
    good = [reading for reading in found if -reading[1] >= ABOUT * most and most >= share + CLEARLY]
    if not good and share >= NONE:
        return ""
    what = "positions match labels (1 m)" if est.values.shape[1] == 2 else "boxes match labels (IoU 0.5)"
    words = f"{share:.0%} of the tracked {what}"
    if not len(together):
        labels, numbers = (f"{side.rows.frame[0]} to {side.rows.frame[-1]}" for side in sides)
        words = f"no frame in common: labels in frames {labels}, tracks in frames {numbers}"
    if good:
        _, matching, done, remedy = min(good)
        remedy = remedy if files else "give frames, order and units of the columns as in the truth"
        return f"{words}; {done}, {-matching:.0%} would: {remedy}"
    tried = " No other usual columns, scale or shift of frames match better." if len(together) else ""
    return f"{words}.{tried} Unless the tracker fails, check the columns, and that these are tracks of this sequence"


def shifted_boxes(truth: Truth, frame: Ints, box: Array) -> str:
    """Returns a warning if detections lie on labels of up to 10 frames away more exactly, else "". frame (M,),
    ascending, box (M, 4), px: of detections of labelled people; the truth has boxes."""
    assert truth.box is not None
    true, est = Side(FrameRows(truth.frame, truth.id), truth.box), Side(FrameRows(frame, np.arange(len(frame))), box)
    return _shifted(true, _some(np.unique(frame), true, est)[1], "detections")


def _shifted(true: Side, est: Side, what: str = "tracks") -> str:
    """Returns a warning if the tracks lie on labels of up to 10 frames away more exactly, else "". true: all labels."""
    near = np.add.outer(np.unique(est.rows.frame), [0, *SHIFTS])
    true = true.keep(np.isin(true.rows.frame, near))
    now, best, words = _overlap(true, est), CLOSER, ""
    for k in SHIFTS:
        then = _overlap(true, Side(FrameRows(est.rows.frame + k, est.rows.id), est.values))
        both = np.isfinite(now + then)
        if both.sum() < ENOUGH:
            continue
        a, b = float(now[both].mean()), float(then[both].mean())
        if 1 - b < best * (1 - a):
            best = (1 - b) / (1 - a)
            words = f"mean IoU with labels {a:.2f}; with {k:+d} on their frame numbers the {what} have {b:.2f}"
    return words and f"{words}: number the frames of both alike, unless the {what} lag or lie beside the people"


def _overlap(true: Side, est: Side) -> Array:
    """Returns the greatest IoU of each of the S tracked boxes with a label, (S,); nan in frames without labels."""
    pairs = box_pairs(true.rows, est.rows, true.boxes, est.boxes)
    found = np.where(np.isin(est.rows.frame, true.rows.frame), 0.0, np.nan)
    np.maximum.at(found, pairs.j, pairs.s)
    return found


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


def _other_columns(true: Side, est: Side, size: tuple[int, int] | None, px_per_m: float) -> Iterator[Reading]:
    points = true.values.shape[1] == 2
    scales = [(s, s) for s in ((1.0, 1 / px_per_m) if points and px_per_m > 0 else (1.0, *SCALES))]
    if size is not None and not points:
        scales += [(size[0] / side, size[k] / side) for side in SQUARES for k in (0, 1)]
    extent = SPREAD * np.ptp(true.values, axis=0)
    for number, (name, order) in enumerate((POSITION_ORDERS if points else BOX_ORDERS).items()):
        for scale in scales:
            values = order(est.values) * np.tile(scale, true.values.shape[1] // 2)
            if points and (np.ptp(values, axis=0) < extent).any():
                continue
            share, done, remedies = _share(true, Side(est.rows, values)), list[str](), list[str]()
            if number:
                done.append(f"read as {name}")
                remedies.append(f"name all columns in a first line of the text: frame,id,{name},…")
            if scale != scales[0]:
                factor = ",".join(f"{s:.5g}" for s in dict.fromkeys(scale))
                done.append(f"multiplied by {factor}")
                remedies.append("give positions in m" if points else f"add --box-scale {factor} where boxes are read")
            yield min(number, 1) + 2 * (scale != scales[0]), -share, " and ".join(done), " and ".join(remedies)


def _other_frames(true: Side, est: Side) -> Iterator[Reading]:
    frame, labelled = est.rows.frame, true.rows.frame
    ends = {int(labelled[0] - frame[0]), int(labelled[-1] - frame[-1])}
    maps = {f"with {k:+d} on frame numbers": frame + k for k in sorted({*SHIFTS, *ends} - {0}, key=abs)}
    maps |= {f"with frames numbered 1, {1 + n}, {1 + 2 * n}, …": (frame - 1) * n + 1 for n in RATES}
    for words, numbers in maps.items():
        if 2 * ((numbers >= 1) & (numbers <= labelled[-1])).sum() >= len(frame):
            moved = Side(FrameRows(numbers, est.rows.id), est.values)
            sides = _some(np.intersect1d(labelled, numbers), true, moved)
            far = 1 - _overlap(*sides).sum() / max(len(sides[1].rows), 1)
            yield 1 + far / 1000, -_share(*sides), words, "number the frames of both alike"  # the closest of good ones
