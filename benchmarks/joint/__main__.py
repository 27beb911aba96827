"""`joint`: the paper's Table 2, recordings, event classifier, numbers of particles, events, what departures are worth.

    python -m benchmarks.joint MODE [--seeds a:b] [--filter-seeds a:b] [--set k=v]… [--only A,B]

table2      friends-meet: the paper's columns for full, VAR1, VAR2, VAR3 and .2, and beside them the preset paper,
            group-pda, relational and the default grouping over blob; differences of variants, paired
recordings  seq_hotel, zara01 and Meet_WalkTogether1 from labelled positions with noise 0.1 m and 5 % misses: the
            columns of Table 3b and pairwise F1, beside relational and the default grouping over particle (--data)
classifier  the event classifier: confusion matrix, log loss, expected events per minute where nothing happens; with
            --recordings on true partitions of seq_hotel, zara01 and Meet_WalkTogether1
particles   friends-meet: accuracy and frames/s over N_x and N_z (--chart FILE.svg)
events      a suite (--suite): event F1, hits, false alarms, misses and latency, beside group-pda and the default
            grouping over blob and particle
ablation    friends-meet: scores without each departure from the paper that has a parameter, paired differences
process     friends-meet: the Dirichlet process as validity and as dynamics of partitions, with and without beliefs,
            paired differences to the paper's validity and events

A row of table2 holds a sequence's scores, means over filter seeds. Group scores are pooled over the frames of all
sequences together, strict and core, and of the first variant by kind of sequence; differences are of the means over
sequences, with 95 % intervals. Detections are the points of the simulated detector; `.2` has true positions, as in the
paper.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from benchmarks.joint import event_classifier
from benchmarks.support import chart, tables
from benchmarks.support.options import (
    HOTEL,
    WALK_TOGETHER,
    ZARA,
    add_data,
    add_seeds,
    new_parser,
    one_thread,
    seed_range,
    seeds_text,
)
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import resolve
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import DetectionMode
from sim.types import Sequence as Recording
from tracking.fitting.joint_events import event_rows
from tracking.papers.joint.config import JointConfig
from tracking.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval, paired

Row = dict[str, float]
SHARES = ("1-FP", "1-FN", "GDSR", "MOTA")
PAPER = {
    "full": ("93.7", "82.9", "79.7", "57.3"),
    "VAR1": ("93.8", "81.9", "78.3", "56.0"),
    "VAR2": ("82.1", "51.6", "48.1", "33.5"),
    "VAR3": ("65.1", "24.6", "18.9", "4.9"),
}
"""Table 2 of the paper, on its own 28 sequences, %: 1-FP, 1-FN, GDSR, MOTA."""
COMPARED = ("GDSR", "MOTA", "1-FN", "1-FP")
RECORDED = ("group_GDSR", "group_MOTA", "pairwise_F1")
PX_PER_M = 40.0
COUNTS = (10, 25, 50, 100)
DEPARTURES = (
    "belief_rate=0", "belief_memory=0", "group_share=1", "newcomers=alone", "validity_rate=0",
    "size_prior=none", "velocity_time=0", "lag=0.1", "normaliser=sampled",
    "weights=joint", "proposal=detection", "alpha=0", "alpha=0.5", "size_prior=all size_std=1.5",
    "estimate=histogram", "validity=bayesian", "validity=bayesian evidence_rate=20", "partition_dynamics=dirichlet",
)  # fmt: skip
"""Settings of the mode ablation."""
PROCESS = (
    "", "validity=bayesian", "partition_dynamics=dirichlet",
    "validity=bayesian partition_dynamics=dirichlet",
)  # fmt: skip
"""Settings of the mode process, run with beliefs and without."""


@dataclass(frozen=True)
class Variant:
    """A tracker, its parameters and its detections; seeds: False if its seed has no effect."""

    name: str
    tracker: str = "joint"
    params: Mapping[str, object] = field(default_factory=dict)
    detections: DetectionMode = "file"
    seeds: bool = True


VARIANTS = (
    Variant("full"),
    Variant("VAR1", params={"variant": "VAR1"}),
    Variant("VAR2", params={"variant": "VAR2"}),
    Variant("VAR3", params={"variant": "VAR3"}),
    Variant(".2", params={"individuals": "measured"}, detections="truth"),
    Variant("preset paper", params=JointConfig.preset("paper").as_dict()),
    Variant("relational", "relational"),
    Variant("group-pda", "group-pda", seeds=False),
    Variant("blob + default grouping", "blob", seeds=False),
)


def measured(sequence: Recording, variant: Variant, seeds: Iterable[int], settings: Sequence[str] = ()) -> list[Row]:
    """Returns the scores of a variant for each filter seed, with frames/s and the tracker's diagnostics."""
    params: object = variant.params
    if variant.tracker == "joint":
        params = JointConfig.from_dict(dict(variant.params)).with_set(*settings)
    rows = []
    for seed in list(seeds)[: None if variant.seeds else 1]:
        run = track(variant.tracker, sequence, params=params, detections=variant.detections, seed=seed)
        own = {k: v for k, v in run.info.get("diagnostics", {}).items() if v is not None}
        rows.append({**evaluate(sequence.truth, run), **own, "speed": run.info["frames_per_second"]})
    return rows


