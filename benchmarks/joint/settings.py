"""Scores on friends-meet with other parameters: departures, numbers of particles."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

import numpy as np

from benchmarks.joint.runs import (
    OTHERS,
    SHARES,
    Row,
    Variant,
    difference,
    mean_row,
    measured,
    others,
    pooled,
    sequences,
    with_false_events,
)
from benchmarks.support import chart, tables
from benchmarks.support.replaced_code import Replacement, replaced_code
from sim.types import Array, Ints
from tracking.papers.joint.people import People

COUNTS = (10, 25, 50, 100)
DEPARTURES = (
    "variant=full", "belief_rate=0 belief_memory=0", "belief_memory=0",
    "algorithm=paper",
)  # fmt: skip
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
    deltas = {"GDSR": "group_GDSR", "MOTA": "group_MOTA", "HOTA": "HOTA", "group F1": "group_F1_hull",
              "event F1": "event_F1", "false events": "false"}  # fmt: skip
    tables.head(["setting", *(f"{name}, %" for name in SHARES), "event F1", *(f"Δ {name}" for name in deltas)])
    for setting in ("", *(given.only.split(",") if given.only else (*DEPARTURES, *RULES))):
        words = [*given.set, *([] if setting in RULES else setting.split())]
        with replaced_code([RULES[setting]] if setting in RULES else []):
            rows = [with_false_events(mean_row(measured(s, Variant(""), given.filter_seeds, words))) for s in made]
        base = base or rows
        differences = [difference(rows, base, key) for key in deltas.values()]
        tables.row([setting or "defaults", *pooled(rows, "_core")[:4], others(rows)[0], *differences])


def particles(given: argparse.Namespace) -> None:
    """Prints a table over N_x and N_z."""
    made, found = list(sequences(given.seeds)), {}
    tables.head(["N_x", "N_z", "GDSR, %", "MOTA, %", *OTHERS])
    for n_x, n_z in [(n, 50) for n in COUNTS] + [(50, n) for n in COUNTS if n != 50]:
        v = Variant("", params={"particles": n_x, "partitions": n_z})
        rows = [mean_row(measured(s, v, given.filter_seeds, given.set)) for s in made]
        shares, speed = pooled(rows, "")[2:4], float(np.mean([row["speed"] for row in rows]))
        found[n_x, n_z] = [*map(float, shares), speed]
        tables.row([str(n_x), str(n_z), *shares, *others(rows)])
    if given.chart:
        lines = {
            "over N_x, N_z = 50": [found[n, 50] for n in COUNTS],
            "over N_z, N_x = 50": [found[50, n] for n in COUNTS],
        }
        panels = [
            chart.Panel(name, COUNTS, {k: np.array(v)[:, column] for k, v in lines.items()}, "particles")
            for column, name in enumerate(("GDSR, %", "MOTA, %", "frames/s"))
        ]
        chart.lines(panels, given.chart, columns=3)
