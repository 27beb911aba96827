"""`flockscope compare`: a gate. Are the scores of a run worse than those of a baseline, beyond a tolerance?

Both are stored scores of the same sequences. Of each score, d is the mean difference over sequences, in the direction
that is better, with its 95 % interval (Student's, paired). The verdict follows from the interval and the tolerance:

    regression     the interval lies below 0, and d below -tolerance
    improvement    the interval lies above 0, and d above the tolerance
    no difference  the interval lies within +- tolerance
    too noisy      none of these: more sequences are needed to tell
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, shortened
from sim.io.files.atomic import write_file
from sim.io.files.own_files import output_file
from sim.io.files.tables import json_document, read_json
from tracking.app.command_options import CompareOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import checked_key, table
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import paired

FEWEST = 2  # sequences without which there is no interval
HOW = ("similarity", "given", "truth")  # what must be equal for scores to be compared
EXPECTED = "a file of `flockscope score --json`, or of `compare --save`"

Stored = dict[str, dict[str, Any]]  # by name of the sequence


def compare(options: CompareOptions) -> CommandResult:
    """Compares stored scores with those of a baseline; the exit code of the result is 1 if a score is surely worse."""
    keys = [checked_key(key) for key in options.by or ["objective"]]
    before, now = _read(options.baseline), _read(options.now)
    _require_same(options, before, now)
    rows = [_row(key, before, now, options.tolerance) for key in keys]
    if options.save is not None:
        kept = [{"name": name, **{k: row[k] for k in (*HOW, *keys) if k in row}} for name, row in now.items()]
        write_file(output_file(options.save, ".json", "--save"), json_document({"sequences": kept}))
    worse = [row["score"] for row in rows if row["verdict"] == "regression"]
    data = {"sequences": len(before), "tolerance": options.tolerance, "scores": rows}
    return CommandResult(data, _table(rows, len(before)), int(bool(worse)))


def _read(path: Path) -> Stored:
    document = {} if path.is_dir() else read_json(path)
    rows = document.get("sequences") if isinstance(document, dict) else None
    rows = rows if isinstance(rows, list) else []
    named = [row for row in rows if isinstance(row, dict) and "name" in row]
    found = {str(row["name"]): row for row in named}
    if not named or len(named) < len(rows):
        remedy = "score the tracks: flockscope score TRUTH TRACKS --json > FILE"
        raise InputError(file=path, got="no scores of sequences", expected=EXPECTED, remedy=remedy)
    if len(found) < len(named):
        raise InputError(file=path, got="a sequence twice", expected="one entry for each", remedy="score splits alone")
    return found


def _require_same(options: CompareOptions, before: Stored, now: Stored) -> None:
    missing, new = sorted(before.keys() - now.keys()), sorted(now.keys() - before.keys())
    place, got, expected, remedy = "", "", "the sequences of the baseline", "score the same sequences"
    if missing or new:
        names = shortened(", ".join(missing or new), 80)
        place, got = "incomplete", f"no {names}" if missing else f"{names}, not in {options.baseline}"
        remedy += ", or save a new baseline with --save"
    elif len(before) < FEWEST:
        place, got, expected, remedy = "too few", "1 sequence", f"at least {FEWEST}", "generate more seeds"
    else:
        known = [(n, k) for n, k in product(before, HOW) if k in before[n] and k in now[n]]
        name, key = next(((n, k) for n, k in known if before[n][k] != now[n][k]), ("", ""))
        if name:
            place, got = f"{name}: {key}", repr(now[name][key])
            expected = f"{before[name][key]!r}, as in {options.baseline}"
            remedy = "track and score the same sequences" if key == "truth" else "score both alike"
    if place:
        raise InputError(file=options.now, place=place, got=got, expected=expected, remedy=remedy)


def _row(key: str, before: Stored, now: Stored, tolerance: float) -> dict[str, Any]:
    pairs = np.array([[_value(row, key), _value(now[name], key)] for name, row in before.items()])
    first, second = pairs[np.isfinite(pairs).all(axis=1)].T
    if len(first) < FEWEST:
        got = f"known in {counted(len(first), 'sequence')} on both sides"
        both = [k for k in CATALOGUE if all(any(k in row for row in side.values()) for side in (before, now))]
        remedy = f"choose other scores, that both have: {shortened(' '.join(f'--by {k}' for k in both), 80)}"
        raise InputError(place=key, got=got, expected=f"at least {FEWEST}", remedy=remedy)
    mean, low, high = (float(end[0]) for end in paired(first[:, None], second[:, None]))
    upwards = CATALOGUE[key].better != "lower"
    verdict = _verdict(*((mean, low, high) if upwards else (-mean, -high, -low)), tolerance)
    return {
        "score": key, "sequences": len(first), "baseline": float(first.mean()), "now": float(second.mean()),
        "difference": mean, "low": low, "high": high, "verdict": verdict,
    }  # fmt: skip


def _value(row: Mapping[str, Any], key: str) -> float:
    value = row.get(key)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else float("nan")


def _verdict(mean: float, low: float, high: float, tolerance: float) -> str:
    if high < 0 and mean < -tolerance:
        return "regression"
    if low > 0 and mean > tolerance:
        return "improvement"
    return "no difference" if -tolerance <= low and high <= tolerance else "too noisy"


def _table(rows: list[dict[str, Any]], sequences: int) -> str:
    cells = []
    for row in rows:
        ends = f"{row['low']:+.4f} to {row['high']:+.4f}"
        numbers = f"{row['baseline']:.4f}", f"{row['now']:.4f}", f"{row['difference']:+.4f}", ends
        cells.append([row["score"], *numbers, row["verdict"]])
    columns = ["baseline", "now", "difference", "95 % interval"]
    return table(f"{counted(sequences, 'sequence')}, paired", ["score"], columns, cells, ["verdict"])
