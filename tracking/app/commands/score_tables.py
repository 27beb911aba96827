"""Scores as tables for a terminal: a row for each sequence, the mean with its interval beneath."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from tracking.scoring.catalogue import CATALOGUE

if TYPE_CHECKING:
    from tracking.app.commands.score import Row

SHOWN = ("HOTA", "MOTA", "IDF1", "group_F1", "group_GDSR2", "group_MOTA", "pairwise_F1", "event_F1", "event_latency")
"""The few that stand for all, where there is room for one line."""

PEOPLE = ("objective", "HOTA", "DetA", "AssA", "MOTA", "MOTP", "IDF1", "FP", "FN", "IDSW", "GOSPA")
GROUPS = tuple(
    f"group_{name}" for name in ("1-FP", "1-FN", "GDSR", "GDSR2", "MOTP", "MOTA", "IDSW", "F1", "HOTA", "AssA")
)
EVENTS = (
    "pairwise_F1", "event_F1", "event_latency", "merge_F1", "split_F1", "cross_F1", "queue_F1", "lineage_accuracy",
)  # fmt: skip
TABLES = {
    "people": PEOPLE,
    "groups, strict": GROUPS,
    "groups, core (without 1 s before and after each true merge and split)": tuple(f"{key}_core" for key in GROUPS),
    "members and events": EVENTS,
}
"""What a terminal has room for; --json holds everything."""

OF_GROUPS = {title: PEOPLE[:1] * (keys is GROUPS) + keys for title, keys in TABLES.items() if keys is not PEOPLE}
"""The same for a tracker that knows groups only: the objective is theirs."""

SIMILARITY = {
    "boxes": "overlap (IoU) of boxes",
    "ground": "1 - distance / 2 m on the ground",
    "image": "1 - distance / 2 m in the image",
}
MATCHED = {"hull": "overlap (IoU) of hulls", "members": "common members (Jaccard index)"}
SURFACE = {"ground": "on the ground, m", "image": "in the image, px"}

ENOUGH = 100
"""Sequences from which a difference counts."""

Means = dict[str, dict[str, float]]


def tables(rows: list[Row], means: Means, notes: Sequence[str] = (), total: int = 0) -> Any:
    """A table for each family of which something is known, by what people and groups were compared, and the notes.

    total: so many sequences have been scored; where these are not all, what their tracker saw stands above them.
    """
    from rich.console import Group

    seen = f"detections {said([rows[0].given])}"
    people = _known(PEOPLE[1:], means)
    titles = TABLES if people else OF_GROUPS
    known = {title: keys for title, keys in titles.items() if _known(keys, means)}
    parts = [_table(title, keys, rows, means) for title, keys in known.items()]
    lines = [seen, *_compared(rows, people, "groups, strict" in known)]
    if len(rows) == 1 and math.isfinite(means["objective"]["low"]):
        lines.append("intervals by moving blocks of frames")
    some = len(rows) < total
    head = [f"{len(rows)} of {total} sequences, {seen}", ""] if some else []
    return Group(*head, *parts, "\n".join([*lines, *notes]), *([""] if some else []))


def _known(keys: Sequence[str], means: Means) -> bool:
    return any(math.isfinite(means[key]["mean"]) for key in keys)


def said(given: Sequence[str]) -> str:
    """What trackers saw, in words."""
    return ", ".join(words or "not said (no run.json)" for words in given)


def _table(title: str, keys: tuple[str, ...], rows: list[Row], means: Means) -> Any:
    table = _empty()
    table.add_column("sequence", overflow="fold")
    for key in keys:
        table.add_column(key.removeprefix("group_").removesuffix("_core"), justify="right", no_wrap=True)
    for row in rows:
        table.add_row(row.sequence, *(number(key, row.scores[key]) for key in keys))
    if any(math.isfinite(means[key]["low"]) for key in keys):
        for name, part in (("mean", "mean"), ("95 % low", "low"), ("95 % high", "high"))[len(rows) == 1 :]:
            cells = (number(key, means[key][part], mean=True) for key in keys)
            table.add_row(name, *cells, style="bold" if part == "mean" else None)
    return _headed(title, table)


def _empty() -> Any:
    from rich.table import Table

    return Table(box=None, pad_edge=False, header_style="bold")


def _headed(title: str, table: Any) -> Any:
    """A title that is not folded into the width of its table."""
    from rich.console import Group
    from rich.text import Text

    return Group(Text(title, style="italic"), table, "")


def _compared(rows: list[Row], people: bool, groups: bool) -> list[str]:
    def each(words: dict[str, str], name: str) -> str:
        return ", ".join(words[kind] for kind in dict.fromkeys(getattr(row.scores, name) for row in rows))

    lines = [f"people by {each(SIMILARITY, 'similarity')}" if people else "people are not tracked"]
    if not groups:
        return [*lines, "groups are not labelled"]
    return [*lines, f"groups by {each(MATCHED, 'group_match')}, {each(SURFACE, 'surface')}"]


def differences(found: Means, sequences: int) -> Any:
    """How the means differ from those of other tracks; a star where the interval is off zero."""
    over = "the same frames" if sequences == 1 else f"{sequences} sequences"
    title = f"these tracks minus --against, in pairs over {over}"
    title += "" if sequences >= ENOUGH or sequences == 1 else f" (fewer than {ENOUGH}: an indication)"
    table = _empty()
    for name in ("score", "difference", "95 % low", "95 % high", ""):
        table.add_column(name, justify="left" if name == "score" else "right")
    for key in (key for keys in TABLES.values() for key in keys):
        d = found[key]
        if math.isfinite(d["mean"]):
            cells = (number(key, d[part], mean=True) for part in ("mean", "low", "high"))
            table.add_row(key, *cells, "*" if d["low"] > 0 or d["high"] < 0 else "")
    return _headed(title, table)


def number(key: str, value: float, *, mean: bool = False) -> str:
    """A score as text: fractions with three digits, counts whole, their means with one; nan ("not labelled") a dash."""
    if not math.isfinite(value):
        return "–"
    return f"{value:.3f}" if CATALOGUE[key].unit != "count" else f"{value:.{int(mean)}f}"
