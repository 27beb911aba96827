"""Tables of scores for the terminal: a row per sequence, with the mean and its 95 % interval below."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO

import numpy as np

from scenarios.errors import InputError, printable
from tracking.scoring.catalogue import ALL, CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.scoring.pooling import pooled
from tracking.stats import FEWEST, score_interval

# The keys that are shown where there is room for one line only.
SHOWN = ("HOTA", "MOTA", "IDF1", "group_F1", "group_GDSR2", "group_MOTA", "pairwise_F1", "event_F1", "event_latency")

PEOPLE = ("objective", "HOTA", "DetA", "AssA", "MOTA", "MOTP", "IDF1", "FP", "FN", "IDSW", "GOSPA")
GROUPS = tuple(
    f"group_{name}" for name in ("1-FP", "1-FN", "GDSR", "GDSR2", "MOTP", "MOTA", "IDSW", "F1", "HOTA", "AssA")
)
MEMBERS = ("pairwise_F1", "GMITRE_F1", "right_groups_F1", "exact_groups_F1")
EVENTS = ("event_F1", "event_latency", "merge_F1", "split_F1", "cross_F1", "queue_F1", "lineage_accuracy")
# Title and keys of each table. Only keys of groups have a core score. --json holds every key of the catalogue.
TABLES = {
    "people": PEOPLE,
    "groups, strict": GROUPS,
    "groups, core (without 1 s before and after each true merge and split)": tuple(f"{key}_core" for key in GROUPS),
    "members": MEMBERS,
    "events": EVENTS,
}

# The tables for a tracker that reports groups without people: the objective moves to the groups' table.
GROUP_TRACKER_TABLES = {
    title: PEOPLE[:1] * (keys is GROUPS) + keys for title, keys in TABLES.items() if keys is not PEOPLE
}

SIMILARITY = {
    "boxes": "overlap (IoU) of boxes",
    "ground": "1 - distance / 2 m on the ground",
    "image": "1 - distance / 2 m in the image",
}
GROUP_MATCH = {"hull": "overlap (IoU) of hulls (group_F1: common members)", "members": "common members (Jaccard index)"}
SURFACE = {"ground": "on the ground, m", "image": "in the image, px"}

LOWER = "↓ lower is better"  # The meaning of the arrow in headings.

Rows = Sequence[tuple[str, Scores]]  # Name and scores of each sequence; scores are nan where unknown.
# By key: "mean", and "low" and "high" of its 95 % interval; nan where unknown. "indicative" (bool): of few sequences.
Means = dict[str, dict[str, float]]

FEW = f"intervals of fewer than {FEWEST} sequences are indicative"
POOLED = "pooled: all sequences as one, as TrackEval's COMBINED, without an interval"

CSV_HEAD = b"run,row,sequence,"  # the first line of a table of scores begins so


def summary(scores: Iterable[Scores]) -> Means:
    """Returns the mean over sequences of each score by key, with its 95 % interval, within the score's range."""
    found = list(scores)
    ends = {score.key: score_interval(score, np.array([[one[score.key]] for one in found])) for score in ALL}
    return {key: {part: values.tolist()[0] for part, values in one.items()} for key, one in ends.items()}


def csv_bytes(sequences: Sequence[str], runs: Mapping[str, Sequence[Scores | None]], averaged: bool = True) -> bytes:
    """Returns a CSV table with a column for each score of the catalogue, empty where unknown. Its rows are, for each
    run: the S sequences, the mean, low and high end of its interval, whether that is indicative (1), and the pooled
    scores.

    sequences: names (S). runs: by name, the scores on each sequence, None where a run has none. averaged: False leaves
    mean and pooled scores out."""
    rows: list[tuple[str, str, str, Mapping[str, float]]] = []
    for run, scores in runs.items():
        known = [one for one in scores if one is not None]
        rows += [(run, "sequence", name, one) for name, one in zip(sequences, scores, strict=True) if one is not None]
        if averaged:
            means = summary(known)
            rows += [(run, part, "", {key: one[part] for key, one in means.items()}) for part in means["HOTA"]]
            rows.append((run, "pooled", "", pooled(known)))
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*CSV_HEAD.decode().strip(",").split(","), *CATALOGUE])
    for run, row, name, by_key in rows:
        values = (by_key.get(key, math.nan) for key in CATALOGUE)
        table.writerow([run, row, name, *(f"{value:.17g}" if math.isfinite(value) else "" for value in values)])
    return text.getvalue().encode()


