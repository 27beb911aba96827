"""Columns of the tables of `group-pda`: each maps the rows of several sequences to one cell.

A row (`benchmarks.group_pda.runs.Row`) holds the scores of one sequence by key. Means have Student's interval over
sequences, ratios of sums a bootstrap interval, pooled shares Wilson's; all intervals are 95 % intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.group_pda.runs import Row
from benchmarks.support.tables import interval, share
from sim.types import Array
from tracking.stats import DRAWS, LEVEL, mean_interval

Column = Callable[[Sequence[Row]], str]
Number = Callable[[Row], float]
HEADLINE = ("merge_TP", "merge_FN", "split_TP", "split_FN")


def filled(columns: Mapping[str, Column], rows: Mapping[str, Sequence[Row]]) -> dict[str, list[str]]:
    """Returns the cells of each tracker, from its rows."""
    return {name: [column(some) for column in columns.values()] for name, some in rows.items()}


def mean_of(key: str, scale: float = 1.0) -> Column:
    """Mean of a score over the sequences in which it is known, times `scale`."""
    return lambda rows: interval(*(scale * float(x[0]) for x in mean_interval(values(rows, [key]))))


def ratio(part: Number, whole: Number) -> Column:
    """Sum of `part` over sum of `whole`, both over all sequences; a dash if the latter is 0."""

    def cell(rows: Sequence[Row]) -> str:
        a, b = (np.array([of(r) for r in rows]) for of in (part, whole))
        if not b.sum():
            return "–"
        n = len(rows)
        times = np.random.default_rng(0).multinomial(n, np.full(n, 1 / n), size=DRAWS)
        times = times[times @ b > 0]
        ends = np.quantile(times @ a / (times @ b), ((1 - LEVEL) / 2, (1 + LEVEL) / 2)) if n > 1 else np.full(2, np.nan)
        return interval(a.sum() / b.sum(), *ends)

    return cell


def pooled_f1(kind: str) -> Column:
    """F1 of one kind of events from the counts of all sequences together."""

    def cell(rows: Sequence[Row]) -> str:
        hits, false, missed = (total(rows, f"{kind}_{count}") for count in ("TP", "FP", "FN"))
        return f"{2 * hits / (2 * hits + false + missed):.3f}" if hits + false + missed else "–"

    return cell


def event_counts(kind: str) -> Column:
    """True positives, false positives and false negatives of one kind of events, all sequences together."""
    return lambda rows: "/".join(f"{total(rows, f'{kind}_{count}'):.0f}" for count in ("TP", "FP", "FN"))


def pooled_lineage(rows: Sequence[Row]) -> str:
    """Share of all true merges and splits that are reported with the right parents and children."""
    there = [sum(r[key] for key in HEADLINE) for r in rows]
    right = [r["lineage_accuracy"] * n if n else 0.0 for r, n in zip(rows, there, strict=True)]
    hits = np.round(right)
    assert np.allclose(right, hits), "in a simulated sequence all parents and children are known"
    return share(int(hits.sum()), int(sum(there)))


def pooled_ids_kept(rows: Sequence[Row]) -> str:
    """Share of all encounters of two groups after which both have the id that they had before."""
    return share(int(total(rows, "kept")), int(total(rows, "pairs")))


def values(rows: Sequence[Row], keys: Sequence[str]) -> Array:
    """Returns scores (sequences, keys); the key "ids" is the share of a sequence's encounters that keep both ids."""
    return np.array([[_ids_kept(r) if key == "ids" else r[key] for key in keys] for r in rows]).reshape(-1, len(keys))


def total(rows: Sequence[Row], key: str) -> float:
    """Returns the sum of a score over all sequences in which it is known."""
    return float(np.nansum([r[key] for r in rows]))


def _ids_kept(row: Row) -> float:
    return row["kept"] / row["pairs"] if row["pairs"] else float("nan")
