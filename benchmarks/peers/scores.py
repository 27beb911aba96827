"""HOTA, MOTA, IDF1 of (ids, boxes) per frame by TrackEval, and a moving-block bootstrap of a difference in HOTA."""

from __future__ import annotations

import contextlib
import io

import numpy as np


def mot_scores(ids, truth, answers) -> dict[str, float]:
    """Scores of answers, (ids, ltwh boxes) per frame, against true ids and boxes; IoU."""
    return _evaluate(ids, truth, answers, ("HOTA", "CLEAR", "Identity"))


def _evaluate(ids, truth, answers, families) -> dict[str, float]:
    with contextlib.redirect_stdout(io.StringIO()):
        from trackeval import metrics

        given, quiet = _arrays(ids, truth, answers), {"THRESHOLD": 0.5, "PRINT_CONFIG": False}
        hota = metrics.HOTA().eval_sequence(given)
        found = {k: float(hota[k].mean()) for k in ("HOTA", "DetA", "AssA")}
        if "CLEAR" in families:
            clear = metrics.CLEAR(quiet).eval_sequence(given)
            found |= {"MOTA": float(clear["MOTA"]), "IDSW": float(clear["IDSW"])}
            found |= {"FP": float(clear["CLR_FP"]), "FN": float(clear["CLR_FN"])}
        if "Identity" in families:
            found["IDF1"] = float(metrics.Identity(quiet).eval_sequence(given)["IDF1"])
    return found


def _arrays(ids, truth, answers) -> dict:
    true, own = {}, {}
    gt = [np.array([true.setdefault(i, len(true)) for i in row], int) for row in ids]
    tr = [np.array([own.setdefault(i, len(own)) for i in row], int) for row, _ in answers]
    alike = [iou(a, b) for a, (_, b) in zip(truth, answers, strict=True)]
    return {
        "gt_ids": gt, "tracker_ids": tr, "similarity_scores": alike, "num_timesteps": len(gt),
        "num_gt_ids": len(true), "num_tracker_ids": len(own),
        "num_gt_dets": sum(map(len, gt)), "num_tracker_dets": sum(map(len, tr)),
    }  # fmt: skip


def iou(a, b):
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    shared = np.prod(np.maximum(high - low, 0), 2)
    return shared / (np.prod(a[:, 2:], 1)[:, None] + np.prod(b[:, 2:], 1)[None] - shared)


def bootstrap(ids, truth, first, second, block: int, r: np.random.Generator, rounds: int = 200) -> tuple[float, float]:
    """95 % interval of HOTA(first) - HOTA(second): frames drawn in moving blocks, the same for both.

    Identities keep their numbers across blocks, so that what is resampled is the score of the whole recording.
    """
    n, differences = len(ids), []
    for _ in range(rounds):
        starts = r.integers(0, n - block + 1, -(-n // block))
        pick = [k for start in starts for k in range(start, start + block)]
        gt, boxes = [ids[k] for k in pick], [truth[k] for k in pick]
        one, two = (_evaluate(gt, boxes, [a[k] for k in pick], ())["HOTA"] for a in (first, second))
        differences.append(one - two)
    low, high = np.percentile(differences, (2.5, 97.5))
    return float(low), float(high)
