"""Modes `scenarios`, `decisions` and `events` of `benchmarks.group_pda`: tables over scenes and suites.

scenarios: scene by scene, the tracker beside its paper's ablation and the rule and the belief over `blob`.
decisions: the tracker minus the tracker without one of its decisions, paired, all scenes together (--each: scene by
scene, too); * if 0 lies outside the interval; of IDSW less is better.
events: merges and splits on suites, counts and F1 of all sequences together; on friends-meet also the columns of
Bazzani et al. 2012, Table 2.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.group_pda import columns
from benchmarks.group_pda.runs import Row, TrackingJob, Variant, measure, trackers, with_points
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import signed, table
from scenarios.loading.resolve import Entry, resolve
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.stats import paired

SCENES = ("merge", "split", "cross", "queue", "side-by-side")
ABLATED = ("merge", "split", "cross", "cross-same-speed", "pass-by", "queue", "party")
SUITES = ("standard", "friends-meet")
WITHOUT: Mapping[str, Mapping[str, object]] = {
    "corrections": {"corrections": False},
    "recapture": {"recapture_time": 0.0},
    "association by masses: the most probable group": {"association": "nearest"},
    "association by masses: all points": {"association": "all"},
    "association and group constraint": {"association": "none"},
    "all that is ours: preset paper": GroupPdaConfig.preset("paper").as_dict(),
}
SCENE_COLUMNS: Mapping[str, columns.Column] = {
    "lineage, all events": columns.pooled_lineage,
    "lineage, mean of sequences": columns.mean_of("lineage_accuracy"),
    "ids kept": columns.pooled_ids_kept,
    "group F1": columns.mean_of("group_F1_hull"),
    "core": columns.mean_of("group_F1_core"),
    "MOTA": columns.mean_of("group_MOTA"),
    "core ": columns.mean_of("group_MOTA_core"),
    "GDSR2": columns.mean_of("group_GDSR2"),
    "core  ": columns.mean_of("group_GDSR2_core"),
    "IDSW": columns.mean_of("group_IDSW"),
    "core   ": columns.mean_of("group_IDSW_core"),
    "pairwise F1": columns.mean_of("pairwise_F1"),
    "merge F1": columns.mean_of("merge_F1"),
    "split F1": columns.mean_of("split_F1"),
}
DECIDED = ("lineage_accuracy", "ids", "group_F1_hull", "group_MOTA", "event_F1", "group_IDSW")
EVENT_COLUMNS: Mapping[str, columns.Column] = {
    "event F1": columns.mean_of("event_F1"),
    "merge F1, all": columns.pooled_f1("merge"),
    "TP/FP/FN": columns.event_counts("merge"),
    "split F1, all": columns.pooled_f1("split"),
    "TP/FP/FN ": columns.event_counts("split"),
    "precision": columns.mean_of("event_precision"),
    "recall": columns.mean_of("event_recall"),
    "latency, s": columns.mean_of("event_latency"),
    "lineage": columns.pooled_lineage,
}
PX_PER_M = 40.0  # of friends-meet, from above
TABLE_2 = """columns of Bazzani et al. 2012, Table 2; on its own 28 sequences 1-FP 93.7 %, 1-FN 82.9 %, GDSR 79.7 %,
MOTP 16.7 px, MOTA 57.3 %. MSE is of the centres of matched groups here, of people there (2.2 px). First row: frames of
all sequences together; second: mean of sequences, in which sequences with few true groups weigh as much as others"""


def scenarios(given: argparse.Namespace) -> Any:
    """Prints a table per scene and returns its rows."""
    names = given.only.split(",") if given.only else SCENES
    entries = [entry for name in names for entry in resolve(name, given.set)]
    found = gathered(entries, given, compared(given))
    for scene, rows in found.items():
        title = f"{scene}: {heading(given, rows)}"
        table(title, "tracker", list(SCENE_COLUMNS), columns.filled(SCENE_COLUMNS, rows))
    return found


def decisions(given: argparse.Namespace) -> Any:
    """Prints the differences and returns the rows by scene and variant."""
    names = given.only.split(",") if given.only else ABLATED
    variants = (
        Variant("default", given.tracker),
        *(Variant(name, given.tracker, params) for name, params in WITHOUT.items()),
    )
    found = gathered([entry for name in names for entry in resolve(name, given.set)], given, variants)
    pooled = {v.name: [row for rows in found.values() for row in rows[v.name]] for v in variants}
    for scene, rows in {"all": pooled, **(found if given.each else {})}.items():
        default = columns.values(rows["default"], DECIDED)
        cells = {"default": [columns.mean_of(key)(rows["default"]) for key in DECIDED]}
        for name in WITHOUT:
            ends = paired(columns.values(rows[name], DECIDED), default)
            cells[f"default minus without {name}"] = [signed(*(float(e[k]) for e in ends)) for k in range(len(DECIDED))]
        title = f"{scene}: {heading(given, rows)}; paired differences"
        table(title, "", ["ids kept" if key == "ids" else key for key in DECIDED], cells)
    return found


def events(given: argparse.Namespace) -> Any:
    """Prints the tables of each suite and returns its rows by scene and variant."""
    found = {}
    for suite in given.only.split(",") if given.only else SUITES:
        by_scene = gathered(resolve(f"suite:{suite}", given.set), given, compared(given))
        rows = {name: [r for scene in by_scene.values() for r in scene.get(name, ())] for name in _names(by_scene)}
        table(f"{suite}: {heading(given, rows)}", "tracker", list(EVENT_COLUMNS), columns.filled(EVENT_COLUMNS, rows))
        if suite == "friends-meet":
            for part, end in (("strict", ""), ("core", "_core")):
                cells: dict[str, list[str]] = {}
                for name, some in rows.items():
                    scale = _scale(name, given)
                    cells |= columns.filled(_frames_pooled(end, scale), {name: some})
                    cells |= columns.filled(_means(end, scale), {f"{name}, mean of sequences": some})
                table(f"{suite}, {part}: {TABLE_2}", "tracker", list(_means(end, 1.0)), cells)
        found[suite] = by_scene
    return found


def compared(given: argparse.Namespace) -> tuple[Variant, ...]:
    """Returns the tracker and, without --alone, the trackers that it is compared with."""
    found = trackers(given.tracker, given.detections)
    return found[:1] if given.alone else found


def _means(end: str, scale: float) -> dict[str, columns.Column]:
    """Returns the columns of Table 2 as means over sequences; end: suffix of the keys; scale: px per unit."""
    return {
        **{name: columns.mean_of(f"group_{name}{end}") for name in ("1-FP", "1-FN", "GDSR")},
        "MSE, px²": columns.mean_of(f"group_MSE{end}", scale**2),
        "MOTP, px": columns.mean_of(f"group_MOTP{end}", scale),
        **{name: columns.mean_of(f"group_{name}{end}") for name in ("MOTA", "GDSR2")},
    }


def _frames_pooled(end: str, scale: float) -> dict[str, columns.Column]:
    """Returns the columns of Table 2 over the frames of all sequences together.

    Shares are of true groups, distances are means over matched groups.
    """

    def count(*names: str) -> columns.Number:
        return lambda row: sum(row[f"group_{name}{end}"] for name in names)

    def total(name: str, weight: columns.Number, factor: float = 1.0) -> columns.Number:
        return lambda row: factor * row[f"group_{name}{end}"] * weight(row) if weight(row) else 0.0

    there, hits, false, wrong = count("TP", "FN"), count("TP"), count("FP"), count("FP", "FN", "IDSW")
    return {
        "1-FP": columns.ratio(lambda row: there(row) - false(row), there),
        "1-FN": columns.ratio(hits, there),
        "GDSR": columns.ratio(total("GDSR", there), there),
        "MSE, px²": columns.ratio(total("MSE", hits, scale**2), hits),
        "MOTP, px": columns.ratio(total("MOTP", hits, scale), hits),
        "MOTA": columns.ratio(lambda row: there(row) - wrong(row), there),
        "GDSR2": columns.ratio(total("GDSR2", there), there),
    }


def _scale(name: str, given: argparse.Namespace) -> float:
    """Returns px per unit of the scores of a variant."""
    return PX_PER_M if given.detections != "image" or name.endswith("on the ground") else 1.0


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


def _names(by_scene: Mapping[str, Mapping[str, object]]) -> list[str]:
    return list(dict.fromkeys(name for scene in by_scene.values() for name in scene))


def heading(given: argparse.Namespace, rows: Mapping[str, Sequence[Row]]) -> str:
    """Returns number of sequences, seeds and input, for the title of a table."""
    count = len(next(iter(rows.values()), ()))
    return f"{count} sequences, seeds {seeds_text(given.seeds)}, --detections {given.detections}"
