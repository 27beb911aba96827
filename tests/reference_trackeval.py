"""TrackEval as the oracle of HOTA, CLEAR and Identity: its scores of a sequence under our keys."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

KEYS = {"TP": "CLR_TP", "FN": "CLR_FN", "FP": "CLR_FP"}
HOTA = ("HOTA", "DetA", "AssA", "DetRe", "DetPr", "AssRe", "AssPr", "LocA")
CLEAR = ("MOTA", "MOTP", "TP", "FN", "FP", "IDSW", "MT", "PT", "ML", "Frag")
IDENTITY = ("IDF1", "IDP", "IDR", "IDTP")


def trackeval_scores(true: Sequence, est: Sequence, similarity: Sequence) -> dict[str, float]:
    """true[t] (N,), est[t] (M,) ids and similarity[t] (N, M) of each frame. Skips where TrackEval is not installed."""
    metrics = pytest.importorskip("trackeval.metrics", reason="trackeval is installed by `make test`")
    return _scores(metrics, _numbered(true, est, similarity))


def trackeval_files(gt: Path, trackers: Path, tracker: str, **config: Any) -> dict[str, dict[str, float]]:
    """What TrackEval makes of folders of MOTChallenge texts, by sequence."""
    trackeval = pytest.importorskip("trackeval", reason="trackeval is installed by `make test`")
    dataset = trackeval.datasets.MotChallenge2DBox(
        {"GT_FOLDER": str(gt), "TRACKERS_FOLDER": str(trackers), "PRINT_CONFIG": False, **config}
    )
    return {
        name: _scores(
            trackeval.metrics, dataset.get_preprocessed_seq_data(dataset.get_raw_seq_data(tracker, name), "pedestrian")
        )
        for name in dataset.seq_list
    }


def _scores(metrics: Any, data: dict) -> dict[str, float]:
    quiet = {"THRESHOLD": 0.5, "PRINT_CONFIG": False}
    found: dict[str, float] = {}
    for metric, keys in ((metrics.HOTA(), HOTA), (metrics.CLEAR(quiet), CLEAR), (metrics.Identity(quiet), IDENTITY)):
        answer = metric.eval_sequence(data)
        found |= {key: float(np.mean(answer[KEYS.get(key, key)])) for key in keys}
    return found


def _numbered(true: Sequence, est: Sequence, similarity: Sequence) -> dict:
    def contiguous(ids: Sequence) -> tuple[list[np.ndarray], int]:
        place = {k: n for n, k in enumerate(np.unique(np.concatenate([np.zeros(0, int), *ids])).tolist())}
        return [np.array([place[k] for k in row], int) for row in (np.asarray(i).tolist() for i in ids)], len(place)

    gt, gt_count = contiguous(true)
    tracker, tracker_count = contiguous(est)
    return {
        "gt_ids": gt, "tracker_ids": tracker, "similarity_scores": [np.array(s, float) for s in similarity],
        "num_gt_ids": gt_count, "num_tracker_ids": tracker_count, "num_timesteps": len(gt),
        "num_gt_dets": sum(map(len, gt)), "num_tracker_dets": sum(map(len, tracker)),
    }  # fmt: skip


def box_similarity(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Intersection over union of boxes (N, 4) and (M, 4) left, top, width, height: (N, M)."""
    low = np.maximum(a[:, None, :2], b[None, :, :2])
    high = np.minimum(a[:, None, :2] + a[:, None, 2:], b[None, :, :2] + b[None, :, 2:])
    common = np.prod(np.maximum(high - low, 0), axis=2)
    return common / (np.prod(a[:, 2:], axis=1)[:, None] + np.prod(b[:, 2:], axis=1)[None] - common)
