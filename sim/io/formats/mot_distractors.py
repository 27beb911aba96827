"""Labelled rows of a MOTChallenge text that are not scored, and the distractors among them.

A distractor looks like a person: people on vehicles (class 2), static people (7), other distractors (8), reflections
(12), and in MOT20 vehicles without a motor (6). The benchmark leaves a track on a distractor out of the scores. Which
tracks lie on distractors follows from a matching with all labelled rows, so the other unscored rows are kept, too.
"""

from __future__ import annotations

import numpy as np

from sim.io.formats.mot_people import PEDESTRIAN, classes_of
from sim.io.formats.mot_table import MotTable
from sim.types import Bools, Unscored

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
