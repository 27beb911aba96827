"""Tables of scores for the terminal: a row per sequence, with the mean and its 95 % interval below."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scenarios.printable import printable
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.stats import FEWEST

SHOWN = ("HOTA", "MOTA", "IDF1", "group_F1", "group_GDSR2", "group_MOTA", "pairwise_F1", "event_F1", "event_latency")
"""The keys that are shown where there is room for one line only."""

PEOPLE = ("objective", "HOTA", "DetA", "AssA", "MOTA", "MOTP", "IDF1", "FP", "FN", "IDSW", "GOSPA")
GROUPS = tuple(
    f"group_{name}" for name in ("1-FP", "1-FN", "GDSR", "GDSR2", "MOTP", "MOTA", "IDSW", "F1", "HOTA", "AssA")
)
MEMBERS = ("pairwise_F1", "GMITRE_F1", "right_groups_F1", "exact_groups_F1")
EVENTS = ("event_F1", "event_latency", "merge_F1", "split_F1", "cross_F1", "queue_F1", "lineage_accuracy")
TABLES = {
    "people": PEOPLE,
    "groups, strict": GROUPS,
    "groups, core (without 1 s before and after each true merge and split)": tuple(f"{key}_core" for key in GROUPS),
    "members": MEMBERS,
    "events": EVENTS,
}
"""Title and keys of each table. Only keys of groups have a core score. --json holds every key of the catalogue."""

GROUP_TRACKER_TABLES = {
    title: PEOPLE[:1] * (keys is GROUPS) + keys for title, keys in TABLES.items() if keys is not PEOPLE
}
"""The tables for a tracker that reports groups without people: the objective moves to the groups' table."""

SIMILARITY = {
    "boxes": "overlap (IoU) of boxes",
    "ground": "1 - distance / 2 m on the ground",
    "image": "1 - distance / 2 m in the image",
}
GROUP_MATCH = {"hull": "overlap (IoU) of hulls (group_F1: common members)", "members": "common members (Jaccard index)"}
SURFACE = {"ground": "on the ground, m", "image": "in the image, px"}

ENOUGH = 100
"""A difference over fewer sequences than this is called an indication."""

Means = dict[str, dict[str, float]]
"""By key: "mean", and "low" and "high" of its 95 % interval; nan where unknown."""


@dataclass(frozen=True)
class SequenceScores:
    """The scores of one sequence. sequence: its name. scores: by key, nan where unknown. given: what detections the
    tracker got, in words; "" if there is no run.json."""

    sequence: str
    scores: Scores
    given: str = ""


def tables(rows: list[SequenceScores], means: Means, notes: Sequence[str] = (), total: int = 0) -> Any:
    """Returns something rich can print: one table per family of scores that has a known mean, then how people and
    groups were compared.

    rows: at least one sequence, all trackers given the same detections. means: by key, with interval. total: the number
    of all scored sequences; if it is larger than the number of rows, a heading says which detections these rows belong
    to. notes: further lines below.
    """
    from rich.console import Group

    detections = f"detections {detections_words([rows[0].given])}"
    people = _any_known(PEOPLE[1:], means)
    titles = TABLES if people else GROUP_TRACKER_TABLES
    known = {title: keys for title, keys in titles.items() if _any_known(keys, means)}
    parts = [_table(title, keys, rows, means) for title, keys in known.items()]
    lines = [detections, *_comparison_lines(rows, people, "groups, strict" in known)]
    if len(rows) == 1 and math.isfinite(means["objective"]["low"]):
        lines.append("intervals by weights of blocks of frames")
    partial = len(rows) < total
    head = [f"{len(rows)} of {total} sequences, {detections}", ""] if partial else []
    return Group(*head, *parts, "\n".join([*lines, *notes]), *([""] if partial else []))


def _any_known(keys: Sequence[str], means: Means) -> bool:
    return any(math.isfinite(means[key]["mean"]) for key in keys)


def detections_words(given: Sequence[str]) -> str:
    """Returns the detections that trackers got, in words, separated by commas; "unknown (no run.json)" for ""."""
    return ", ".join(printable(words) or "unknown (no run.json)" for words in given)


