"""Mode `suites` of `benchmarks.belief`: scores of the rule and of the belief on simulated people with known ids.

Pairwise F1, group F1, event F1, merges that are wrong or missed, and seconds until a merge is reported; means over
sequences with 95 % intervals, and the paired difference.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.support.tables import difference_cell, mean_cell, table
from scenarios.loading.resolve import resolve
from sim.types import Array
from tracking.fitting.grouping_scenes import simulated
from tracking.grouping.belief import Belief
from tracking.grouping.grouped_tracks import derive
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule
from tracking.scoring.evaluation import evaluate

KEYS = ("pairwise_F1", "group_F1_hull", "event_F1", "merge_latency")
COLUMNS = ["pairwise F1", "group F1", "event F1", "merge reported after, s", "merges right, wrong, missed"]


def scores_of(name: str, seeds: range, groupings: Mapping[str, Grouping]) -> dict[str, tuple[Array, str]]:
    """Returns for each grouping the scores `KEYS` of each sequence of a suite, (S, 4), and its merges as text."""
    found: dict[str, list[list[float]]] = {key: [] for key in groupings}
    merges = {key: np.zeros(3) for key in groupings}
    for entry in resolve(name):
        for seed in seeds:
            truth = simulated(entry, seed)
            people = people_as_tracks(truth)
            for key, grouping in groupings.items():
                scores = evaluate(truth, derive(people, truth.fps, truth.px_per_m, grouping))
                found[key].append([scores[k] for k in KEYS])
                merges[key] += np.nan_to_num([scores[f"merge_{k}"] for k in ("TP", "FP", "FN")])
    return {key: (np.array(rows), ", ".join(f"{n:.0f}" for n in merges[key])) for key, rows in found.items()}


def suites(names: Sequence[str], seeds: range, belief: Belief) -> None:
    for name in names:
        found = scores_of(name, seeds, {"rule": LinkRule(), "belief": belief})
        cells = {key: [*map(mean_cell, values.T), text] for key, (values, text) in found.items()}
        cells["belief minus rule"] = [*map(difference_cell, (found["belief"][0] - found["rule"][0]).T), ""]
        title = f"{Path(name).stem}, seeds {seeds.start}:{seeds.stop}, {len(found['rule'][0])} sequences"
        table(title, "", COLUMNS, cells)
