"""Modes `scenarios`, `decisions` and `events` of benchmarks/group_pda.py: tables over catalogue scenes and suites."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks import group_pda_tables as tables
from benchmarks.group_pda_runs import Job, Row, Variant, measure, seeds_of, trackers
from scenarios.loading.resolve import Entry, resolve
from tracking.stats import paired

SCENES = ("merge", "split", "cross", "queue", "side-by-side")
ABLATED = ("merge", "split", "cross", "cross-same-speed", "pass-by", "queue", "party")
SUITES = ("standard", "friends-meet")
WITHOUT: Mapping[str, Mapping[str, object]] = {
    "freeze": {"freeze": False},
    "miss": {"miss": False},
    "gate_correction": {"gate_correction": False},
    'centroid_noise "people"': {"centroid_noise": "redrawn"},
    "inherit_velocity": {"inherit_velocity": False},
    "recapture": {"recapture": False},
    'association "pda"': {"association": "none"},
}
SCENE_COLUMNS: Mapping[str, tables.Column] = {
    "lineage, all events": tables.lineage_pooled,
    "lineage, mean of sequences": tables.mean_of("lineage_accuracy"),
    "ids kept": tables.kept_pooled,
    "group F1": tables.mean_of("group_F1"),
    "core": tables.mean_of("group_F1_core"),
    "MOTA": tables.mean_of("group_MOTA"),
    "core ": tables.mean_of("group_MOTA_core"),
    "GDSR2": tables.mean_of("group_GDSR2"),
    "core  ": tables.mean_of("group_GDSR2_core"),
    "IDSW": tables.mean_of("group_IDSW"),
    "core   ": tables.mean_of("group_IDSW_core"),
    "pairwise F1": tables.mean_of("pairwise_F1"),
    "merge F1": tables.mean_of("merge_F1"),
    "split F1": tables.mean_of("split_F1"),
}
DECIDED = ("lineage_accuracy", "ids", "group_F1", "group_MOTA", "event_F1", "group_IDSW")
EVENT_COLUMNS: Mapping[str, tables.Column] = {
    "event F1": tables.mean_of("event_F1"),
    "merge F1, all": tables.pooled_f1("merge"),
    "TP/FP/FN": tables.events_of("merge"),
    "split F1, all": tables.pooled_f1("split"),
    "TP/FP/FN ": tables.events_of("split"),
    "precision": tables.mean_of("event_precision"),
    "recall": tables.mean_of("event_recall"),
    "latency, s": tables.mean_of("event_latency"),
    "lineage": tables.lineage_pooled,
}
PX_PER_M = 40.0  # of friends-meet, from above
TABLE_2 = """columns of Bazzani et al. 2012, Table 2; there, on its own 28 sequences, 1-FP 93.7 %, 1-FN 82.9 %,
GDSR 79.7 %, MOTP 16.7 px, MOTA 57.3 %. MSE here is that of matched groups' middles, there of people (2.2 px). First
all frames of all sequences together, then means of sequences, where those with few true groups weigh as much as any"""


def scenarios(given: argparse.Namespace) -> Any:
    """Must-show 1: scene by scene, the tracker beside its ablation and the baseline."""
    names = given.only.split(",") if given.only else SCENES
    entries = [entry for name in names for entry in resolve(name)]
    found = gathered(entries, given, compared(given))
    for scene, rows in found.items():
        title = f"{scene}: {heading(given, rows)}"
        tables.table(title, "tracker", list(SCENE_COLUMNS), tables.filled(SCENE_COLUMNS, rows))
    return found


def decisions(given: argparse.Namespace) -> Any:
    """Must-show 2: what each decision earns, all scenes pooled (--each: scene by scene, too); differences in pairs."""
    names = given.only.split(",") if given.only else ABLATED
    variants = (
        Variant("default", given.tracker),
        *(Variant(name, given.tracker, params) for name, params in WITHOUT.items()),
    )
    found = gathered([entry for name in names for entry in resolve(name)], given, variants)
    pooled = {v.name: [row for rows in found.values() for row in rows[v.name]] for v in variants}
    for scene, rows in {"all": pooled, **(found if given.each else {})}.items():
        default = tables.values(rows["default"], DECIDED)
        cells = {"default": [tables.mean_of(key)(rows["default"]) for key in DECIDED]}
        for name in WITHOUT:
            ends = paired(tables.values(rows[name], DECIDED), default)
            cells[f"default − without {name}"] = [
                tables.signed(*(float(e[k]) for e in ends)) for k in range(len(DECIDED))
            ]
        title = f"{scene}: {heading(given, rows)}; differences in pairs, * where 0 is outside; of IDSW less is better"
        tables.table(title, "", ["ids kept" if key == "ids" else key for key in DECIDED], cells)
    return found


def events(given: argparse.Namespace) -> Any:
    """Must-show 3: events on suites; on friends-meet the columns of Bazzani et al. 2012, Table 2."""
    found = {}
    for suite in given.only.split(",") if given.only else SUITES:
        by_scene = gathered(resolve(f"suite:{suite}"), given, compared(given))
        rows = {name: [r for scene in by_scene.values() for r in scene.get(name, ())] for name in _names(by_scene)}
        tables.table(
            f"{suite}: {heading(given, rows)}", "tracker", list(EVENT_COLUMNS), tables.filled(EVENT_COLUMNS, rows)
        )
        if suite == "friends-meet":
            for part, end in (("strict", ""), ("core", "_core")):
                told: dict[str, list[str]] = {}
                for name, some in rows.items():
                    scale = _scale(name, given)
                    told |= tables.filled(_frames_pooled(end, scale), {name: some})
                    told |= tables.filled(_means(end, scale), {f"{name}, mean of sequences": some})
                tables.table(f"{suite}, {part}: {TABLE_2}", "tracker", list(_means(end, 1.0)), told)
        found[suite] = by_scene
    return found


def compared(given: argparse.Namespace) -> tuple[Variant, ...]:
    """The tracker and, unless it is wanted alone, those it is compared with."""
    found = trackers(given.tracker, given.detections)
    return found[:1] if given.alone else found


def _means(end: str, scale: float) -> dict[str, tables.Column]:
    """Table 2's columns, means over sequences; end: of the keys."""
    return {
        **{name: tables.mean_of(f"group_{name}{end}") for name in ("1-FP", "1-FN", "GDSR")},
        "MSE, px²": tables.mean_of(f"group_MSE{end}", scale**2),
        "MOTP, px": tables.mean_of(f"group_MOTP{end}", scale),
        **{name: tables.mean_of(f"group_{name}{end}") for name in ("MOTA", "GDSR2")},
    }


