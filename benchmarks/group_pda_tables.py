"""Tables of means and shares with 95 % intervals, as Markdown, for benchmarks/group_pda.py."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from benchmarks.group_pda_runs import Row
from sim.types import Array
from tracking.stats import DRAWS, LEVEL, bootstrap, wilson

Column = Callable[[Sequence[Row]], str]
Number = Callable[[Row], float]
EXACT = 1e-12  # nearer to 0 than rounding can be
HEADLINE = ("merge_TP", "merge_FN", "split_TP", "split_FN")


def table(title: str, first: str, columns: Sequence[str], rows: Mapping[str, Sequence[str]]) -> None:
    """Prints it: rows by the name in their first cell."""
    print(f"\n{title}\n\n| {first} | " + " | ".join(columns) + " |\n|---" + "|---" * len(columns) + "|")
    for name, cells in rows.items():
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


def filled(columns: Mapping[str, Column], rows: Mapping[str, Sequence[Row]]) -> dict[str, list[str]]:
    """The cells of each name's rows."""
    return {name: [column(some) for column in columns.values()] for name, some in rows.items()}


def mean_of(key: str, scale: float = 1.0) -> Column:
    """Mean over the sequences that have this score, drawn again sequence by sequence."""
    return lambda rows: interval(*(scale * float(x[0]) for x in bootstrap(values(rows, [key]))))


def ratio(part: Number, whole: Number) -> Column:
    """Sum of parts over sum of wholes, both of all sequences, drawn again sequence by sequence."""

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
    """F1 of the counts of all sequences."""

    def cell(rows: Sequence[Row]) -> str:
        hits, false, missed = (total(rows, f"{kind}_{count}") for count in ("TP", "FP", "FN"))
        return f"{2 * hits / (2 * hits + false + missed):.3f}" if hits + false + missed else "–"

    return cell


def events_of(kind: str) -> Column:
    """Hits, false and missed ones of all sequences."""
    return lambda rows: "/".join(f"{total(rows, f'{kind}_{count}'):.0f}" for count in ("TP", "FP", "FN"))


def lineage_pooled(rows: Sequence[Row]) -> str:
    """Share of all true merges and splits that are told with the right parents and children."""
    there = [sum(r[key] for key in HEADLINE) for r in rows]
    right = [r["lineage_accuracy"] * n if n else 0.0 for r, n in zip(rows, there, strict=True)]
    hits = np.round(right)
    assert np.allclose(right, hits), "in a simulated sequence all parents and children are known"
    return share(int(hits.sum()), int(sum(there)))


def kept_pooled(rows: Sequence[Row]) -> str:
    """Share of all encounters after which both groups have the ids they had before."""
    return share(int(total(rows, "kept")), int(total(rows, "pairs")))


def values(rows: Sequence[Row], keys: Sequence[str]) -> Array:
    """(sequences, keys); "ids" is the share of a sequence's encounters that keep both ids."""
    return np.array([[own_share(r) if key == "ids" else r[key] for key in keys] for r in rows]).reshape(-1, len(keys))


def own_share(row: Row) -> float:
    """Encounters of one sequence that keep both ids; nan without any."""
    return row["kept"] / row["pairs"] if row["pairs"] else float("nan")


def total(rows: Sequence[Row], key: str) -> float:
    """Sum over all sequences, unknown ones (nan) left out."""
    return float(np.nansum([r[key] for r in rows]))


def share(hits: int, count: int) -> str:
    """A share with Wilson's interval, and of how many."""
    middle, low, high = wilson(hits, count)
    return f"{interval(middle, low, high)} {hits}/{count}" if count else "–"


def interval(mean: float, low: float, high: float) -> str:
    """A mean and the ends of its interval."""
    if not np.isfinite(mean):
        return "–"
    return f"{mean:.3f}" + (f" [{low:.3f}, {high:.3f}]" if np.isfinite(low) else "")


def signed(mean: float, low: float, high: float) -> str:
    """A difference; * where 0 is not in its interval."""
    if not np.isfinite(mean):
        return "–"
    ends = f" [{low:+.3f}, {high:+.3f}]" if np.isfinite(low) else ""
    return f"{mean:+.3f}{ends}" + (" *" if low > EXACT or high < -EXACT else "")
