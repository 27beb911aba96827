"""Reader for texts of people that are not MOTChallenge's: TrajNet++, ETH and UCY, PedPy and JuPedSim, KITTI's tracking.

TrajNet++ (*.ndjson) has a JSON object a line: {"scene": {…, "fps": 2.5}} or {"track": {"f", "p", "x", "y"}}. ETH and
UCY texts, as Social GAN and others distribute them, have `frame id x y`, separated by tabs or blanks, at 2.5 per s. In
both, frames are numbers of video frames in steps, and are counted from 1 as in BIWI. PedPy and JuPedSim texts have
lines `id frame x y z …` below comments: one states the rate, `# framerate: 8.00`, and one may state a unit, as `x/cm`.
These are positions on the ground in m.

KITTI's labels, or results of a tracker, have 17 cells apart by blanks: frame (from 0), id, type, truncated, occluded,
alpha, left, top, right, bottom in px, and the size, place and rotation of a body before a camera that drives; results
have a score as the 18th. People are of the type Pedestrian, and are read with their boxes. Labels that KITTI's own
evaluation does not count are unscored: seated persons, people who are truncated or heavily occluded, regions DontCare.
"""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import FRAME_RATES, is_number
from scenarios.reading import parse_json
from sim.arrays import repeated_ids
from sim.store.numeric_text import CORRECT, LARGEST, NumericTable, number_or_nan, read_rows, read_text, rows_among
from sim.store.recorded_sequence import recorded_sequence
from sim.types import LENGTH_UNITS, Bools, Sequence, Truth, Unscored
from tracking.recordings.biwi import frame_numbers
from tracking.recordings.mot_table import SECONDS, reject_swapped, table_of_rows
from tracking.recordings.mot_text import frame_rate, truth_of_table
from tracking.recordings.options import Classes, RecordingOptions

NDJSON = ".ndjson"
ETH_FPS = 2.5
STEPS = (4, 24)  # least and greatest number of video frames from label to label at ETH_FPS, of 10 to 60 per second
FRAMERATE = re.compile(r"framerate[^\w+-]*([-+]?\d[\d.]*(?:,\d+)?)", re.IGNORECASE)
PEDPY = re.compile(r"#.*framerate|#\s*(id|persid)\s+(frame|fr)\b", re.IGNORECASE)

KITTI_FPS = 10.0
KITTI_CELLS = (17, 18)
KITTI_LAYOUT = "frame id type truncated occluded alpha left top right bottom …"
PEDESTRIANS = ("pedestrian",)
ALIKE = {"pedestrian": ("person", "person_sitting"), "car": ("van",)}  # by class, types that are its distractors
REGION = "dontcare"
MOST_TRUNCATED, MOST_OCCLUDED = 0, 2  # levels up to which a label is scored
MIN_HEIGHT = 25.0  # px: tracks on nobody of at most this height are left out

Words = np.ndarray[tuple[int], np.dtype[np.str_]]
# rows with the columns of a MOTChallenge text, and the frames per second that the text states
People = tuple[NumericTable, float | None]


def layout_of(path: Path) -> str | None:
    """Returns the key of LAYOUTS for a text, by its ending, comments or first line; None if none fits."""
    if path.suffix.lower() == NDJSON:
        return "trajnet"
    lines = read_text(path).splitlines()
    if any(PEDPY.match(line) for line in lines[:1000]):
        return "pedpy"
    first = next((k for k, line in enumerate(lines) if line.strip() and line[:1] != "#"), 0)
    cells = next(iter(rows_among(path, lines[: first + 1], heading=True).text), "").split()
    numbers = [not math.isnan(number_or_nan(cell)) for cell in cells[:4]]
    if len(cells) == 4 and all(numbers):
        return "eth"
    return "kitti" if len(cells) in KITTI_CELLS and numbers == [True, True, False, True] else None


def open_text(layout: str, path: Path, options: RecordingOptions) -> Sequence:
    """Returns a text as Sequence with truth, without pictures and detections. layout: as of `layout_of`."""
    rows, stated = LAYOUTS[layout](path, options.fps)
    reject(not len(rows.line), path, "no row", "people with frame, id, x and y", "restore it")
    rate = frame_rate(options.fps, stated, "trajectories", ETH_FPS)
    return _sequence(path, rows, rate, int(rows.values[:, 0].max()), options, None)