def _frames_pooled(end: str, scale: float) -> dict[str, tables.Column]:
    """The same of the frames of all sequences together: shares of true groups, means of matched ones."""

    def count(*names: str) -> tables.Number:
        return lambda row: sum(row[f"group_{name}{end}"] for name in names)

    def total(name: str, weight: tables.Number, factor: float = 1.0) -> tables.Number:
        return lambda row: factor * row[f"group_{name}{end}"] * weight(row) if weight(row) else 0.0

    there, hits, false, wrong = count("TP", "FN"), count("TP"), count("FP"), count("FP", "FN", "IDSW")
    return {
        "1-FP": tables.ratio(lambda row: there(row) - false(row), there),
        "1-FN": tables.ratio(hits, there),
        "GDSR": tables.ratio(total("GDSR", there), there),
        "MSE, px²": tables.ratio(total("MSE", hits, scale**2), hits),
        "MOTP, px": tables.ratio(total("MOTP", hits, scale), hits),
        "MOTA": tables.ratio(lambda row: there(row) - wrong(row), there),
        "GDSR2": tables.ratio(total("GDSR2", there), there),
    }


def _scale(name: str, given: argparse.Namespace) -> float:
    """px per unit of a variant's scores."""
    return PX_PER_M if given.detections != "image" or name.endswith("on the ground") else 1.0


def gathered(
    entries: Sequence[Entry], given: argparse.Namespace, variants: tuple[Variant, ...]
) -> dict[str, dict[str, list[Row]]]:
    """Rows by scene and variant, in the order of seeds."""
    jobs = [Job(entry, seed, given.detections, variants) for entry in entries for seed in seeds_of(given.seeds)]
    made = {(job.entry.name, job.seed): rows for job, rows in measure(jobs, given.workers)}
    found: dict[str, dict[str, list[Row]]] = {}
    for job in jobs:
        for name, row in made.get((job.entry.name, job.seed), {}).items():
            found.setdefault(job.entry.name, {}).setdefault(name, []).append(row)
    return found


def _names(by_scene: Mapping[str, Mapping[str, object]]) -> list[str]:
    return list(dict.fromkeys(name for scene in by_scene.values() for name in scene))


def heading(given: argparse.Namespace, rows: Mapping[str, Sequence[Row]]) -> str:
    """What a table is of."""
    many = len(next(iter(rows.values()), ()))
    return f"{many} sequences, seeds {given.seeds}, --detections {given.detections}"
