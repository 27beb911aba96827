"""What differs between the runs of a ranking: tracker, parameters, input, scale and further facts of run.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from scenarios.printable import printable

# Keys of run.json and the words for them, in the order of the output. The input is a column of the ranking.
FACTS = {
    "tracker": "tracker",
    "seed": "seed",
    "background": "background",
    "causal": "causal",
    "px_per_m": "scale, px per m",
    "plane": "plane",
    "boxes": "boxes",
    "truth_hash": "truth hash of what was tracked",
}

# Keys of run.json that hold settings by name; each setting is compared by itself.
TABLES = {"config": "parameter", "grouping": "grouping"}

SHOWN = 3  # Most values of a run that the text shows.


def run_differences(infos: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Returns in what runs differ: for each fact "what" and "runs", by run the values on the sequences, each once."""
    told = {name: rows for name, rows in infos.items() if all(rows)}
    every = [info for rows in told.values() for info in rows]
    tables = ["config"] if len({info.get("tracker") for info in every}) < 2 else []
    tables += ["grouping"] if all(info.get("grouping") for info in every) else []
    facts = {name: [_facts(info, tables) for info in rows] for name, rows in told.items()}
    found = []
    for what in dict.fromkeys(key for rows in facts.values() for each in rows for key in each):
        values = {name: [each.get(what) for each in rows] for name, rows in facts.items()}
        if any(row != next(iter(values.values())) for row in values.values()):
            once = {name: [v for k, v in enumerate(row) if v not in row[:k]] for name, row in values.items()}
            found.append({"what": what, "runs": once})
    return found


def _facts(info: Mapping[str, Any], tables: Sequence[str]) -> dict[str, Any]:
    found = {words: info.get(key) for key, words in FACTS.items()}
    for key in tables:
        found |= {f"{TABLES[key]} {name}": value for name, value in (info.get(key) or {}).items()}
    return found


def differences_words(differences: Sequence[Mapping[str, Any]]) -> list[str]:
    """Returns lines of text on the differences; [] if there are none."""
    lines = ["the runs differ in"] if differences else []
    for d in differences:
        values = ", ".join(f"{name} {_words(row)}" for name, row in d["runs"].items())
        lines.append(printable(f"  {d['what']}: {values}"))
    return lines


def _words(values: Sequence[Any]) -> str:
    return " or ".join(map(_word, values[:SHOWN])) + (" or others" if len(values) > SHOWN else "")


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "none" if value is None else str(value)
