"""Reader for BIWI walking pedestrians (Pellegrini 2009): the files obsmat.txt and groups.txt of a folder.

obsmat.txt has lines `frame id x z y vx vz vy` in m and m/s; its z is the height, which is 0. Its frames are numbers of
video frames, annotated at a fixed step (2.5 per s), with gaps where nobody was there. groups.txt has one group per
line, as ids that belong together for the whole recording. The results are a Truth and a Sequence without pictures,
whose frames count the annotated ones from 1.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from scenarios.errors import InputError, reject
from scenarios.limits import FRAME_RATES
from scenarios.reading import is_present
from sim.arrays import repeated_ids
from sim.store.numeric_text import CORRECT, NumericTable, person_ids, read_rows
from sim.store.recorded_sequence import recorded_sequence
from sim.truth.velocities import differentiate
from sim.types import Ints, Sequence, Truth
from tracking.recordings.labelled_truth import warn_of_places, with_labels
from tracking.recordings.options import NO_OPTIONS, RecordingOptions

FPS = 2.5

LABELS = 5  # lines `id label`, with a label in several, that are not taken for pairs of people


def frame_numbers(raw: Ints, id: Ints | None = None) -> Ints:
    """Returns the frames, from 1, of raw video frame numbers (N,): round((raw - first) / step) + 1, halves up.

    first: the lowest number. step: the most frequent difference of neighbouring distinct numbers. id (N,): the person
    of each row; None: unknown. If a person would have two rows in one frame, these rows get different frames.
    """
    distinct, row = np.unique(raw, return_inverse=True)
    steps = np.diff(distinct)
    if len(steps) == 0:
        return np.ones(len(raw), np.int64)
    values, counts = np.unique(steps, return_counts=True)
    step = int(values[np.argmax(counts)])
    slot = (2 * (distinct - distinct[0]) + step) // (2 * step) + 1
    if id is not None and repeated_ids(slot[row], id).any():
        slot = _parted(slot, [set(p.tolist()) for p in np.split(id[np.argsort(row)], np.cumsum(np.bincount(row))[:-1])])
    return np.asarray(slot[row], np.int64)


def _parted(slot: Ints, people: list[set[int]]) -> Ints:
    parted = slot.copy()
    here, raised = people[0], False
    for k in range(1, len(slot)):
        last = int(parted[k - 1])
        # Where a recording changes between two grids that are shifted by a part of a step, the later frame with a
        # person in common gets the next number, and so do the ones after it, up to the next gap; none moves by more
        # than one.
        if slot[k] <= last and (raised or here & people[k]):
            parted[k] = max(min(last + 1, int(slot[k]) + 1), last)
        raised = bool(parted[k] > slot[k])
        here = people[k] | here if parted[k] == last else people[k]
    return parted


def read_groups(path: Path) -> dict[int, int]:
    """Returns by person id the group label that a groups.txt gives each person; people alone have no entry."""
    label: dict[int, int] = {}
    lines = read_rows(path)
    _reject_labels(path, list(lines.cells()))
    for number, line in zip(lines.line, lines.text, strict=True):
        members = person_ids(path, f"line {number}", line)
        if len(members) < 2:
            continue
        earlier = {label[m] for m in members if m in label}
        name = min(earlier, default=max(label.values(), default=0) + 1)
        # Lines that share a person become one group, with the lowest label.
        if earlier:
            text = f"{path}: line {number}: shares a person with an earlier line; taken as one group"
            warnings.warn(text, stacklevel=2)
        for person in [p for p, g in label.items() if g in earlier] + sorted(members):
            label[person] = name
    return label


def _reject_labels(path: Path, rows: list[list[str]]) -> None:
    """Raises InputError if each row seems to hold the id of a person and the label of a group."""
    people, labels = ({row[k] for row in rows} for k in (0, -1))
    if len(rows) >= LABELS and all(len(row) == 2 for row in rows) and len(people) == len(rows) > len(labels):
        got, expected = f"two numbers in all {len(rows)} lines, with labels in the second place", "the ids of one group"
        remedy = "write all ids of a group on one line; or name the columns of the people, and add a column group"
        raise InputError(file=path, place="each line", got=got, expected=expected, remedy=remedy)


def labels_of(path: Path, id: Ints) -> Ints:
    """Returns the group labels (N,) of people id (N,) by the groups in `path`; -1 = alone."""
    names = read_groups(path)
    known = [names[person] for person in set(id.tolist()) if person in names]
    if names and len(id) and len(known) == len(set(known)):
        warnings.warn(f"{path}: no two people of this recording are in one of its groups: check the ids", stacklevel=3)
    return np.array([names.get(i, -1) for i in id.tolist()], np.int64)


def _table(folder: Path) -> tuple[NumericTable, Ints, Ints]:
    """Returns (rows of obsmat.txt, our frames (R,), person ids (R,)), sorted by (frame, id)."""
    path = folder / "obsmat.txt"
    rows = read_rows(path).numbers((8,), layout="frame id x z y vx vz vy")
    reject(not len(rows.line), path, "no line", "people: frame id x z y vx vz vy", "restore it")
    raw, id = rows.integers(0, "frame"), rows.integers(1, "id")
    rows.reject(id < 0, "ids from 0", "correct the id")
    frame = frame_numbers(raw, id)
    rows.require_bounds(frame)
    rows.reject(repeated_ids(frame, id), "each id once in a frame, also where frames are nearer than a step", CORRECT)
    order = np.lexsort((id, frame))
    return rows.keep(order), frame[order], id[order]


def _rate(rows: NumericTable, frame: Ints, id: Ints) -> float:
    """Returns FPS, or with a warning the multiple or part of it at which people are as fast as their velocities."""
    step = np.hypot(*differentiate(frame, id, rows.values[:, (2, 4)], 1.0).T)  # m per frame; 0: alone, or at rest
    way, told = step.sum(), np.hypot(*rows.values[:, (5, 7)].T)[step > 0].sum()  # told: m per s
    ratio = float(np.clip(told / way, *FRAME_RATES)) / FPS if told and way else 1.0
    rate = FPS * round(ratio) if ratio > 1 else FPS / round(1 / ratio)
    if rate != FPS:
        text = f"{rows.file}: by its velocities it has {rate:.4g} frames per second, and not {FPS:g}"
        warnings.warn(f"{text} (--fps says otherwise)", stacklevel=3)
    return rate


def open_folder(folder: Path, options: RecordingOptions = NO_OPTIONS) -> Sequence:
    """Returns the recording in `folder` as Sequence, without pictures and detections, by default at 2.5 fps.

    Groups of its truth are those of groups.txt in all frames. Without that file everybody is alone, and no frame counts
    as labelled.
    """
    rows, frame, id = _table(folder)
    rate, length = options.fps or _rate(rows, frame, id), int(frame.max(initial=0))

    def truth() -> Truth:
        people = Truth(
            name=folder.name, fps=rate, length=length, px_per_m=float("nan"), frame=frame, id=id,
            group=np.full(len(id), -1, np.int64), pos=rows.values[:, (2, 4)], vel=rows.values[:, (5, 7)], box=None,
            visibility=np.ones(len(id)), z=np.zeros(len(id)), labelled=np.zeros(length, bool),
        )  # fmt: skip
        # by the rate: the velocities of the file say nothing of --fps
        warn_of_places(folder, people.replace(vel=differentiate(frame, id, rows.values[:, (2, 4)], rate)))
        groups = folder / "groups.txt"
        return with_labels(people, labels_of(groups, id)) if is_present(groups) else people

    return recorded_sequence({"kind": "biwi", "path": str(folder)}, folder.name, rate, length, load_truth=truth)