def _sequence(
    path: Path, rows: NumericTable, rate: float, length: int, options: RecordingOptions, unscored: Unscored | None
) -> Sequence:
    table = table_of_rows(rows)
    rows.reject(table.id < 0, "ids from 0", "correct the id")
    reject_swapped(rows)

    def truth() -> Truth:
        return truth_of_table(table, path.stem, rate, length, options.scale).replace(unscored=unscored)

    source = {"kind": "people text", "path": str(path), **options.box_options.given()}
    return recorded_sequence(source, path.stem, rate, length, load_truth=truth, px_per_m=options.scale)


def _counted(rows: NumericTable, fps: float | None) -> NumericTable:
    """Returns rows `frame, id, x, y` with the frames of a video counted from 1. fps: None if nothing states it."""
    first = np.sort(np.unique(rows.values, axis=0, return_index=True)[1])
    if len(first) < len(rows.line):
        said = f"{len(rows.line) - len(first)} rows stand there twice, as in scenes that overlap; each is read once"
        warnings.warn(f"{rows.file}: {said}", stacklevel=4)
        rows = rows.keep(first)
    raw, id = rows.integers(0, "frame", SECONDS), rows.integers(1, "id")
    scenes = "if these are scenes with frames or ids of their own, write each into a file of its own"
    rows.reject(repeated_ids(raw, id), "each id once in a frame", scenes, scenes)
    steps = np.diff(np.unique(raw))
    step = int(np.median(steps)) if len(steps) else STEPS[0]
    low, high = STEPS
    expected = f"steps of {low} to {high}, as of a video of which {ETH_FPS:g} frames per second are labelled"
    got, remedy = f"frames in steps of {step}", "give --fps, rows of a person per second"
    reject(fps is None and not STEPS[0] <= step <= STEPS[1], rows.file, got, expected, remedy, "--fps")
    return replace(rows, values=np.column_stack([frame_numbers(raw, id), rows.values[:, 1:]]))


def _read_eth(path: Path, fps: float | None) -> People:
    return _counted(read_rows(path).numbers((4,), layout="frame id x y"), fps), None


def _read_pedpy(path: Path, fps: float | None) -> People:
    comments = "\n".join(line for line in read_text(path).splitlines() if line.startswith("#"))
    rates = {rate.rstrip(".") for rate in FRAMERATE.findall(comments)}
    values = {number_or_nan(rate) for rate in rates}
    stated = values.pop() if len(values) == 1 else None
    expected, got = "frames per second from {:g} to {:g}".format(*FRAME_RATES), " and ".join(sorted(rates)) or "none"
    reject(not is_number(fps or stated, *FRAME_RATES), path, got, expected, "correct it, or give --fps", "# framerate")
    rows = read_rows(path).numbers(range(4, 13), layout="id frame x y z")
    raw = rows.integers(1, "frame")
    words = "_".join(re.findall(r"[^\W_]+", comments.lower())) + "_"
    units = [unit for form in ("x", "in") for unit in LENGTH_UNITS if f"_{form}_{unit}_" in words]
    pos = rows.values[:, 2:4] * LENGTH_UNITS[units[0] if units else "m"]
    return replace(rows, values=np.column_stack([raw - raw.min(initial=LARGEST) + 1, rows.values[:, 0], pos])), stated


def _read_ndjson(path: Path, fps: float | None) -> People:
    text, kept, rows, rates = read_rows(path), list[int](), list[list[float]](), set[float]()
    is_place = partial(is_number, low=-LARGEST, high=LARGEST)
    for number, line in zip(text.line.tolist(), text.text, strict=True):
        match _json(path, number, line):
            case {"track": {"f": f, "p": p, "x": x, "y": y}} if all(map(is_place, (f, p, x, y))):
                rows.append([f, p, x, y])
                kept.append(number)
            case {"scene": {"fps": rate}} if is_number(rate, *FRAME_RATES):
                if not rates <= {rate}:
                    raise _bad(path, number, f"fps {rate:g}", f"{rates.pop():g}, as in earlier scenes")
                rates.add(float(rate))
            case {"scene": dict() as scene} if "fps" not in scene:
                pass
            case _:
                expected = '{"track": {"f", "p", "x", "y"}} of numbers, or {"scene": {…, "fps"}}'
                raise _bad(path, number, line.strip()[:80], expected)
    values, stated = np.array(rows, np.float64).reshape(-1, 4), next(iter(rates), None)
    return _counted(NumericTable(path, values, np.array(kept, np.int64), "f, p, x, y"), fps or stated), stated


