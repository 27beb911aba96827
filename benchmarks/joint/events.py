"""Events on a suite."""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.joint.runs import (
    Row,
    Variant,
    difference,
    mean_row,
    measured,
    median_latency,
    sequences,
    with_false_events,
)
from benchmarks.support import tables
from benchmarks.support.options import seeds_text


def events(given: argparse.Namespace) -> None:
    """Prints a table of events on a suite: means of event F1 over sequences, sums of hits, false alarms and misses;
    and differences to its first row, of means over sequences."""
    compared = [Variant("joint"), Variant("group-pda", "group-pda", seeds=False)]
    compared += [Variant(f"{name} + default grouping", name, seeds=name != "blob") for name in ("particle", "blob")]
    compared = [v for v in compared if not given.only or v.name in given.only.split(",")]
    rows: dict[str, list[Row]] = {v.name: [] for v in compared}
    suite = given.suite or "standard"
    for sequence in sequences(given.seeds, suite):
        for v in compared:
            rows[v.name].append(with_false_events(mean_row(measured(sequence, v, given.filter_seeds, given.set))))
    cells = {}
    for name, found in rows.items():
        counts = [
            " / ".join(f"{np.nansum([row[f'{kind}_{k}'] for row in found]):.1f}" for k in ("TP", "FP", "FN"))
            for kind in ("merge", "split")
        ]
        means = [float(np.nanmean([row[key] for row in found])) for key in ("event_F1", "group_F1_hull", "pairwise_F1")]
        cells[name] = [*map(tables.number, means), *counts, median_latency(found)]
    columns = ["event F1", "group F1", "pairwise F1", "merges: hits / false / missed", "splits", "latency, s (median)"]
    title = f"{suite}, {len(rows[compared[0].name])} sequences, seeds {seeds_text(given.seeds)}, "
    tables.table(title + f"filter seeds {seeds_text(given.filter_seeds)}", "tracker", columns, cells)
    first, *rest = (v.name for v in compared)
    keys = {"event F1": "event_F1", "group F1": "group_F1_hull", "pairwise F1": "pairwise_F1", "false events": "false"}
    cells = {f"{first} − {name}": [difference(rows[first], rows[name], key) for key in keys.values()] for name in rest}
    tables.table("differences of means over sequences", "", list(keys), cells)
