"""Pixels per metre: what the lengths of a config are multiplied by in the image, and where it comes from."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence as SequenceOf

import numpy as np

from scenarios.errors import InputError
from sim.scene.camera import PERSON
from sim.types import Detections, Tracks


def needed(px_per_m: float) -> float:
    """px_per_m itself; InputError unless it is above 0: metres would mean nothing in the image."""
    if px_per_m > 0:
        return px_per_m
    raise InputError(
        place="context.px_per_m",
        got=f"{px_per_m:g}",
        expected="px per m at people, above 0, to track in the image",
        remedy="give --px-per-m, for instance the median height of boxes / 1.7 m, or a camera",
    )


def of_boxes(found: Iterable[Detections | Tracks | None]) -> float:
    """The median height of all boxes / 1.7 m; nan without any."""
    heights = [d.box[:, 3] for d in found if d is not None and d.box is not None and len(d.box)]
    return float(np.nanmedian(np.concatenate(heights))) / PERSON if heights else float("nan")


def of_answers(given: float, learned: object, answers: SequenceOf[Tracks]) -> float:
    """What was given; else what the tracker says it has learned (its `px_per_m`); else by the boxes it answered."""
    if np.isfinite(given):
        return given
    if isinstance(learned, int | float) and np.isfinite(learned):
        return float(learned)
    return of_boxes(answers)