def tables(
    rows: Rows, given: Sequence[str], means: Means, together: Mapping[str, float], notes: Sequence[str] = ()
) -> str:
    """Returns text: a table for each family of scores with a known mean, then lines on detections, comparison and
    notes. given: of each sequence the detections in words, "" if unknown; means: by key, the mean over sequences;
    together: pooled scores by key."""
    detections = " and ".join(dict.fromkeys(printable(words) or "unknown (no run.json)" for words in given))
    people = _any_known(PEOPLE[1:], means)
    titles = TABLES if people else GROUP_TRACKER_TABLES
    known = {title: keys for title, keys in titles.items() if _any_known(keys, means)}
    parts = [_family(title, keys, rows, means, together) for title, keys in known.items()]
    lines = [LOWER, f"detections {detections}", *_comparison_lines(rows, people, "groups, strict" in known)]
    if len(rows) == 1 and math.isfinite(means["objective"]["low"]):
        lines.append("intervals by weights of blocks of frames")
    shown = [key for keys in known.values() for key in keys if math.isfinite(means[key]["low"])]
    few = [key for key in shown if means[key]["indicative"]]
    if few and len(rows) > 1:
        lines.append(FEW if few == shown else f"{FEW}: {' '.join(few)}")
    if together and len(rows) > 1:
        lines.append(POOLED)
    return "\n".join([*parts, *lines, *notes])


def _any_known(keys: Sequence[str], means: Means) -> bool:
    return any(math.isfinite(means[key]["mean"]) for key in keys)


def _family(title: str, keys: tuple[str, ...], rows: Rows, means: Means, together: Mapping[str, float]) -> str:
    shown = [[name, *(number(key, scores[key]) for key in keys)] for name, scores in rows]
    if any(math.isfinite(means[key]["low"]) for key in keys):
        for name, part in (("mean", "mean"), ("95 % low", "low"), ("95 % high", "high"))[len(rows) == 1 :]:
            shown.append([name, *(number(key, means[key][part], mean=True) for key in keys)])
    if len(rows) > 1 and not together.keys().isdisjoint(keys):
        shown.append(["pooled", *(number(key, together.get(key)) for key in keys)])
    return table(title, ["sequence"], [_heading(key, rows) for key in keys], shown)


def _heading(key: str, rows: Rows) -> str:
    unit = "/".join(dict.fromkeys("m" if scores.surface == "ground" else "px" for _, scores in rows))
    short = key.removeprefix("group_").removesuffix("_core")
    named = f"{short} ({unit})" if CATALOGUE[key].unit == "m | px" else short
    return named + arrow(key).removeprefix(key)


def checked_key(key: str, better: Sequence[str] = ("higher", "lower")) -> str:
    """Returns the key unchanged if it is a score that has one of the directions `better`, else raises InputError about
    --by."""
    if key not in CATALOGUE or CATALOGUE[key].better not in better:
        expected = f"a score of which {' or '.join(better)} is better, such as HOTA"
        raise InputError(place="--by", got=key, expected=expected, remedy="docs/reference/metrics.md lists them")
    return key


def table(
    title: str,
    words: Iterable[str],
    numbers: Iterable[str],
    rows: Iterable[Sequence[str]],
    more: Iterable[str] = (),
    foot: str = "",
) -> str:
    """Returns a title, a table without frame, a foot and an empty line as text.

    words, numbers, more: names of its columns, of words, then of numbers, then of words again; rows: their cells.
    """
    before, middle, after = list(words), list(numbers), list(more)
    cells = [[printable(cell) for cell in row] for row in ([*before, *middle, *after], *rows)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    sides = ["<"] * len(before) + [">"] * len(middle) + ["<"] * len(after)
    forms = [f"{side}{width}" for side, width in zip(sides, widths, strict=True)]
    lines = ["  ".join(map(format, row, forms)).rstrip() for row in cells]
    return "\n".join([*([printable(title)] if title else []), *lines, *([foot] if foot else []), ""])


def _comparison_lines(rows: Rows, people: bool, groups: bool) -> list[str]:
    def each(words: dict[str, str], name: str) -> str:
        return ", ".join(words[kind] for kind in dict.fromkeys(getattr(scores, name) for _, scores in rows))

    lines = [f"people compared by {each(SIMILARITY, 'similarity')}" if people else "people are not tracked"]
    if not groups:
        return [*lines, "groups are not labelled"]
    return [*lines, f"groups compared by {each(GROUP_MATCH, 'group_match')}, {each(SURFACE, 'surface')}"]


def arrow(key: str) -> str:
    """Returns the key of a score, with an arrow downwards if lower is better."""
    return f"{key} ↓" if CATALOGUE[key].better == "lower" else key


def number(key: str, value: float | None, *, mean: bool = False) -> str:
    """Returns a score as text: three decimals, for a count none, or one if it is a mean; "–" if it is not finite."""
    return figure(value, ".3f" if CATALOGUE[key].unit != "count" else f".{int(mean)}f")


def figure(value: float | None, form: str = ".3f", unknown: str = "–") -> str:
    """Returns a number as text in this form; `unknown` if it is None or not finite."""
    return unknown if value is None or not math.isfinite(value) else format(value, form)
