"""`flockscope compare`: a gate. Are the scores of a run worse than those of a baseline, beyond a tolerance?

Both are stored scores of the same sequences, made in the same way. Of each score, d is the mean difference over the
sequences that have it on both sides, in the direction that is better. Its interval is that of a ranking
(`tracking.stats.compared`): all intervals of one call hold together at 95 %. The verdict is the first that applies:

    regression     the score was known and is unknown in a sequence, or d is surely below 0, and below -tolerance
    too few        fewer than 6 sequences have the score on both sides
    improvement    d is surely above 0, and above the tolerance
    no difference  the interval lies within +- tolerance
    too noisy      none of these: more sequences are needed to tell

Where there is nothing true to find, only false alarms give an F1 (0) and a precision. If the score is unknown now, they
are gone: such a sequence is not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, shortened
from scenarios.limits import INTEGER, is_number
from sim.store.atomic import write_file
from sim.store.own_files import output_file
from sim.store.tables import json_document, read_json
from sim.types import Array
from tracking.app.command_options import CompareOptions
from tracking.app.command_result import CommandResult
from tracking.app.score_tables import checked_key, figure, table
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.conditions import CONDITIONS
from tracking.stats import FEWEST, compared, few

UNDECIDED = {
    "too few": (f"at least {FEWEST} sequences with the score on both sides", "generate more seeds"),
    "too noisy": ("an interval within the tolerance, or off 0", "score more sequences, or give a larger --tolerance"),
}
EXPECTED = "a file of `flockscope score --json`, or of `compare --save`"
ROUNDING = 1e-12  # A difference up to this share of the score, or of 1, is due to the processor.
LISTED = 80  # Characters of a list of names.

Stored = dict[str, dict[str, Any]]  # by name of the sequence


def compare(options: CompareOptions) -> CommandResult:
    """Compares stored scores with those of a baseline. The exit code of the result is 1 for a regression, 2 if a score
    is undecided."""
    keys = options.by or ["objective"]
    for place, key in enumerate(keys):
        _check_score(key, keys[:place], options.tolerance)
    before, now = _read(options.baseline), _read(options.now)
    names, notes = list(before), _require_same(options, before, now)
    first, second = (
        np.array([[_value(path, name, stored.get(name, {}), key) for key in keys] for name in names], float)
        for path, stored in ((options.baseline, before), (options.now, now))
    )
    # The recall that belongs to a score is stated as unknown: the truth has nothing of its kind.
    nothing_to_find = np.array([[before[name].get(_recall(key), 0) is None for key in keys] for name in names])
    first[np.isnan(second) & nothing_to_find] = np.nan
    for key, values in zip(keys, first.T, strict=True):
        if np.isnan(values).all():
            known = [k for k in CATALOGUE if any(is_number(row.get(k)) for row in before.values())]
            remedy = f"choose scores that it has: {shortened(' '.join(f'--by {k}' for k in known), LISTED)}"
            raise InputError(file=options.baseline, place=key, got="no value", expected="a known score", remedy=remedy)
    rows = judged(keys, names, first, second, options.tolerance)
    if options.save is not None:
        wanted = dict.fromkeys(("name", *CONDITIONS, *keys, *map(_recall, keys)))
        kept = [{k: row[k] for k in wanted if k in row} for row in now.values()]
        write_file(output_file(options.save, ".json", "--save"), json_document({"sequences": kept}))
    data = {"sequences": len(before), "tolerance": options.tolerance, "scores": rows, "notes": notes}
    lines, code = [_table(rows), *(line for row in rows for line in _changes(row)), *notes], 0
    if any(row["verdict"] == "regression" for row in rows):
        code = 1
    elif undecided := next((row for row in rows if row["verdict"] in UNDECIDED), None):
        expected, remedy = UNDECIDED[undecided["verdict"]]
        got = f"{undecided['verdict']}, {counted(undecided['sequences'], 'sequence')}"
        error = InputError(file=options.now, place=undecided["score"], got=got, expected=expected, remedy=remedy)
        data["error"], code = error.as_dict(), 2
        lines.append(f"undecided: {error.line()}")
    return CommandResult(data, "\n".join(lines), code)


def _check_score(key: str, others: Sequence[str], tolerance: float) -> None:
    score = CATALOGUE[checked_key(key)]
    if key in others:
        raise InputError(place="--by", got=f"{key} twice", expected="each score once", remedy="leave one out")
    if not tolerance < score.high - score.low:
        expected = f"less than the range of {key}, {score.low:g} to {score.high:g}"
        raise InputError(place="--tolerance", got=tolerance, expected=expected, remedy="give a smaller one")


def _read(path: Path) -> Stored:
    document = {} if path.is_dir() else read_json(path)
    rows = document.get("sequences") if isinstance(document, dict) else None
    rows = rows if isinstance(rows, list) else []
    named = [row for row in rows if isinstance(row, dict) and isinstance(row.get("name"), str)]
    found = {row["name"]: row for row in named}
    if not named or len(named) < len(rows):
        remedy = "score the tracks: flockscope score TRUTH TRACKS --json > FILE"
        raise InputError(file=path, got="no scores of sequences", expected=EXPECTED, remedy=remedy)
    if len(found) < len(named):
        raise InputError(file=path, got="a sequence twice", expected="one entry for each", remedy="score splits alone")
    return found


def _require_same(options: CompareOptions, before: Stored, now: Stored) -> list[str]:
    """Returns notes on conditions that neither side states. Raises InputError if there are sequences without a
    baseline, or if scores were not made in the same way."""
    new, both = sorted(now.keys() - before.keys()), [name for name in before if name in now]
    if new or not both:
        got = f"{shortened(', '.join(new), LISTED)}, not in {options.baseline}"
        remedy = "score the same sequences, or save a new baseline with --save"
        expected = "the sequences of the baseline"
        raise InputError(file=options.now, place="other sequences", got=got, expected=expected, remedy=remedy)
    unstated = dict[str, None]()
    for name in both:
        old, own = before[name], now[name]
        for key in CONDITIONS:
            if (key not in old and key not in own) or old.get(key) == own.get(key) == "":
                unstated[key] = None
            elif key not in old or key not in own or _differ(old[key], own[key]):
                got, expected = (shortened(repr(row[key]), LISTED) if key in row else "nothing" for row in (own, old))
                remedy = "track and score the same sequences in the same way, both with this version of flockscope"
                expected = f"{expected}, as in {options.baseline}"
                raise InputError(file=options.now, place=f"{name}: {key}", got=got, expected=expected, remedy=remedy)
    return [f"not compared, as neither side states it: {', '.join(unstated)}"] if unstated else []


def _differ(one: Any, other: Any) -> bool:
    return bool(one != other) or isinstance(one, bool) != isinstance(other, bool)


def _value(path: Path, name: str, row: Mapping[str, Any], key: str) -> float:
    value, score = row.get(key), CATALOGUE[key]
    if value is None:
        return float("nan")
    if not is_number(value, max(score.low, -INTEGER), min(score.high, INTEGER)):
        got, expected = shortened(repr(value), LISTED), f"a number from {score.low:g} to {score.high:g}, or null"
        remedy = "score the tracks again"
        raise InputError(file=path, place=f"{name}: {key}", got=got, expected=expected, remedy=remedy)
    return float(value)


def _recall(key: str) -> str:
    core = "_core" if key.endswith("_core") else ""
    return f"{key.removesuffix(core).rpartition('_')[0]}_recall{core}"


def judged(
    keys: Sequence[str], names: Sequence[str], before: Array, now: Array, tolerance: float
) -> list[dict[str, Any]]:
    """Returns the comparison of each score as a dict. before, now: the scores, (S, K), nan where unknown."""
    known = np.isfinite(before), np.isfinite(now)
    paired = known[0] & known[1]
    upwards = np.array([1.0 if CATALOGUE[key].better == "higher" else -1.0 for key in keys])
    less = now - before
    less[np.abs(less) <= ROUNDING * np.maximum(1.0, np.abs(before))] = 0.0
    mean, low, high, sign = compared(less, len(keys))
    rows = []
    for k, key in enumerate(keys):
        lost, found, both = known[0][:, k] & ~known[1][:, k], known[1][:, k] & ~known[0][:, k], paired[:, k]
        better, sure = mean[k] * upwards[k], sign[k] * upwards[k]
        if lost.any() or (sure < 0 and better < -tolerance):
            verdict = "regression"
        elif few(both.sum()):
            verdict = "too few"
        elif sure > 0 and better > tolerance:
            verdict = "improvement"
        else:
            verdict = "no difference" if -tolerance <= low[k] and high[k] <= tolerance else "too noisy"
        first, second = (float(side[both, k].mean()) if both.any() else np.nan for side in (before, now))
        rows.append(
            {
                "score": key, "sequences": int(both.sum()), "baseline": first, "now": second,
                "difference": float(mean[k]), "low": float(low[k]), "high": float(high[k]), "verdict": verdict,
                "unknown_now": [names[i] for i in np.flatnonzero(lost).tolist()],
                "known_now": [names[i] for i in np.flatnonzero(found).tolist()],
            }
        )  # fmt: skip
    return rows


def _changes(row: Mapping[str, Any]) -> list[str]:
    words = {"unknown_now": "known before, unknown now", "known_now": "unknown before, known now, not compared"}
    return [
        f"{row['score']}: {text}: {shortened(', '.join(row[key]), LISTED)}" for key, text in words.items() if row[key]
    ]


def _table(rows: list[dict[str, Any]]) -> str:
    cells = []
    for row in rows:
        low, high = (figure(row[end], "+.4f") for end in ("low", "high"))
        numbers = *(figure(row[key], ".4f") for key in ("baseline", "now")), figure(row["difference"], "+.4f")
        cells.append([row["score"], str(row["sequences"]), *numbers, f"{low} to {high}", row["verdict"]])
    columns = ["sequences", "baseline", "now", "difference", "95 % interval"]
    return table("paired by sequence", ["score"], columns, cells, ["verdict"]).rstrip("\n")
