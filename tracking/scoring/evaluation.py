"""Truth and tracks as scores: who is compared with whom, and by what."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np

from sim.types import Array, Tracks, Truth
from tracking.scoring.individuals import scores

Similarity = Literal["boxes", "ground", "image"]
REACH = 2.0  # m: places this far apart have similarity 0


def evaluate(truth: Truth, tracks: Iterable[Tracks], *, similarity: Similarity | None = None) -> dict[str, float]:
    """Scores of individuals by name (tracking.scoring.individuals); frames without an answer count as empty.

    similarity: "boxes" (IoU), "ground" or "image" (max(0, 1 - d / 2 m)); where absent, boxes if both sides have them,
    else the tracks' plane. ValueError where the truth lacks what is to be compared.
    """
    answers = {t.index: t for t in tracks}
    chosen = similarity or _choose(truth, answers)
    true, est, matrices = [], [], []
    for index in range(1, truth.length + 1):
        rows = truth.rows(index)
        answer = answers.get(index)
        ours = _places(chosen, truth.pos, truth.box, rows)
        theirs = _places(chosen, answer.pos, answer.box, slice(None)) if answer is not None else ours[:0]
        true.append(truth.id[rows])
        est.append(answer.id if answer is not None else truth.id[:0])
        scale = truth.px_per_m if chosen == "image" else 1.0
        matrices.append(iou(ours, theirs) if chosen == "boxes" else nearness(ours, theirs, REACH * scale))
    return scores(true, est, matrices)


def _choose(truth: Truth, answers: dict[int, Tracks]) -> Similarity:
    some = next((t for t in answers.values() if len(t.id)), None)
    if truth.box is not None and (some is None or some.box is not None):
        return "boxes"
    return "image" if some is not None and some.plane == "image" else "ground"


def _places(chosen: Similarity, pos: Array | None, box: Array | None, rows: slice) -> Array:
    if chosen == "ground":
        if pos is None:
            raise ValueError("no ground positions to compare: score boxes or in the image")
        return pos[rows, :2]
    if chosen == "image" and box is None and pos is not None:
        return pos[rows, :2]
    if box is None:
        raise ValueError("no boxes to compare: score on the ground")
    return box[rows] if chosen == "boxes" else box[rows, :2] + box[rows, 2:] / 2


def iou(a: Array, b: Array) -> Array:
    """Intersection over union of boxes ltwh, (N, M); nan boxes overlap nothing."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    inner = np.prod(np.maximum(0.0, high - low), axis=2)
    union = np.prod(a[:, 2:], axis=1)[:, None] + np.prod(b[:, 2:], axis=1)[None] - inner
    return np.asarray(np.nan_to_num(inner / np.where(union > 0, union, np.inf)))


def nearness(a: Array, b: Array, reach: float) -> Array:
    """max(0, 1 - distance / reach), (N, M); nan places are near nothing."""
    d: Array = np.linalg.norm(a[:, None] - b[None], axis=2)
    return np.asarray(np.nan_to_num(np.maximum(0.0, 1 - d / reach)))
