"""Runs of `joint` and of what it is compared with on simulated sequences, and the cells of their tables."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from benchmarks.support import tables
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import DetectionMode
from sim.types import Sequence as Recording
from tracking.papers.joint.config import JointConfig
from tracking.running.run import track
from tracking.scoring import evaluate

Row = dict[str, float]
SHARES = ("1-FP", "1-FN", "GDSR", "MOTA")
PX_PER_M = 40.0


@dataclass(frozen=True)
class Variant:
    """Parameters of `joint`, and the detections it gets."""

    name: str
    params: Mapping[str, object] = field(default_factory=dict)
    detections: DetectionMode = "file"


def measured(sequence: Recording, variant: Variant, seeds: Iterable[int], settings: Sequence[str] = ()) -> list[Row]:
    """Returns the scores of a variant for each filter seed, and `MSE`, the mean square error of positions, px^2."""
    params, rows = JointConfig.from_dict(dict(variant.params)).with_set(*settings), []
    for seed in seeds:
        run = track("joint", sequence, params=params, detections=variant.detections, seed=seed)
        found = evaluate(sequence.truth, run)
        rows.append({**found, "MSE": (PX_PER_M * found["RMSE_pos"]) ** 2})
    return rows


def mean_row(rows: Sequence[Row]) -> Row:
    """Returns the mean of each score over filter seeds; nan where a seed has none."""
    return {key: float(np.mean([row.get(key, np.nan) for row in rows])) for key in rows[0]}


def with_false_events(row: Row) -> Row:
    """Returns the row with `false`, the number of false merges and splits."""
    return {**row, "false": row["merge_FP"] + row["split_FP"]}


def sequences(seeds: Iterable[int], suite: str = "friends-meet") -> Iterable[Recording]:
    """Yields one sequence of each scenario and seed of a suite; those whose script is not fulfilled are left out."""
    for entry in resolve(f"suite:{suite}"):
        for seed in seeds if entry.repeat <= 1 else ():
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
    placed = [(tp, motp) for tp, _, _, motp in found if np.isfinite(motp)]
    place = sum(tp * motp for tp, motp in placed) / max(sum(tp for tp, _ in placed), 1)
    wrong = total("FP") + total("FN") + total("IDSW")
    shares = 1 - total("FP") / there, total("TP") / there, success / there, 1 - wrong / there
    return [*(f"{100 * x:.1f}" for x in shares), f"{PX_PER_M * place:.1f}"]


def difference(first: Sequence[Row], second: Sequence[Row], key: str) -> str:
    """Returns the cell of the paired difference of a score, first minus second."""
    a, b = (np.array([row[key] for row in rows]) for rows in (first, second))
    return tables.difference_cell(a - b, key)
