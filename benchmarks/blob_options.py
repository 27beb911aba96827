"""What `blob`'s options are worth on training scenes, and how often the box of an unseen track is right.

usage: python benchmarks/blob_options.py [coasting] [options] [--scenes 30]

Scenes: peers/synthetic.walk (seeds 400 …) and the catalogue with its own sensor (seeds 11 …): training seeds all.
coasting: of the boxes predicted for unseen tracks, the share that has IoU >= 0.5 with a person whom no seen track
claims, by how long the track has been unseen and how long it was seen before. options: HOTA, MOTA, IDF1 with one option
changed, less those of the defaults, 95 % intervals paired over scenes.
"""

from __future__ import annotations

import argparse
from itertools import pairwise

import numpy as np
from blob_vs_peers import Scene, generated, one_thread, ours, walks
from peers.scores import iou, mot_scores

from tracking.papers.blob import box_geometry
from tracking.papers.blob.config import BlobConfig
from tracking.prepare import prepare
from tracking.stats import bootstrap

UNSEEN = (0.0, 0.1, 0.2, 0.3, 0.45, 0.7, 1.0)  # s
SEEN = (0.0, 1.0, 3.0, np.inf)  # s
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


def coasting(title: str, scenes: list[Scene]) -> None:
    rows = np.concatenate([coasted(scene) for scene in scenes])
    unseen, seen, right = rows.T
    print(f"{title}: share of right boxes of unseen tracks (how many); columns: seen for")
    print("unseen for     " + "".join(f"{low:g} to {high:g} s".ljust(18) for low, high in pairwise(SEEN)))
    for low, high in pairwise(UNSEEN):
        words = []
        for a, b in pairwise(SEEN):
            here = right[(unseen > low) & (unseen <= high) & (seen >= a) & (seen < b)]
            words.append((f"{here.mean():.2f} ({len(here)})" if len(here) else "-").ljust(18))
        print(f"{low:.2f} to {high:.2f} s " + "".join(words))


def coasted(scene: Scene) -> np.ndarray:
    """(K, 3) seconds unseen, seconds seen, right or not, of every unseen confirmed track."""
    everything = {"report_coast": 10.0, "report_hidden": 10.0, "report_credit": 10.0}
    ready, found = prepare("blob", scene.sequence, params=everything), []
    ready.reset(0)
    for frame, truth in zip(ready.frames(), scene.boxes, strict=True):
        ready.step(frame)
        people = ready.tracker.people
        told = people.rows_to_report(frame.t)
        lost = told[~people.measured[told]]
        if not len(lost) or not len(truth):
            continue
        box = box_geometry.ltwh_from_centred(people.bank[0])
        overlap = iou(box, truth)
        free = np.ones(len(truth), bool)
        claims = overlap[people.measured]
        free[claims.argmax(1)[claims.max(1) >= 0.5]] = False
        right = np.where(free, overlap[lost], 0.0).max(1) >= 0.5
        times = np.stack([people.misses[lost], people.hits[lost]], 1) / scene.sequence.fps
        found.append(np.c_[times, right])
    return np.concatenate(found) if found else np.zeros((0, 3))


def options(title: str, scenes: list[Scene]) -> None:
    base = scored(scenes, {})
    print(f"{title}: defaults " + "  ".join(f"{k} {v.mean():.3f}" for k, v in base.items()))
    tried = {str(change): change for change in CHANGES} | {"frozen": BlobConfig.frozen().as_dict()}
    for name, change in tried.items():
        found = scored(scenes, change)
        words = []
        for key, values in found.items():
            mean, low, high = (float(v[0]) for v in bootstrap((values - base[key])[:, None]))
            words.append(f"{key} {mean:+.4f} [{low:+.4f}, {high:+.4f}]")
        print(f"  {name:46s} " + "  ".join(words), flush=True)


def scored(scenes: list[Scene], change: dict) -> dict[str, np.ndarray]:
    rows = [mot_scores(s.ids, s.boxes, ours(s.sequence, change, checked=False)[0]) for s in scenes]
    return {key: np.array([r[key] for r in rows]) for key in ("HOTA", "MOTA", "IDF1")}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", default=["coasting", "options"])
    parser.add_argument("--scenes", type=int, default=30)
    given = parser.parse_args()
    one_thread()
    made = {
        "scenes with occlusion": walks(range(400, 400 + given.scenes)),
        "the catalogue": generated(range(11, 13)),
    }
    for part in given.parts:
        for title, scenes in made.items():
            {"coasting": coasting, "options": options}[part](title, scenes)


if __name__ == "__main__":
    main()
