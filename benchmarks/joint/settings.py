"""Scores on friends-meet without each departure from the paper."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

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
from benchmarks.support.replaced_code import Replacement, replaced_code
from sim.types import Array, Ints
from tracking.papers.joint.people import People

DEPARTURES = ("variant=full", "variant=VAR1", "belief_rate=0 belief_memory=0", "belief_memory=0", "algorithm=paper")
"""Settings of the mode ablation."""


def _own_absence(people: People, group: Ints) -> Array:
    del group
    return people.missed


RULES: Mapping[str, Replacement] = {"absence of groups": (People, "absence", _own_absence)}
"""Rules without a parameter that the mode ablation switches off: owner, name and replacement by the name of the row."""


def ablation(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings and `RULES` switched off, columns scores pooled over frames and paired
    differences to the defaults."""
    made = list(sequences(given.seeds, given.suite or "friends-meet"))
    base: list[Row] = []
    deltas = {"error, m": "RMSE_pos", "GDSR": "group_GDSR", "MOTA": "group_MOTA", "HOTA": "HOTA",
              "group F1": "group_F1_hull", "event F1": "event_F1", "false events": "false"}  # fmt: skip
    tables.head(["setting", *(f"{name}, %" for name in SHARES), "event F1", *(f"Δ {name}" for name in deltas)])
    for setting in ("", *(given.only.split(",") if given.only else (*DEPARTURES, *RULES))):
        words = [*given.set, *([] if setting in RULES else setting.split())]
        with replaced_code([RULES[setting]] if setting in RULES else []):
            rows = [with_false_events(mean_row(measured(s, Variant(""), given.filter_seeds, words))) for s in made]
        base = base or rows
        differences = [difference(rows, base, key) for key in deltas.values()]
        events = tables.number(float(np.nanmean([row["event_F1"] for row in rows])))
        tables.row([setting or "defaults", *pooled(rows, "_core")[:4], events, *differences])
