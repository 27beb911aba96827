"""Scores on friends-meet without each departure from the paper."""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.joint.runs import (
    SHARES,
    Row,
    Variant,
    difference,
    mean_row,
    measured,
    pooled,
    sequences,
    with_false_events,
)
from benchmarks.support import tables

# Settings of the mode ablation.
DEPARTURES = ("variant=full", "variant=VAR1", "belief_rate=0 belief_memory=0", "belief_memory=0", "algorithm=paper")


def ablation(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings, columns scores pooled over frames and paired
    differences to the defaults."""
    made = list(sequences(given.seeds, given.suite or "friends-meet"))
    base: list[Row] = []
    deltas = {"error, m": "RMSE_pos", "GDSR": "group_GDSR", "MOTA": "group_MOTA", "HOTA": "HOTA",
              "group F1": "group_F1_hull", "event F1": "event_F1", "false events": "false"}  # fmt: skip
    tables.head(["setting", *(f"{name}, %" for name in SHARES), "event F1", *(f"Δ {name}" for name in deltas)])
    for setting in ("", *(given.only.split(",") if given.only else DEPARTURES)):
        words = [*given.set, *setting.split()]
        rows = [with_false_events(mean_row(measured(s, Variant(""), given.filter_seeds, words))) for s in made]
        base = base or rows
        differences = [difference(rows, base, key) for key in deltas.values()]
        events = tables.number(float(np.nanmean([row["event_F1"] for row in rows])))
        tables.row([setting or "defaults", *pooled(rows, "_core")[:4], events, *differences])
