"""The paper's Table 3b: recordings from labelled positions with noise."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np

from benchmarks.joint.runs import SHARES, Row, Variant, difference
from benchmarks.support import tables
from benchmarks.support.options import HOTEL, WALK_TOGETHER, ZARA, seeds_text
from sim.io.source import open_source
from tracking.papers.joint.config import JointConfig
from tracking.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval

RECORDED = ("group_GDSR", "group_MOTA", "pairwise_F1")


def recordings(given: argparse.Namespace) -> None:
    """Prints a table for each recording, and differences to its first row."""
    noisy = {"detect_prob": 0.95, "noise_m": 0.1}
    compared = [
        Variant("full"),
        *(Variant(n, params={"variant": n}) for n in ("VAR1", "VAR3")),
        Variant("relational", "relational"),
    ]
    compared.append(Variant("particle + default grouping", "particle"))
    compared = [v for v in compared if not given.only or v.name in given.only.split(",")]
    for path in (HOTEL, ZARA, WALK_TOGETHER):
        (sequence,) = open_source(given.data / path)
        sensor = noisy if sequence.truth is not None and sequence.truth.pos is not None else {"detect_prob": 0.95}
        found: dict[str, list[Row]] = {v.name: [] for v in compared}
        for v in compared:
            params = JointConfig.from_dict(dict(v.params)).with_set(*given.set) if v.tracker == "joint" else None
            for seed in given.filter_seeds:
                run = track(v.tracker, sequence, params=params, detections="truth", sensor=sensor, seed=seed)
                found[v.name].append(evaluate(sequence.truth, run))
        title = f"{path}: sensor {sensor}, filter seeds {seeds_text(given.filter_seeds)}, means"
        columns = [*(f"{k}, %" for k in SHARES), "MOTP", "pairwise F1"]
        tables.table(title, "tracker", columns, {name: over_seeds(rows) for name, rows in found.items()})
        first, *rest = found
        cells = {f"{first} − {name}": [difference(found[first], found[name], key) for key in RECORDED] for name in rest}
        tables.table("differences, paired by filter seed", "", ["GDSR", "MOTA", "pairwise F1"], cells)


def over_seeds(rows: Sequence[Row]) -> list[str]:
    """Returns cells of the columns of Table 3b and pairwise F1: means over filter seeds with 95 % intervals."""
    keys = [*(f"group_{k}" for k in SHARES), "group_MOTP", "pairwise_F1"]
    values = np.array([[row[key] for key in keys] for row in rows]) * [100, 100, 100, 100, 1, 1]
    return [tables.interval(*cell) for cell in zip(*mean_interval(values), (1, 1, 1, 1, 2, 3), strict=True)]