def _table(title: str, keys: tuple[str, ...], rows: list[SequenceScores], means: Means) -> Any:
    table = empty_table()
    table.add_column("sequence", overflow="fold")
    for key in keys:
        table.add_column(_heading(key, rows), justify="right", no_wrap=True)
    for row in rows:
        table.add_row(printable(row.sequence), *(number(key, row.scores[key]) for key in keys))
    if any(math.isfinite(means[key]["low"]) for key in keys):
        for name, part in (("mean", "mean"), ("95 % low", "low"), ("95 % high", "high"))[len(rows) == 1 :]:
            cells = (number(key, means[key][part], mean=True) for key in keys)
            table.add_row(name, *cells, style="bold" if part == "mean" else None)
    return with_title(title, table)


def _heading(key: str, rows: Sequence[SequenceScores]) -> str:
    """Returns the key as the heading of a column; with its unit if that depends on where people are compared."""
    unit = "/".join(dict.fromkeys("m" if row.scores.surface == "ground" else "px" for row in rows))
    short = key.removeprefix("group_").removesuffix("_core")
    return f"{short} ({unit})" if CATALOGUE[key].unit == "m | px" else short


def empty_table() -> Any:
    """Returns a table of rich without columns and frame."""
    from rich.table import Table

    return Table(box=None, pad_edge=False, header_style="bold")


def with_title(title: str, table: Any, foot: str = "") -> Any:
    """Returns, for rich to print, the title above the table, not wrapped to the table's width, and below it the foot,
    if any, and an empty line."""
    from rich.console import Group
    from rich.text import Text

    return Group(Text(title, style="italic"), table, *([foot] if foot else []), "")


def _comparison_lines(rows: list[SequenceScores], people: bool, groups: bool) -> list[str]:
    """Returns two lines: what people and groups were compared by, or that they are not tracked or not labelled.

    people, groups: whether any score of these is known. Different ways in `rows` are all named, in order of first
    appearance.
    """

    def each(words: dict[str, str], name: str) -> str:
        return ", ".join(words[kind] for kind in dict.fromkeys(getattr(row.scores, name) for row in rows))

    lines = [f"people compared by {each(SIMILARITY, 'similarity')}" if people else "people are not tracked"]
    if not groups:
        return [*lines, "groups are not labelled"]
    return [*lines, f"groups compared by {each(GROUP_MATCH, 'group_match')}, {each(SURFACE, 'surface')}"]


def difference_table(differences: Means, sequences: int) -> Any:
    """Returns a rich table of the differences to other tracks, with a star where the interval does not hold zero.

    differences: by key, with "mean", "low" and "high" of the 95 % interval, and over sequences "pairs", the number of
    pairs in which the score is known. Keys with an unknown mean are left out. With fewer than 6 pairs there is no star,
    and a line below says so. sequences: number of pairs; 1 stands for one recording in blocks of frames. The title
    calls 2 to 99 an indication.
    """
    over = "the same frames" if sequences == 1 else f"{sequences} sequences"
    title = f"these tracks minus --against, in pairs over {over}"
    title += "" if sequences >= ENOUGH or sequences == 1 else f" (fewer than {ENOUGH}: an indication)"
    table, few = empty_table(), False
    for name in ("score", "difference", "95 % low", "95 % high", ""):
        table.add_column(name, justify="left" if name == "score" else "right")
    for key in (key for keys in TABLES.values() for key in keys):
        d = differences[key]
        if math.isfinite(d["mean"]):
            cells = (number(key, d[part], mean=True) for part in ("mean", "low", "high"))
            table.add_row(key, *cells, "*" if is_sure(d) else "")
            few = few or d.get("pairs", FEWEST) < FEWEST
    foot = f"no star below {FEWEST} pairs: so few cannot show a sure difference" if few and sequences > 1 else ""
    return with_title(title, table, foot)


def is_sure(difference: Mapping[str, float]) -> bool:
    """Returns True if a difference has an interval without zero and, over sequences, at least 6 pairs.

    difference: "low" and "high" (nan: unknown), and over sequences "pairs".
    """
    return difference.get("pairs", FEWEST) >= FEWEST and (difference["low"] > 0 or difference["high"] < 0)


def number(key: str, value: float, *, mean: bool = False) -> str:
    """Returns a score as text: three decimals, none for a count, one for the mean of a count; a dash for nan and
    infinity.

    key: of the catalogue, KeyError for another. mean: True for a mean over sequences.
    """
    if not math.isfinite(value):
        return "–"
    return f"{value:.3f}" if CATALOGUE[key].unit != "count" else f"{value:.{int(mean)}f}"