def _json(path: Path, number: int, line: str) -> object:
    try:
        return parse_json(line, path)
    except InputError as error:
        raise _bad(path, number, error.got, "a JSON object") from None


def _bad(path: Path, number: int, got: object, expected: str) -> InputError:
    return InputError(file=path, place=f"line {number}", got=got, expected=expected, remedy=CORRECT)


LAYOUTS = {"trajnet": _read_ndjson, "eth": _read_eth, "pedpy": _read_pedpy}


def open_kitti(path: Path, options: RecordingOptions) -> Sequence:
    """Returns a text of KITTI's labels as Sequence with truth, in which `Unscored` follows KITTI's evaluation.

    The classes of `options.box_options`, by default pedestrian, are people.
    """
    classes = options.box_options.person_class or PEDESTRIANS
    rows, kinds = _kitti_rows(path, classes)
    named, (truncated, occluded) = np.isin(kinds, classes), rows.values[:, 6:].T.astype(np.int64)
    people = named & (truncated <= MOST_TRUNCATED) & (occluded <= MOST_OCCLUDED)
    alike = np.isin(kinds, [kind for each in classes for kind in ALIKE.get(each, ())])
    distractor, region = (named | alike) & ~people, kinds == REGION
    rows.reject(distractor & (rows.values[:, 1] < 0), "ids from 0", "correct the id")
    order = np.flatnonzero(distractor | region)
    order = order[np.argsort(rows.values[order, 0], kind="stable")]
    frame = rows.values[:, 0].astype(np.int64)
    unscored = Unscored(frame[order], rows.values[order, 2:6], distractor[order], region[order], MIN_HEIGHT)
    rate = frame_rate(options.fps, KITTI_FPS)
    return _sequence(path, _kept(rows, people), rate, int(frame.max()), options, unscored)


def kitti_tracks(path: Path, person_class: Classes | None) -> NumericTable:
    """Returns the rows of a text of tracks that are of these classes, by default pedestrians, as those of
    MOTChallenge."""
    classes = person_class or PEDESTRIANS
    rows, kinds = _kitti_rows(path, classes)
    return _kept(rows, np.isin(kinds, classes))


def _kitti_rows(path: Path, classes: Classes) -> tuple[NumericTable, Words]:
    """Returns rows frame (from 1), id, left, top, width, height, truncated, occluded, and the types in lower case.

    Many recordings of KITTI have no pedestrians, or no cars: this gives a warning. Raises InputError if no row has one
    of other classes.
    """
    text = read_rows(path)
    rows = text.numbers(KITTI_CELLS, layout=KITTI_LAYOUT, use=[0, 1, 3, 4, 6, 7, 8, 9])
    rows.reject(rows.values[:, 0] < 0, "frames from 0", "correct the frame")
    frame, id, levels, corner, far = np.hsplit(rows.values, (1, 2, 4, 6))
    rows = replace(rows, values=np.hstack([frame + 1, id, corner, far - corner, levels]))
    rows.integers(0, "frame")
    kinds = np.array([word.lower() for word in text.words(2)], np.str_)
    if len(kinds) and not np.isin(kinds, classes).any():
        found, wanted = ", ".join(np.unique(kinds).tolist()), " or ".join(classes)
        reject(not {*classes} <= ALIKE.keys(), path, found, wanted, "name some of these", "--class")
        warnings.warn(f"{path}: no {wanted}, only {found} (--class names others)", stacklevel=4)
    return rows, kinds


def _kept(rows: NumericTable, mask: Bools) -> NumericTable:
    return replace(rows, values=rows.values[mask, :6], line=rows.line[mask])
