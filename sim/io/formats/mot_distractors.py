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

DISTRACTORS = (2, 7, 8, 12)
"""Classes of distractors from MOT16 on."""

MOT20 = "MOT20"
"""Begins the names of MOT20's sequences."""

MOT20_DISTRACTORS = (*DISTRACTORS, 6)

LABEL_COLUMNS = 3
"""Columns after the box in labels of MOTChallenge: flag, class, visibility. More columns have other classes."""

CLASSES = range(1, 14)
"""Classes of MOTChallenge. A text with another class has classes of its own, and no distractors."""


def unscored_rows(table: MotTable, people: Bools, name: str, person_class: int | None) -> Unscored | None:
    """Returns the labelled rows beside the `people` (N,), sorted by frame; None if there are no distractors among them.

    name: the sequence's; the folder of gt/gt.txt counts as well. person_class: the class of people that the user named,
    None if none; classes in which a person is not 1 are not those of MOTChallenge and have no distractors.
    """
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
