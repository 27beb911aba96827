"""What differs between two runs whose scores are subtracted: tracker, input, scale and further facts of run.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenarios.printable import printable

UNKNOWN = "unknown"
"""Stands for a fact of a run without run.json."""

FACTS = {
    "tracker": "tracker",
    "seed": "seed",
    "detections": "detections",
    "background": "background",
    "causal": "causal",
    "px_per_m": "scale, px per m",
    "fps": "frames per second",
    "plane": "plane",
    "boxes": "boxes",
    "truth_hash": "truth hash of what was tracked",
}
"""Keys of run.json and the words for them, in the order of the output."""

TABLES = {"config": "parameter", "sensor": "sensor", "grouping": "grouping"}
"""Keys of run.json that hold settings by name; each setting is compared by itself."""

Differences = list[dict[str, Any]]
"""One entry per fact and pair of values: "what", "these", "against", and "sequences", the number of sequences."""


def run_differences(pairs: Sequence[tuple[Mapping[str, Any], Mapping[str, Any]]]) -> Differences:
    """Returns in what the runs of each pair differ, in the order of `FACTS`, then settings of parameters and the
    sensor.

    pairs: the content of run.json of both runs of each sequence, {} where there is none. A fact that only one run has
    is None for the other. Settings of two different trackers are not compared. [] if nothing differs.
    """
    count: dict[tuple[int, str, str, str], int] = {}
    values: dict[tuple[int, str, str, str], tuple[Any, Any]] = {}
    for first, second in pairs:
        for place, (what, a, b) in enumerate(_facts(first, second)):
            if a != b:
                key = place, what, repr(a), repr(b)
                count[key] = count.get(key, 0) + 1
                values[key] = a, b
    return [
        {"what": key[1], "these": values[key][0], "against": values[key][1], "sequences": count[key]}
        for key in sorted(count, key=lambda key: key[:2])
    ]


def _facts(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[tuple[str, Any, Any]]:
    """Returns all comparable facts of two runs as (words, value of the first, value of the second)."""
    if not first or not second:
        return [("run.json", "there" if first else UNKNOWN, "there" if second else UNKNOWN)]
    found = [(words, first.get(key), second.get(key)) for key, words in FACTS.items()]
    for key, words in TABLES.items():
        if key == "config" and first.get("tracker") != second.get("tracker"):
            continue
        a, b = (info.get(key) or {} for info in (first, second))
        found += [(f"{words} {name}", a.get(name), b.get(name)) for name in sorted({*a, *b})]
    return found


def differences_words(differences: Differences, sequences: int) -> list[str]:
    """Returns lines of text on the differences; one line if there are none. sequences: number of compared sequences."""
    if not differences:
        return ["these tracks and --against: run.json names no difference"]
    lines = ["these tracks and --against differ in"]
    for d in differences:
        part = f" (in {d['sequences']} of {sequences} sequences)" if d["sequences"] < sequences else ""
        lines.append(f"  {printable(d['what'])}: {_word(d['these'])} / {_word(d['against'])}{part}")
    return lines


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "none" if value is None else printable(str(value))
