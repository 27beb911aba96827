"""Modes of `benchmarks.group_pda`: tables over scenes and suites.

scenarios: scene by scene, the tracker beside its preset and the rule and the belief over `blob`. Lineage:
share of true merges and splits that are reported with the right parents and children. Ids kept: share of encounters of
two groups after which both have the id that they had before.
ablation: the preset with and without the association of sec. 5.2.1, by input, paired.
decisions: the tracker minus the tracker without one of its decisions, paired, all scenes together (--each: scene by
scene, too); * if 0 lies outside the interval; of IDSW less is better.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.group_pda.runs import REPLACED, Row, TrackingJob, Variant, measure, trackers, with_points
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import difference_cell, mean_cell, share, table
from scenarios.loading.resolve import Entry, resolve
from sim.types import Array, DetectionMode
from tracking.papers.group_pda.config import GroupPdaConfig

SCENES = ("merge", "split", "cross", "queue", "side-by-side")
DENSE = ("cross-dense", "pass-by-dense")  # Of the suite `standard`.
ABLATED = ("merge", "split", "cross", "cross-same-speed", "pass-by", "queue", "party", *DENSE)
ENCOUNTERS = ("merge", "split", "cross")
# Inputs of the ablation. Sec. 4.1 excludes misses and false alarms, which the points of a detector have.
INPUTS: Mapping[DetectionMode, str] = {
    "image": "pixels",
    "truth": "points, nobody missed",
    "file": "points of a detector",
}
HEADLINE = ("merge_TP", "merge_FN", "split_TP", "split_FN")
Column = Callable[[Sequence[Row]], str]
WITHOUT: Mapping[str, Mapping[str, object]] = {
    "corrections": {"corrections": False},
    "missed and hidden members": {"carry_time": 0.0},
    "association and group constraint": {"association": "none"},
    "all that is ours: preset paper": GroupPdaConfig.load("paper").as_dict(),
}
DECIDED = ("lineage_accuracy", "ids", "group_F1_hull", "group_MOTA", "event_F1", "group_IDSW")
DECIDED_COLUMNS = ["ids kept" if key == "ids" else key for key in DECIDED]


def values(rows: Sequence[Row], keys: Sequence[str]) -> Array:
    """Returns scores (sequences, keys); the key "ids" is the share of a sequence's encounters that keep both ids."""
    return np.array([[_ids_kept(r) if key == "ids" else r[key] for key in keys] for r in rows]).reshape(-1, len(keys))


def _ids_kept(row: Row) -> float:
    return row["kept"] / row["pairs"] if row["pairs"] else float("nan")


def _score(key: str) -> str:
    return "HOTA" if key == "ids" else key  # another share


def mean_of(key: str) -> Column:
    """Mean of a score over the sequences in which it is known."""
    return lambda rows: mean_cell(values(rows, [key])[:, 0], _score(key))


def pooled_lineage(rows: Sequence[Row]) -> str:
    """Share of all true merges and splits that are reported with the right parents and children."""
    there = [int(sum(r[key] for key in HEADLINE)) for r in rows]
    right = [round(r["lineage_accuracy"] * n) if n else 0 for r, n in zip(rows, there, strict=True)]
    return share(sum(right), sum(there))


def pooled_ids_kept(rows: Sequence[Row]) -> str:
    """Share of all encounters of two groups after which both have the id that they had before."""
    return share(int(sum(r["kept"] for r in rows)), int(sum(r["pairs"] for r in rows)))


SCENE_COLUMNS: Mapping[str, Column] = {
    "lineage": pooled_lineage,
    "ids kept": pooled_ids_kept,
    "group F1": mean_of("group_F1_hull"),
    "MOTA": mean_of("group_MOTA"),
    "IDSW": mean_of("group_IDSW"),
    "pairwise F1": mean_of("pairwise_F1"),
    "event F1": mean_of("event_F1"),
}