def mean_row(rows: Sequence[Row]) -> Row:
    """Returns the mean of each score over filter seeds; nan where a seed has none."""
    return {key: float(np.mean([row.get(key, np.nan) for row in rows])) for key in rows[0]}


def sequences(seeds: Iterable[int], suite: str = "friends-meet") -> Iterable[Recording]:
    """Yields the sequences of a suite; entries whose script is not fulfilled for a seed are named and left out."""
    for entry in resolve(f"suite:{suite}"):
        for seed in seeds:
            try:
                made = simulate(entry.scenario, seed, entry.repeat, ())
                assert made.truth is not None
            except FlockscopeError as error:
                print(f"{entry.name}, seed {seed}, left out: {error.line()}", flush=True)
                continue
            yield made


def pooled(rows: Sequence[Row], end: str) -> list[str]:
    """Returns cells of 1-FP, 1-FN, GDSR and MOTA of the frames of all sequences together, %, and MOTP, px."""

    def total(name: str) -> float:
        return float(np.nansum([row[f"group_{name}{end}"] for row in rows]))

    there = total("TP") + total("FN")
    found = [(r[f"group_TP{end}"], r[f"group_FN{end}"], r[f"group_GDSR{end}"], r[f"group_MOTP{end}"]) for r in rows]
    success = sum((tp + fn) * gdsr for tp, fn, gdsr, _ in found if tp + fn)
    place = sum(tp * motp for tp, _, _, motp in found if tp) / max(total("TP"), 1)
    wrong = total("FP") + total("FN") + total("IDSW")
    shares = 1 - total("FP") / there, total("TP") / there, success / there, 1 - wrong / there
    return [*(f"{100 * x:.1f}" for x in shares), f"{PX_PER_M * place:.1f}"]


def others(rows: Sequence[Row]) -> list[str]:
    """Returns cells of event F1, latency, pairwise F1, HOTA, effective shares, ancestors and frames/s: means."""

    def mean(key: str) -> str:
        values = [row.get(key, np.nan) for row in rows]
        return tables.number(float(np.nanmean(values)) if np.isfinite(values).any() else np.nan)

    latency = [row["event_latency"] for row in rows if np.isfinite(row["event_latency"])]
    keys = ("pairwise_F1", "HOTA", "effective_particles", "effective_particles_of_a_person", "distinct_ancestors")
    median = tables.number(float(np.median(latency))) if latency else "–"
    return [mean("event_F1"), median, *(mean(key) for key in keys), mean("speed").partition(".")[0]]


OTHERS = (
    "event F1", "latency, s (median)", "pairwise F1", "HOTA", "effective share", "of the least person", "ancestors",
    "frames/s",
)  # fmt: skip


