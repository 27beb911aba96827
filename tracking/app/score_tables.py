"""Scores as tables for a terminal: fractions with three digits, counts whole, the mean with its interval beneath."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracking.app.score_command import Row

Means = dict[str, dict[str, float]]


def tables(rows: list[Row], means: Means) -> Any:
    """One row for each sequence, one column for each score; the mean and its 95 % interval where there are several."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("sequence", no_wrap=True)
    for name in means:
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(row.sequence, *(number(row.scores[name]) for name in means))
    if len(rows) > 1:
        table.add_section()
        table.add_row("mean", *(number(m["mean"]) for m in means.values()), style="bold")
        for end in ("low", "high"):
            table.add_row(f"  95 % {end}", *(number(m[end]) for m in means.values()))
    return table


def number(value: float) -> str:
    """A score as text; nan, which stands for "not labelled", as a dash."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.0f}" if abs(value) >= 10 else f"{value:.3f}"