def scenarios(given: argparse.Namespace) -> Any:
    """Prints a table per scene and returns its rows."""
    names = given.only.split(",") if given.only else SCENES
    entries = [entry for name in names for entry in resolve(name, given.set)]
    compared = trackers(given.tracker, given.detections)
    found = gathered(entries, given, compared[:1] if given.alone else compared)
    for scene, rows in found.items():
        cells = {name: [column(some) for column in SCENE_COLUMNS.values()] for name, some in rows.items()}
        table(f"{scene}: {heading(given, rows)}", "tracker", list(SCENE_COLUMNS), cells)
    return found


def decisions(given: argparse.Namespace) -> Any:
    """Prints the differences and returns the rows by scene and variant."""
    names = given.only.split(",") if given.only else ABLATED
    variants = (
        Variant("default", given.tracker),
        *(Variant(name, given.tracker, params) for name, params in WITHOUT.items()),
        *(Variant(name, given.tracker, replaced=name) for name in REPLACED),
    )
    dense = [entry for entry in resolve("standard", given.set) if entry.name in DENSE and entry.name in names]
    entries = [entry for name in names if name not in DENSE for entry in resolve(name, given.set)]
    found = gathered(entries + dense, given, variants)
    pooled = {v.name: [row for rows in found.values() for row in rows[v.name]] for v in variants}
    for scene, rows in {"all": pooled, **(found if given.each else {})}.items():
        cells = {"default": means(rows["default"])}
        for name in (*WITHOUT, *REPLACED):
            cells[f"default minus without {name}"] = differences(rows["default"], rows[name])
        table(f"{scene}: {heading(given, rows)}; paired differences", "", DECIDED_COLUMNS, cells)
    return found


def ablation(given: argparse.Namespace) -> Any:
    """Prints a table for each input and returns the rows by input, scene and variant."""
    preset = GroupPdaConfig.load("paper").as_dict()
    variants = (
        Variant("preset", given.tracker, preset),
        Variant("all points of the region", given.tracker, {**preset, "association": "none"}),
    )
    entries = [entry for name in ENCOUNTERS for entry in resolve(name, given.set)]
    found = {}
    for mode, title in INPUTS.items():
        own = argparse.Namespace(**{**vars(given), "detections": mode})
        found[mode] = gathered(entries, own, variants)
        cells = {}
        for scene, rows in found[mode].items():
            cells |= {f"{scene}: {name}": means(some) for name, some in rows.items()}
            cells[f"{scene}: difference"] = differences(*rows.values())
        rows = next(iter(found[mode].values()))
        table(f"From {title}, of each scene: {heading(own, rows)}", "", DECIDED_COLUMNS, cells)
    return found


def means(rows: Sequence[Row]) -> list[str]:
    """Returns cells of the means of the scores DECIDED."""
    return [mean_of(key)(rows) for key in DECIDED]


def differences(first: Sequence[Row], second: Sequence[Row]) -> list[str]:
    """Returns cells of the paired differences of the scores DECIDED, first minus second."""
    less = values(first, DECIDED) - values(second, DECIDED)
    return [difference_cell(less[:, k], _score(key)) for k, key in enumerate(DECIDED)]


def gathered(
    entries: Sequence[Entry], given: argparse.Namespace, variants: tuple[Variant, ...]
) -> dict[str, dict[str, list[Row]]]:
    """Returns the rows by scene and variant, in the order of seeds."""
    made_with = [with_points(entry, given.points) for entry in entries]
    jobs = [TrackingJob(entry, seed, given.detections, variants) for entry in made_with for seed in given.seeds]
    made = {(job.entry.name, job.seed): rows for job, rows in measure(jobs, given.workers)}
    found: dict[str, dict[str, list[Row]]] = {}
    for job in jobs:
        for name, row in made.get((job.entry.name, job.seed), {}).items():
            found.setdefault(job.entry.name, {}).setdefault(name, []).append(row)
    return found


def heading(given: argparse.Namespace, rows: Mapping[str, Sequence[Row]]) -> str:
    """Returns number of sequences, seeds and input, for the title of a table."""
    count = len(next(iter(rows.values()), ()))
    return f"{count} sequences, seeds {seeds_text(given.seeds)}, --detections {given.detections}"
