"""BIWI walking pedestrians (Pellegrini 2009): obsmat.txt, groups.txt.

obsmat.txt: `frame id x z y vx vz vy` in m and m/s (y up is called z there and is 0); raw frames come every `step`
video frames, with gaps where nobody was annotated. groups.txt: the ids of one group per line, for their whole life.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from sim.io.files.numeric_text import NumericTable, read_numbers, read_text
from sim.io.formats.group_labels import labelled_truth_fields
from sim.types import Frame, Ints, Sequence, Truth

FPS = 2.5


def frame_numbers(raw: Ints) -> Ints:
    """1-based frames round((raw - first) / step) + 1, with the most frequent step between raw frames."""
    steps = np.diff(np.unique(raw))
    if len(steps) == 0:
        return np.ones(len(raw), np.int64)
    values, counts = np.unique(steps, return_counts=True)
    step = int(values[np.argmax(counts)])
    return np.asarray(np.round((raw - raw.min()) / step), np.int64) + 1


def read_groups(path: Path) -> dict[int, int]:
    """Person id → label (1, 2, … in the order of the lines). An id listed twice in a line counts once; a line of one
    person is no group; lines that share a person are one group, with a warning."""
    label: dict[int, int] = {}
    for number, line in enumerate(read_text(path).splitlines(), 1):
        members = set(_ids(path, number, line))
        if len(members) < 2:
            continue
        earlier = {label[m] for m in members if m in label}
        name = min(earlier, default=max(label.values(), default=0) + 1)
        if earlier:
            warnings.warn(
                f"{path}: line {number}: shares a person with an earlier line; taken as one group", stacklevel=2
            )
        for person in [p for p, g in label.items() if g in earlier] + sorted(members):
            label[person] = name
    return label


def _ids(path: Path, number: int, line: str) -> list[int]:
    try:
        values = [float(word) for word in line.replace(",", " ").split()]
        if all(v == round(v) for v in values):
            return [int(v) for v in values]
    except (ValueError, OverflowError):
        pass
    raise InputError(
        file=path, place=f"line {number}", got=line.strip(), expected="ids of people", remedy="correct the line"
    )


def _table(folder: Path) -> tuple[NumericTable, Ints, Ints]:
    """obsmat.txt sorted by (frame, id), its slots and ids."""
    rows = read_numbers(folder / "obsmat.txt", (8, 8))
    frame, id = frame_numbers(rows.integers(0, "frame")), rows.integers(1, "id")
    rows.reject(id < 0, "ids from 0", "correct the id")
    order = np.lexsort((id, frame))
    twice = np.zeros(len(order), bool)
    twice[order[1:]] = (np.diff(frame[order]) == 0) & (np.diff(id[order]) == 0)
    rows.reject(twice, "each id once in a frame", "remove one of the two lines")
    return NumericTable(rows.file, rows.values[order], rows.line[order]), frame[order], id[order]


def read_truth(folder: Path, fps: float = FPS) -> Truth:
    """The recording as truth on the ground; groups as labelled, hulls and events by sim.truth.group_hulls."""
    rows, frame, id = _table(folder)
    pos, vel = rows.values[:, (2, 4)], rows.values[:, (5, 7)]
    length = int(frame.max(initial=0))
    truth = Truth(
        name=folder.name, fps=fps, length=length, px_per_m=float("nan"), frame=frame, id=id,
        group=np.full(len(id), -1, np.int64), pos=pos, vel=vel, box=None, visibility=np.ones(len(id)),
        z=np.zeros(len(id)), labelled=np.zeros(length, bool),
    )  # fmt: skip
    if not (folder / "groups.txt").is_file():
        return truth
    names = read_groups(folder / "groups.txt")
    label = np.array([names.get(int(i), -1) for i in id], np.int64)
    return truth.replace(group=label, **labelled_truth_fields(frame, id, label, pos, vel, fps=fps, length=length))


def open_folder(folder: Path, *, fps: float | None = None) -> Sequence:
    """A BIWI folder as Sequence: positions on the ground, no boxes, no pixels."""
    rate = FPS if fps is None else fps
    length = int(_table(folder)[1].max(initial=0))

    def frames() -> Iterator[Frame]:
        return (Frame(index, (index - 1) / rate) for index in range(1, length + 1))

    return Sequence(
        name=folder.name, fps=rate, length=length, frames=frames, load_truth=lambda: read_truth(folder, rate),
        source={"kind": "biwi", "path": str(folder)},
    )  # fmt: skip
