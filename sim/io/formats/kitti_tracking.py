"""Reader for texts of KITTI's tracking benchmark: labels, or results of a tracker.

Lines have 17 cells apart by blanks: frame (from 0), id, type, truncated, occluded, alpha, left, top, right, bottom in
px, and the size, place and rotation of a body before a camera that drives; results have a score as the 18th. People
are of the types in PEOPLE, and are read with their boxes; rows of other types are left out.
"""

from __future__ import annotations

from itertools import islice
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import DETECTIONS, FRAMES
from sim.io.files.numeric_text import NumericTable, crowded, is_number_text, read_text
from sim.io.formats.labels import require_size
from sim.io.formats.mot_table import MotTable
from sim.io.formats.mot_text import sequence_of_table
from sim.io.formats.options import RecordingOptions
from sim.types import Sequence

FPS = 10.0
CELLS = (17, 18)
PEOPLE = ("Pedestrian", "Person", "Person_sitting")
LAYOUT = "frame id type truncated occluded alpha left top right bottom …"


def is_kitti_tracking(path: Path) -> bool:
    """Returns True if the first line of a text has KITTI's cells: numbers, but a word as the third."""
    cells = next((line.split() for line in islice(read_text(path).splitlines(), 1000) if line.strip()), [])
    return len(cells) in CELLS and [is_number_text(cell) for cell in cells[:4]] == [True, True, False, True]


def open_text(path: Path, options: RecordingOptions) -> Sequence:
    """Returns a text as Sequence with truth in the image, without pictures and detections."""
    return sequence_of_table(_table(path), path, options.fps or FPS, "kitti tracking", options.scale)


def _table(path: Path) -> MotTable:
    numbered = [(k, line.split()) for k, line in enumerate(read_text(path).splitlines(), 1) if line.strip()]
    for number, cells in numbered:
        if len(cells) not in CELLS or not all(map(is_number_text, [*cells[:2], *cells[6:10]])):
            raise InputError(
                file=path, place=f"line {number}", got=" ".join(cells)[:80], expected=f"{CELLS[0]} cells, {LAYOUT}",
                remedy="correct or remove the line",
            )  # fmt: skip
    people = [(k, cells) for k, cells in numbered if cells[2] in PEOPLE]
    if not people:
        got = ", ".join(sorted({cells[2] for _, cells in numbered}))
        raise InputError(file=path, got=got, expected=" or ".join(PEOPLE), remedy="give labels of people")
    values = np.array([[*cells[:2], *cells[6:10]] for _, cells in people], float)
    rows = NumericTable(path, values, np.array([k for k, _ in people]), LAYOUT)
    frame, id, box = rows.integers(0, "frame") + 1, rows.integers(1, "id"), values[:, 2:].copy()
    rows.reject((frame < 1) | (frame > FRAMES), f"frames from 0, at most {FRAMES}", "correct the frame")
    rows.reject(crowded(frame), f"at most {DETECTIONS} people in a frame", "correct or remove the line")
    rows.reject((box[:, 2:] <= box[:, :2]).any(axis=1), "left < right and top < bottom", "correct the box")
    require_size(path, int(frame.max()), id)
    box[:, 2:] -= box[:, :2]
    return MotTable(rows, frame, id, box, np.ones((len(id), 1)))
