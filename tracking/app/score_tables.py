"""Scores as tables for a terminal: a row for each sequence, the mean with its interval beneath."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tracking.app.score_command import Row

SHOWN = ("HOTA", "DetA", "AssA", "MOTA", "MOTP", "IDF1", "FP", "FN", "IDSW")
"""What a terminal has room for; --json holds everything."""

COUNTS = ("TP", "FP", "FN", "IDSW")

MEANING = {
    "boxes": "overlap (IoU) of boxes",
    "ground": "1 - distance / 2 m on the ground",
    "image": "1 - distance / 2 m in the image",
}

Means = dict[str, dict[str, float]]


def tables(rows: list[Row], means: Means) -> Any:
    """One column for each score that is shown; the mean and its 95 % interval where there are several sequences."""
    from rich.table import Table
    from rich.text import Text

    names = [name for name in SHOWN if name in means]
    used = ", ".join(MEANING[kind] for kind in dict.fromkeys(row.scores.similarity for row in rows))
    caption = Text(f"similarity: {used}")
    table = Table(box=None, pad_edge=False, header_style="bold", caption=caption, caption_justify="left")
    table.add_column("sequence", overflow="fold")
    for name in names:
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(row.sequence, *(number(name, row.scores[name]) for name in names))
    if len(rows) > 1:
        table.add_row("mean", *(number(name, means[name]["mean"], mean=True) for name in names), style="bold")
        for end in ("low", "high"):
            table.add_row(f"95 % {end}", *(number(name, means[name][end], mean=True) for name in names))
    return table


def number(name: str, value: float, *, mean: bool = False) -> str:
    """A score as text: fractions with three digits, counts whole, their means with one; nan ("not labelled") a dash."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3f}" if name not in COUNTS else f"{value:.{int(mean)}f}"
