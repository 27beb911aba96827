"""Modes `options` and `coasting` of `benchmarks.blob`, on training seeds.

Scenes: with occlusion (benchmarks/peers/synthetic.py, seeds from 400 on) and of the catalogue with its own sensor
(seeds 11 and 12).
options: HOTA, MOTA, IDF1 with one option changed, minus those of the defaults; 95 % intervals paired over scenes.
coasting: of the boxes predicted for unseen tracks, the share that has IoU >= 0.5 with a person whom no seen track
claims (and how many boxes), by how long the track has been unseen and how long it was seen before.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from benchmarks.blob.boxes import Scene, catalogue_scenes, synthetic_scenes, track_blob
from benchmarks.peers.scores import iou, mot_scores
from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig
from tracking.prepare import prepare
from tracking.stats import mean_interval

UNSEEN = (0.0, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0)  # s
SEEN = (0.0, 1.0, 3.0, np.inf)  # s
SAME_PERSON = 0.5  # IoU
REPORT_ALL = {"report_coast": 10.0, "report_hidden": 10.0, "report_credit": 10.0}
CHANGES = (
    {"association": "nearest"},
    {"report_coast": 0.0, "report_hidden": 0.0},
    {"report_coast": 0.3},
    {"report_coast": 1.0},
    {"report_hidden": 0.4},
    {"report_hidden": 1.0},
    {"report_credit": 1.0},
    {"report_credit": 0.15},
    {"report_delay": 0.0},
    {"report_delay": 0.3},
    {"score_start": 0.1},
    {"score_start": 0.7},
    {"coast_time": 1.0},
    {"coast_time": 2.5},
    {"gate": 0.99},
    {"orphan_gate": 0.99},
    {"orphan_gate": 0.999},
)


def training_scenes(count: int) -> dict[str, list[Scene]]:
    return {
        "scenes with occlusion": synthetic_scenes(range(400, 400 + count)),
        "the catalogue": catalogue_scenes(range(11, 13)),
    }


def coasting(count: int) -> None:
    """Prints the shares of right boxes of unseen tracks, with `count` scenes with occlusion."""
    for title, scenes in training_scenes(count).items():
        unseen, seen, right = np.concatenate([unseen_boxes(scene) for scene in scenes]).T
        print(f"{title}: share of right boxes of unseen tracks (boxes); columns: time seen before")
        print("unseen for     " + "".join(f"{low:g} to {high:g} s".ljust(18) for low, high in pairwise(SEEN)))
        for low, high in pairwise(UNSEEN):
            cells = []
            for a, b in pairwise(SEEN):
                here = right[(unseen > low) & (unseen <= high) & (seen >= a) & (seen < b)]
                cells.append((f"{here.mean():.2f} ({len(here)})" if len(here) else "-").ljust(18))
            print(f"{low:.2f} to {high:.2f} s " + "".join(cells))


def unseen_boxes(scene: Scene) -> np.ndarray:
    """Returns (K, 3) of every unseen confirmed track in each frame: seconds unseen, seconds seen, box right (0, 1)."""
    ready, found = prepare("blob", scene.sequence, params=REPORT_ALL), [np.zeros((0, 3))]
    ready.reset(0)
    for frame, truth in zip(ready.frames(), scene.boxes, strict=True):
        ready.step(frame)
        people = ready.tracker.people
        reported = people.rows_to_report(frame.t)
        unseen = reported[~people.measured[reported]]
        if not len(unseen) or not len(truth):
            continue
        overlap = iou(box_geometry.ltwh_from_centred(people.bank[0]), truth)
        free = np.ones(len(truth), bool)
        claims = overlap[people.measured]
        free[claims.argmax(1)[claims.max(1) >= SAME_PERSON]] = False
        right = np.where(free, overlap[unseen], 0.0).max(1) >= SAME_PERSON
        times = np.stack([people.misses[unseen], people.hits[unseen]], 1) / scene.sequence.fps
        found.append(np.c_[times, right])
    return np.concatenate(found)


def options(count: int) -> None:
    """Prints what each change of an option is worth, with `count` scenes with occlusion."""
    for title, scenes in training_scenes(count).items():
        base = scores(scenes, {})
        print(f"{title}: defaults " + "  ".join(f"{k} {v.mean():.3f}" for k, v in base.items()))
        tried = {str(change): change for change in CHANGES} | {
            "preset paper": BlobConfig.preset("paper").as_dict(),
        }
        for name, change in tried.items():
            cells = []
            for key, values in scores(scenes, change).items():
                mean, low, high = (float(v[0]) for v in mean_interval((values - base[key])[:, None]))
                cells.append(f"{key} {mean:+.4f} [{low:+.4f}, {high:+.4f}]")
            print(f"  {name:46s} " + "  ".join(cells), flush=True)


def scores(scenes: list[Scene], change: dict) -> dict[str, np.ndarray]:
    """Returns the scores of each scene by key."""
    rows = [mot_scores(s.ids, s.boxes, track_blob(s.sequence, change, checked=False)[0]) for s in scenes]
    return {key: np.array([r[key] for r in rows]) for key in ("HOTA", "MOTA", "IDF1")}
