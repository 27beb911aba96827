"""Boxes of a detector in a file of their own, put on the pictures of a video or of another sequence.

The file is a MOT text (det.txt), a table whose first line names its columns, or the JSON of COCO results: a list of
objects with image_id (the frame, from 1), category_id, bbox [left, top, width, height] and score. A table may have
times in place of frames: each belongs to the nearest frame.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import is_number
from scenarios.reading import parse_json
from sim.store.numeric_text import NumericTable, read_text
from sim.types import Array, Frame, Ints, Sequence
from tracking.recordings import mot_text
from tracking.recordings.mot_table import read_table, table_of_rows
from tracking.recordings.options import NO_OPTIONS, BoxOptions

COLUMNS = "frame (image_id), -1, left, top, width, height, score, class (category_id)"
SAME = 1e-3  # s: boxes of one picture have times that differ by at most this.
HALF = 0.5 + 1e-6  # frames: a time belongs to a frame that is so near; times may be rounded.
OUTSIDE = 1.1  # Boxes that end farther right or lower than this share of the picture are of another picture size.


def with_boxes(sequence: Sequence, path: Path, options: BoxOptions = NO_OPTIONS.box_options) -> Sequence:
    """Returns the sequence with the boxes of a file as its detections, which replace those that it had.

    Raises InputError if the file cannot be read, has no boxes, or does not fit the sequence's frames and pictures.
    """
    if path.suffix.lower() == ".json":
        table = table_of_rows(_coco_results(path), box_scale=options.box_scale, boxless=False)
    else:
        frames_at = partial(_frames_at, path, sequence)
        table = read_table(path, box_scale=options.box_scale, frames_at=frames_at, px_per_m=1.0)
    mot_text.require_classes(table, options.person_class)
    found = mot_text.detections_of_table(table, options)
    reject(not len(found.frame), path, "no box", "the boxes of a detector", "check the file")
    # Boxes may be numbered like picture files that are counted otherwise.
    origin, step = sequence.source.get("numbering", (1, 1))
    before, rest = np.divmod(found.frame - origin, step)
    if found.frame.max() > (sequence.length or np.inf) and not rest.any() and before.min() >= 0:
        found = replace(found, frame=before + 1)
    if found.plane != "image" or found.box is None:
        raise InputError(file=path, got="points", expected="boxes, px", remedy="give the detector's boxes")
    last = int(found.frame.max())
    expected = f"at most {sequence.length}, the frames of {sequence.name}"
    remedy = "give the boxes of this recording; frames count from 1"
    reject(sequence.length is not None and last > sequence.length, path, f"frame {last}", expected, remedy)
    if sequence.image_size is not None:
        far = np.quantile(found.box[:, :2] + found.box[:, 2:], 0.95, axis=0)
        got, remedy = "boxes that end at {:.0f}, {:.0f} px".format(*far), "if they are of another size, --box-scale"
        expected = "boxes in pictures of {} × {} px".format(*sequence.image_size)
        reject((far > OUTSIDE * np.array(sequence.image_size)).any(), path, got, expected, remedy)

    def joined(frames: Callable[[], Iterator[Frame]]) -> Iterator[Frame]:
        for frame in frames():
            yield frame.replace(detections=replace(found.at(frame.index, sequence.fps), t=frame.t))

    bare, source = sequence.bare, {**sequence.source, "boxes": str(path)}
    return replace(
        sequence, frames=lambda: joined(sequence.frames), bare=None if bare is None else lambda: joined(bare),
        has_detections=True, load_owners=None, source=source,
    )  # fmt: skip


def _frames_at(path: Path, sequence: Sequence, seconds: Array, _: Array) -> Ints:
    """Returns the frames (N,) from 1 of times (N,): the nearest within half a frame, 0 if none or of a nearer time."""
    times = np.array([frame.t for frame in sequence.without_pictures()])
    k = np.searchsorted((times[1:] + times[:-1]) / 2, seconds)
    away = np.abs(seconds - times[k])
    # Pictures that the detector saw between two frames would give a person two boxes in one frame.
    order = np.lexsort((seconds, away, k))
    frames, first = np.unique(k[order], return_index=True)
    nearest = seconds[order[first]][np.searchsorted(frames, k)]
    near = away <= HALF / sequence.fps
    fits = near & (np.abs(seconds - nearest) <= SAME)
    out = f"{(~fits).sum()} of {len(fits)} boxes have times of no frame, or of one that has nearer ones"
    if len(near) and near.mean() < 0.5:
        got = f"{seconds.min():g} to {seconds.max():g} s: {out}"
        expected = f"times of {len(times)} frames, {times[0]:g} to {times[-1]:g} s"
        remedy = "give seconds since the first frame, and the recording's --fps"
        raise InputError(file=path, place="times", got=got, expected=expected, remedy=remedy)
    if not fits.all():
        warnings.warn(f"{path}: {out}, and are left out", stacklevel=2)
    return np.where(fits, k + 1, 0)


def _coco_results(path: Path) -> NumericTable:
    """Returns frame, -1, left, top, width, height, score and category of each result."""
    results = parse_json(read_text(path), path, "check the file")
    remedy = "give the detector's results, with image_id, category_id, bbox and score"
    reject(not isinstance(results, list), path, "no list", "a list of COCO results", remedy)
    rows = [_row(path, k, each) for k, each in enumerate(results, 1)]
    values = np.array(rows, np.float64).reshape(-1, 8)
    return NumericTable(path, values, np.arange(1, len(rows) + 1), COLUMNS, unit="result")


def _row(path: Path, number: int, result: Any) -> tuple[float, ...]:
    match result:
        case {"image_id": frame, "category_id": category, "bbox": [x, y, w, h], "score": score}:
            row = (frame, -1, x, y, w, h, score, category)
            if all(map(is_number, row)):
                return row
    got, remedy = json.dumps(result)[:80], "correct the result"
    expected = "image_id (a frame, from 1), category_id, bbox [left, top, width, height] and score, numbers"
    raise InputError(file=path, place=f"result {number}", got=got, expected=expected, remedy=remedy)