def table2(given: argparse.Namespace) -> None:
    """Prints the table of variants and the paired differences."""
    chosen = [v for v in VARIANTS if not given.only or v.name in given.only.split(",")]
    rows: dict[str, list[Row]] = {v.name: [] for v in chosen}
    kinds = []
    for sequence in sequences(given.seeds):
        kinds.append(sequence.name.rstrip("-0123456789"))
        for v in chosen:
            rows[v.name].append(mean_row(measured(sequence, v, given.filter_seeds, given.set)))
    title = f"{len(rows[chosen[0].name])} sequences, seeds {seeds_text(given.seeds)}, "
    title += f"filter seeds {seeds_text(given.filter_seeds)}"
    for part, end in (("strict", ""), ("core", "_core")):
        cells = {name: [*pooled(found, end), " / ".join(PAPER.get(name, ()))] for name, found in rows.items()}
        columns = [*(f"{name}, %" for name in SHARES), "MOTP, px", "paper: 1-FP / 1-FN / GDSR / MOTA"]
        tables.table(f"{part}: {title}", "variant", columns, cells)
    tables.table(f"other scores: {title}", "variant", OTHERS, {name: others(found) for name, found in rows.items()})
    cells = {}
    for first, second in (("full", "VAR1"), ("VAR1", "VAR2"), ("full", "VAR2"), ("VAR2", "VAR3"), (".2", "full")):
        if first in rows and second in rows:
            cells[f"{first} − {second}"] = [difference(rows[first], rows[second], f"group_{k}") for k in COMPARED]
    if cells:
        tables.table("differences of means over sequences, strict", "", COMPARED, cells)
    first = chosen[0].name
    cells = {
        kind: pooled([row for row, name in zip(rows[first], kinds, strict=True) if name == kind], "_core")[:4]
        for kind in dict.fromkeys(kinds)
    }
    tables.table(f"core, {first}, by sequence: {title}", "sequences", [f"{name}, %" for name in SHARES], cells)


def difference(first: Sequence[Row], second: Sequence[Row], key: str) -> str:
    """Returns the cell of the paired difference of a score, first minus second."""
    a, b = (np.array([row[key] for row in rows]) for rows in (first, second))
    both = np.isfinite(a) & np.isfinite(b)
    return tables.signed(*map(float, paired(b[both], a[both])))


def recordings(given: argparse.Namespace) -> None:
    """Prints a table for each recording, and differences to its first row."""
    noisy = {"detect_prob": 0.95, "noise_m": 0.1}
    compared = [Variant("full"), *(Variant(n, params={"variant": n}) for n in ("VAR1", "VAR3")), VARIANTS[6]]
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


def classifier(given: argparse.Namespace) -> None:
    """Prints the scores of the event classifier on true partitions of unseen seeds, or of recordings."""
    if given.recordings:
        event_classifier.recordings(given.data)
        return
    truths = [sequence.truth for sequence in sequences(given.seeds)]
    rows = [event_rows(t, JointConfig().lag, k, wrong=False) for k, t in enumerate(truths) if t is not None]
    event_classifier.report(f"friends-meet, seeds {seeds_text(given.seeds)}", rows, truths[0].fps if truths[0] else 1.0)


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


