"""Mode `options` of `benchmarks.blob`, on training seeds.

Scenes: with occlusion (benchmarks/peers/synthetic.py, seeds from 400 on) and of the catalogue with its own sensor
(seeds 11 and 12).
HOTA, MOTA, IDF1 with one option changed, minus those of the defaults; 95 % intervals paired over scenes.
"""

from __future__ import annotations

import numpy as np

from benchmarks.blob.boxes import Scene, catalogue_scenes, synthetic_scenes, track_blob
from benchmarks.peers.scores import mot_scores
from tracking.papers.blob.config import BlobConfig
from tracking.stats import mean_interval

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


def options(count: int) -> None:
    """Prints what each change of an option is worth, with `count` scenes with occlusion."""
    made = {
        "scenes with occlusion": synthetic_scenes(range(400, 400 + count)),
        "the catalogue": catalogue_scenes(range(11, 13)),
    }
    for title, scenes in made.items():
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
