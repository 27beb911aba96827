"""Decides which rows of a MOTChallenge text are people, by class (column 8) and flag (column 7), and which distractors.

A distractor looks like a person: people on vehicles (class 2), static people (7), other distractors (8), reflections
(12), and in MOT20 vehicles without a motor (6). The benchmark leaves a track on a distractor out of the scores. Which
tracks lie on distractors follows from a matching with all labelled rows, so the other unscored rows are kept, too.
"""

from __future__ import annotations

import warnings

import numpy as np

from scenarios.errors import InputError
from sim.io.formats.mot_ground import has_ground
from sim.io.formats.mot_table import GROUND_COLUMNS, MotTable
from sim.types import Array, Bools, Unscored

DISTRACTORS = (2, 7, 8, 12)  # classes of distractors from MOT16 on

MOT20 = "MOT20"  # begins the names of MOT20's sequences

MOT20_DISTRACTORS = (*DISTRACTORS, 6)

# columns after the box in labels of MOTChallenge: flag, class, visibility. More columns have other classes.
LABEL_COLUMNS = 3

CLASSES = range(1, 14)  # classes of MOTChallenge. A text with another class has classes of its own, and no distractors.


def unscored_rows(table: MotTable, people: Bools, name: str, person_class: int | None) -> Unscored | None:
    """Returns the labelled rows beside `people` (N,), sorted by frame; None if no distractor is among them."""
    found = classes_of(table, person_class is not None)
    if (
        found is None
        or table.rest.shape[1] > LABEL_COLUMNS
        or person_class not in (None, PEDESTRIAN)
        or not np.isin(found, CLASSES).all()
    ):
        return None
    mot20 = any(each.startswith(MOT20) for each in (name, table.rows.file.resolve().parent.parent.name))
    distractor = np.isin(found, MOT20_DISTRACTORS if mot20 else DISTRACTORS)
    rows = np.flatnonzero(~people & (table.id >= 0) & ~table.without_box())
    if not distractor[rows].any():
        return None
    rows = rows[np.argsort(table.frame[rows], kind="stable")]
    return Unscored(table.frame[rows], table.box[rows], distractor[rows])


PEDESTRIAN = 1  # class of a person from MOT16 on

LABELS = "gt.txt"  # name of a text of labels. Its column 7 is a flag; that of another text may be a confidence.

LAST_CLASS = 100  # greatest class of the usual sets of classes; COCO has up to 91

SHOWN = 8  # most values that a message lists


def labelled_people(table: MotTable, person_class: int | None) -> Bools:
    """Returns flags (N,) of rows that are people: an id from 0, another flag than 0, the right class.

    person_class: the class of people; None: 1, with a warning about rows of other classes.
    """
    keep, file = np.asarray(table.id >= 0), table.rows.file
    if len(keep) and not keep.any():
        raise InputError(
            file=file, place="column 2", got=f"negative ids in all {len(keep)} rows", expected="ids from 0",
            remedy="give each person an id",
        )  # fmt: skip
    flag = table.rest[:, 0] if table.rest.shape[1] else np.ones(len(keep))
    # Column 7 of another text may be a confidence.
    if file.name == LABELS or (np.isin(flag, (0, 1, -1)).all() and flag.any()):
        keep &= flag != 0
        if len(keep) and not keep.any():
            raise InputError(
                file=file, place="column 7", got=f"0 in all {len(keep)} rows, which leaves nobody",
                expected="another flag than 0 for people", remedy="write 1 in column 7 of rows that count",
            )  # fmt: skip
    elif (flag == 0).all() and len(keep):
        text = f"{file}: column 7 is 0 in all {len(keep)} rows; it is taken as a confidence, and all rows count"
        warnings.warn(text, stacklevel=2)
    if person_class is not None and classes_of(table, True) is None:
        raise InputError(
            file=file, place="--class", got=f"{table.rows.values.shape[1]} columns without classes",
            expected="a class in column 8", remedy="leave --class out",
        )  # fmt: skip
    return of_class(table, keep, person_class)


def of_class(table: MotTable, keep: Bools, person_class: int | None) -> Bools:
    """Returns `keep` (N,) without the rows of other classes than that of people."""
    found = classes_of(table, person_class is not None)
    if found is None or not keep.any():
        return keep
    wanted = PEDESTRIAN if person_class is None else person_class
    people: Bools = np.asarray(keep & (found == wanted))
    file = table.rows.file
    values, counts = np.unique(found[keep & ~people], return_counts=True)
    words = ", ".join(f"{n} rows of class {v:g}" for v, n in zip(values[:SHOWN], counts[:SHOWN], strict=True))
    words += ", …" if len(values) > SHOWN else ""
    if not people.any():
        raise InputError(
            file=file, place="column 8", got=words, expected=f"people, of class {wanted}",
            remedy="name the class of people with --class N",
        )  # fmt: skip
    if len(values) and person_class is None:
        warnings.warn(f"{file}: {words} are left out; people are class {wanted} (--class says otherwise)", stacklevel=3)
    return people


def classes_of(table: MotTable, named: bool) -> Array | None:
    """Returns column 8 (N,) if it holds classes, else None. named: True if the user named one (--class)."""
    if table.rest.shape[1] < 2 or table.rows.values.shape[1] == GROUND_COLUMNS:
        return None
    column = table.rest[:, 1]
    if (column == -1).all():
        return None
    if table.rest.shape[1] < 4:
        return column
    if (column < 0).any() or (column != np.round(column)).any():
        return None
    # If columns 8 to 10 are no metres, column 8 may be a category, as in VisDrone.
    return column if named or (table.rest[:, 3] == -1).all() or _one_for_each(table, column) else None


def _one_for_each(table: MotTable, column: Array) -> bool:
    if (table.id < 0).any() or column.max(initial=0) < 2 or column.max(initial=0) > LAST_CLASS or has_ground(table):
        return False
    order = np.lexsort((column, table.id))
    same = np.diff(table.id[order]) == 0
    return bool(same.any() and not np.diff(column[order])[same].any())