def events(given: argparse.Namespace) -> None:
    """Prints a table of events on a suite: means of event F1 over sequences, sums of hits, false alarms and misses;
    and differences to its first row, of means over sequences."""
    compared = [Variant("joint"), Variant("group-pda", "group-pda", seeds=False)]
    compared += [Variant(f"{name} + default grouping", name, seeds=name != "blob") for name in ("particle", "blob")]
    compared = [v for v in compared if not given.only or v.name in given.only.split(",")]
    rows: dict[str, list[Row]] = {v.name: [] for v in compared}
    for sequence in sequences(given.seeds, given.suite):
        for v in compared:
            mean = mean_row(measured(sequence, v, given.filter_seeds, given.set))
            rows[v.name].append({**mean, "false": mean["merge_FP"] + mean["split_FP"]})
    cells = {}
    for name, found in rows.items():
        counts = [
            " / ".join(f"{np.nansum([row[f'{kind}_{k}'] for row in found]):.1f}" for k in ("TP", "FP", "FN"))
            for kind in ("merge", "split")
        ]
        latency = [row["event_latency"] for row in found if np.isfinite(row["event_latency"])]
        means = [float(np.nanmean([row[key] for row in found])) for key in ("event_F1", "group_F1", "pairwise_F1")]
        median = tables.number(float(np.median(latency))) if latency else "–"
        cells[name] = [*map(tables.number, means), *counts, median]
    columns = ["event F1", "group F1", "pairwise F1", "merges: hits / false / missed", "splits", "latency, s (median)"]
    title = f"{given.suite}, {len(rows[compared[0].name])} sequences, seeds {seeds_text(given.seeds)}, "
    tables.table(title + f"filter seeds {seeds_text(given.filter_seeds)}", "tracker", columns, cells)
    first, *rest = (v.name for v in compared)
    keys = {"event F1": "event_F1", "group F1": "group_F1", "pairwise F1": "pairwise_F1", "false events": "false"}
    cells = {f"{first} − {name}": [difference(rows[first], rows[name], key) for key in keys.values()] for name in rest}
    tables.table("differences of means over sequences", "", list(keys), cells)


def ablation(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings, columns scores pooled over frames and paired differences to the defaults."""
    made, base = list(sequences(given.seeds)), []
    deltas = {"GDSR": "group_GDSR", "MOTA": "group_MOTA", "event F1": "event_F1"}
    shown = "event F1", "of the least person"
    tables.head(["setting", *(f"{name}, %" for name in SHARES), *shown, *(f"Δ {name}" for name in deltas)])
    for setting in ("", *(given.only.split(",") if given.only else DEPARTURES)):
        v = Variant("")
        rows = [mean_row(measured(s, v, given.filter_seeds, [*given.set, *setting.split()])) for s in made]
        base = base or rows
        differences = [difference(rows, base, key) for key in deltas.values()]
        own = dict(zip(OTHERS, others(rows), strict=True))
        tables.row([setting or "defaults", *pooled(rows, "_core")[:4], *(own[name] for name in shown), *differences])


def process(given: argparse.Namespace) -> None:
    """Prints a table: rows are settings with and without beliefs, with differences to the first row of each half."""
    made = list(sequences(given.seeds))
    deltas = ("GDSR", "MOTA", "1-FP", "1-FN")
    tables.head(["setting", *(f"{k}, %" for k in SHARES), *OTHERS, *(f"Δ {k}" for k in deltas), "Δ event F1"])
    for belief in ("", "belief_rate=0"):
        base: list[Row] = []
        for setting in given.only.split(",") if given.only else PROCESS:
            words = [*given.set, *setting.split(), *belief.split()]
            rows = [mean_row(measured(s, Variant(""), given.filter_seeds, words)) for s in made]
            base = base or rows
            differences = [difference(rows, base, key) for key in (*(f"group_{k}" for k in deltas), "event_F1")]
            name = " ".join([setting, belief]).strip() or "defaults"
            tables.row([name, *pooled(rows, "_core")[:4], *others(rows), *differences])


def main() -> None:
    parser = new_parser(__doc__)
    modes = {
        "table2": table2, "recordings": recordings, "classifier": classifier, "particles": particles, "events": events,
        "ablation": ablation, "process": process,
    }  # fmt: skip
    parser.add_argument("mode", choices=modes)
    add_seeds(parser, "20000:20001")
    parser.add_argument("--filter-seeds", type=seed_range, default="0:5", metavar="A:B", help="seeds of the filters")
    parser.add_argument("--set", action="append", default=[], metavar="K=V", help="parameters of joint")
    parser.add_argument("--suite", default="standard", help="of mode events")
    parser.add_argument("--recordings", action="store_true", help="mode classifier: labelled recordings (--data)")
    parser.add_argument("--chart", type=Path, metavar="FILE.svg", help="mode particles: draw it")
    parser.add_argument(
        "--only", help="table2, recordings, events: variants; ablation, process: settings; separated by commas"
    )
    add_data(parser)
    given = parser.parse_args()
    modes[given.mode](given)


if __name__ == "__main__":
    one_thread()
    main()
