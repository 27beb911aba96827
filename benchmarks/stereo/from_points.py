"""Decisions of `stereo` from points: the simulated detector's detections, with misses and false alarms.

Each decision that points know is switched off on scenarios of the catalogue: `group F1` (group_F1_hull), `1-FP`,
`1-FN`, `event F1`, and by sequence `false enters` and `false events` (merges and splits). Paired differences to the
defaults over sequences; 95 % intervals are Student's; * if 0 lies outside. The first row has the values of the
defaults.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from benchmarks.stereo.decisions import VARIANTS
from benchmarks.stereo.scenes import Variant, tracked
from benchmarks.support.tables import interval, signed, table
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from tracking.scoring import evaluate
from tracking.stats import mean_interval

SCENARIOS = "cross,merge,split,mixed"
OPTIONS = (
    "point_covariance,velocity_weight,spread_weight,split,split_time,confirm_time,centroid_noise,coast_time,settled,"
    "P of a mean"
)
KEYS = ("group_F1_hull", "group_1-FP", "group_1-FN", "enter_FP", "event_F1")
COLUMNS = ("group F1", "1-FP", "1-FN", "false enters", "event F1", "false events")


def points(args: argparse.Namespace) -> dict[str, list[list[float]]]:
    """Prints the table and returns the scores of each sequence by decision."""
    wanted = {"defaults": Variant("defaults")}
    wanted |= {name: VARIANTS[name] for name in (args.options or OPTIONS).split(",")}
    made: dict[str, list[list[float]]] = {name: [] for name in wanted}
    for scenario in (args.only or SCENARIOS).split(","):
        for entry in resolve(scenario):
            for seed in args.seeds:
                sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
                try:
                    assert sequence.truth is not None
                except FlockscopeError as error:
                    print(f"{entry.name}, seed {seed}, left out: {error.line()}", file=sys.stderr)
                    continue
                for name, variant in wanted.items():
                    scores = evaluate(sequence.truth, tracked(sequence, variant, "file"))
                    false = np.nansum([scores[f"{kind}_FP"] for kind in ("merge", "split")])
                    made[name].append([*(scores[key] for key in KEYS), float(false)])
                print(f"{entry.name} {seed}", file=sys.stderr, flush=True)
    usual = np.array(made["defaults"])
    rows = {"defaults": [interval(*map(float, mean_interval(column))) for column in usual.T]}
    for name in list(wanted)[1:]:
        rows[name] = [signed(*map(float, mean_interval(column))) for column in (np.array(made[name]) - usual).T]
    table("Decisions from points", "off", COLUMNS, rows)
    return made
