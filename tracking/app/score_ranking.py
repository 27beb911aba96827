"""`flockscope score TRUTH TRACKS TRACKS…`: a ranking of any number of runs, below the oracles of their inputs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from scenarios.errors import counted, printable, shortened
from sim.types import Sequence
from tracking.app.command_result import CommandResult
from tracking.app.score_tables import FEW, GROUP_MATCH, LOWER, PEOPLE, POOLED, SIMILARITY, TABLES, arrow, number, table
from tracking.comparison import MATCHED, ComparedRuns, ComparedSequence, joined
from tracking.scoring.catalogue import CATALOGUE
from tracking.stats import FEWEST, LEVEL, SURE, few, mean_of_known

COLUMNS = ("HOTA", "MOTA", "IDF1", "group_F1", "pairwise_F1", "event_F1")  # Scores beside the one that ranks.
LONGEST_NAME = 40  # Characters of an input or run that a table shows at most.


@dataclass(frozen=True)
class RankedRuns:
    """A comparison of runs that are ranked by one score, with its table and notes."""

    comparison: ComparedRuns
    key: str  # the score
    table: list[dict[str, Any]]  # rows of `ComparedRuns.to_arrow`, the oracles first
    scenarios: Mapping[str, list[int]]  # indices of its sequences by scenario
    notes: list[str]


def ranked_runs(
    names: list[str], sequences: list[Sequence], found: list[ComparedSequence], by: str | None
) -> RankedRuns:
    """Returns the ranking of runs. names: of the runs; found: their scores on each sequence; by: key of the score that
    ranks, None for `usual_key`."""
    comparison = joined(names, [s.name for s in sequences], found)
    key, scenarios = by or usual_key(comparison), dict[str, list[int]]()
    for k, sequence in enumerate(sequences):
        scenarios.setdefault(_scenario(sequence.name), []).append(k)
    rows = comparison.to_arrow(key).to_pylist()
    return RankedRuns(comparison, key, rows, scenarios, scoring_notes(sequences, found))


def _scenario(sequence: str) -> str:
    name, dash, seed = sequence.rpartition("-s")
    return name if dash and set(seed) <= set("0123456789-r") else sequence


def usual_key(comparison: ComparedRuns) -> str:
    """Returns the score that ranks by default: "objective", but "group_F1" if some runs, not all, track whole groups.
    Such runs have no HOTA, so that their objective means something else."""
    people = np.isfinite(comparison.values("HOTA")).any(axis=1)
    return "group_F1" if people.any() and not people.all() else "objective"


def scoring_notes(sequences: list[Sequence], found: list[ComparedSequence]) -> list[str]:
    """Returns notes on sparse labels, on tracks left out by the labels, and on intervals of a short recording."""
    scores, notes = [one.scores[0] for one in found], list[str]()
    sparse = [one for one in scores if one.step != 1]
    if sparse:
        steps = " and ".join(dict.fromkeys("some frames" if s.step is None else f"1 frame in {s.step}" for s in sparse))
        where = "" if len(scores) == 1 else f" of {len(sparse)} of {len(scores)} sequences"
        scored, length = (sum(getattr(s, name) for s in sparse) for name in ("frames", "length"))
        notes.append(f"labels{where} are sparse ({steps}): only annotated frames are scored, {scored} of {length}")
    left = [sum(scores.left_out for scores in run) for run in zip(*(one.scores for one in found), strict=True)]
    if any(left):
        rules = "by the labels (on distractors, in ignored regions or too low)"
        notes.append(f"{', '.join(map(str, left))} tracked boxes are left out {rules}")
    if any(len({*filter(None, one.detections)}) > 1 for one in found):
        notes.append("the runs got different stored detections: the oracle got those of TRUTH")
    seconds = scores[0].length / sequences[0].fps
    if found[0].blocks is not None and seconds < SURE:
        notes.append(f"intervals are indicative under {SURE:g} s: the recording lasts {seconds:.4g} s")
    return notes


def differences(c: ComparedRuns, key: str, by: str) -> list[dict[str, Any]]:
    """Returns a dict for each pair of runs, in the order of the ranking by the score `by`: the difference in `key`.

    "run" minus "minus" has the "mean", "low" and "high", and "indicative" (bool); "sure" is "better" or "worse" if
    "run" surely is so, else False.
    """
    found, places = c.ranking(key), {k: place for place, k in enumerate(c.ranking(key).order.tolist())}
    rows, indicative = [], c.indicative(key)
    for one, other in combinations(c.ranking(by).order.tolist(), 2):
        i, j = places[one], places[other]
        sure = "better" if found.better[i, j] else "worse" if found.better[j, i] else False
        ends = {"mean": found.less, "low": found.less_low, "high": found.less_high}
        cut = CATALOGUE[key].within
        values = {end: float(cut(part[i, j], difference=True)) for end, part in ends.items()}
        rows.append({"run": c.runs[one], "minus": c.runs[other], **values, "sure": sure, "indicative": indicative})
    return rows


def ranking_result(every: RankedRuns) -> CommandResult:
    """Returns the ranking as the result of `score`."""
    c, own = every.comparison, ("run", "input", "first", "last", "mean", "low", "high", "indicative")
    parts, together = ("mean", "low", "high", "sure", "indicative"), c.pooled()
    by_score = {key: differences(c, key, every.key) for key in CATALOGUE}
    pairs = []
    for n, pair in enumerate(by_score[every.key]):
        scores = {}
        for key, found in by_score.items():
            scores[key] = {part: found[n][part] for part in parts}
        pairs.append({**pair, "scores": scores})
    scenarios, scenario_table = _by_scenario(every)
    data = {
        "by": every.key, "similarity": c.similarity, "sequences": list(c.sequences),
        "ranking": [
            {
                **{key: row[key] for key in own}, "scores": {key: row.get(key, math.nan) for key in CATALOGUE},
                "pooled": together[row["run"]],
            }
            for row in every.table
        ],
        "differences": pairs, "scenarios": scenarios,
        "scores": {
            run: {name: dict(one) for name, one in zip(c.sequences, row, strict=True) if one is not None}
            for run, row in c.rows().items()
        },
        "notes": every.notes,
    }  # fmt: skip
    shown = [_ranking_table(every), *_pooled_table(every, together), *([scenario_table] if len(scenarios) > 1 else [])]
    if len(pairs) == 1:
        shown.append(_score_differences(every, {key: rows[0] for key, rows in by_score.items()}))
    elif pairs:
        rows = {f"{pair['run']} minus {pair['minus']}": (every.key, pair) for pair in pairs}
        shown.append(_difference_table(f"differences, {arrow(every.key)}", "runs", rows))
    return CommandResult(data, "\n".join([*shown, *_last_lines(every)]))


def _last_lines(every: RankedRuns) -> Iterable[str]:
    c = every.comparison
    yield from verdict(c, every.key)
    yield from every.notes
    match = next(iter(c.scores.values()))[0].group_match
    yield f"{every.key}: {CATALOGUE[every.key].meaning}"
    events = [row.get("event_F1", math.nan) for row in every.table]
    if "event_F1" in shown_columns(every.table, every.key) and any(map(math.isnan, events)):
        yield "event_F1 without true events: – reported none either, 0 only false ones"
    yield f"people compared by {SIMILARITY[c.similarity]}, groups by {GROUP_MATCH[match]}"
    yield (
        "oracle: true ids on the same input, without false alarms; it fills no gaps, so trackers that do may score more"
    )
    if any(name.endswith(MATCHED) for name in c.oracles):
        yield "matched: the detections do not tell whose they are, so that they count for the people nearest to them"


def _ranking_table(every: RankedRuns) -> str:
    keys = shown_columns(every.table, every.key)
    inputs = list(dict.fromkeys(row["input"] for row in every.table if row["first"] is not None))
    rows = []
    for row in every.table:
        cells = [rank_words(row), shortened(row["run"], 2 * LONGEST_NAME), number(every.key, row["mean"], mean=True)]
        cells += [interval(every.key, row), *(number(k, row[k], mean=True) for k in keys)]
        rows.append([*cells, *([shortened(row["input"], LONGEST_NAME)] if len(inputs) > 1 else [])])
    count = len(every.comparison.sequences)
    of = f"mean of {counted(count, 'sequence')}" if count > 1 else "one sequence"
    numbers, title = [arrow(every.key), "95 % interval", *keys], f"ranking by {every.key}, {of}"
    if len(inputs) == 1:
        return table(f"{title}, input {inputs[0]}", ["rank", "run"], numbers, rows)
    foot = (
        "runs that got different inputs: a rank compares trackers with their inputs; to compare trackers alone, give "
        "all the same input (--detections, a class's needs)"
    )
    return table(f"{title}, {len(inputs)} different inputs", ["rank", "run"], numbers, rows, ["input"], foot)


def _pooled_table(every: RankedRuns, together: Mapping[str, Mapping[str, float]]) -> Iterable[str]:
    if len(every.comparison.sequences) == 1 or not any(together.values()):
        return
    keys = [key for key in PEOPLE if any(key in row for row in together.values())]
    rows = [[name, *(number(key, together[name].get(key)) for key in keys)] for name in (r["run"] for r in every.table)]
    yield table(POOLED, ["run"], list(map(arrow, keys)), rows)


def shown_columns(table: list[dict[str, Any]], key: str) -> list[str]:
    """Returns the scores that a ranking by `key` shows beside it: those of `COLUMNS` that are known for some row."""
    others = [k for k in COLUMNS if k not in (key, key.removesuffix("_hull"))]
    return [k for k in others if any(math.isfinite(row.get(k, math.nan)) for row in table)]


def rank_words(row: Mapping[str, Any]) -> str:
    """Returns the range of ranks of a row of a ranking in words; "" for an oracle."""
    first, last = row["first"], row["last"]
    return "" if first is None else str(first) if first == last else f"{first}–{last}"


def interval(key: str, ends: Mapping[str, Any]) -> str:
    """Returns the 95 % interval of a score in words; "" if it is unknown."""
    if not math.isfinite(ends["low"]):
        return ""
    return f"{number(key, ends['low'], mean=True)} to {number(key, ends['high'], mean=True)}"


def _by_scenario(every: RankedRuns) -> tuple[dict[str, dict[str, float]], str]:
    """Returns the means of the ranking score by scenario and run, and a table of them with the oracles."""
    c, key, means, rows = every.comparison, every.key, dict[str, dict[str, float]](), []
    shown, scores = [row["run"] for row in every.table], c.rows()
    for scenario, places in every.scenarios.items():
        found = c.ranking(key, places)
        means[scenario] = {c.runs[k]: m for k, m in zip(found.order.tolist(), found.mean.tolist(), strict=True)}
        best = c.runs[found.order[0]] if found.last[0] == 1 and len(c.runs) > 1 else None
        oracles = {name: [one[key] for k in places if (one := scores[name][k]) is not None] for name in shown}
        values = {name: mean_of_known(known) for name, known in oracles.items()} | means[scenario]
        cells = [number(key, values[name], mean=True) + "*" * (name == best) for name in shown]
        rows.append([scenario, str(len(places)), *cells])
    foot = f"* surely better than every other run; {_chance(len(rows))}"
    numbers = ["sequences", *(shortened(name, LONGEST_NAME) for name in shown)]
    return means, table(f"{arrow(key)} by scenario", ["scenario"], numbers, rows, foot=foot)


def _score_differences(every: RankedRuns, pair: Mapping[str, Mapping[str, Any]]) -> str:
    known = [key for keys in TABLES.values() for key in keys if math.isfinite(pair[key]["mean"])]
    keys = [key for key in known if key != "objective" or usual_key(every.comparison) == key]
    equal = {key for key in keys if key.endswith("_core") and _alike(pair[key], pair[key.removesuffix("_core")])}
    keys = [key for key in keys if key not in equal]
    left = ["core scores equal to the strict ones are left out"] if equal else []
    sure = [_chance(len(keys))] if _can_be_sure(every.comparison, every.key) else []
    title, rows = f"{pair[every.key]['run']} minus {pair[every.key]['minus']}", {arrow(k): (k, pair[k]) for k in keys}
    return _difference_table(title, "score", rows, "; ".join([LOWER, *left, *sure]))


def _alike(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    ends = [[found[part] for part in ("mean", "low", "high")] for found in (one, other)]
    return np.array_equal(ends[0], ends[1], equal_nan=True)


def _difference_table(title: str, first: str, rows: Mapping[str, tuple[str, Mapping[str, Any]]], foot: str = "") -> str:
    cells = []
    for name, (key, d) in rows.items():
        words = "indicative" if d["indicative"] and math.isfinite(d["low"]) else ""
        sure = f"surely {d['sure']}" if d["sure"] else words  # of the run named first
        cells.append([name, number(key, d["mean"], mean=True), interval(key, d), sure])
    return table(title, [first], ["difference", "95 % interval"], cells, [""], foot)


def _chance(rows: int) -> str:
    return f"of {counted(rows, 'row')} about {(1 - LEVEL) * rows:.2g} would be called sure by chance"


def _can_be_sure(comparison: ComparedRuns, key: str) -> bool:
    return comparison.blocks is not None or not few(comparison.ranking(key).sequences)


def verdict(comparison: ComparedRuns, key: str) -> list[str]:
    """Returns lines of text that say which runs are surely better than which others, by how much, and who shares
    ranks."""
    pairs = differences(comparison, key, key)
    sure = [p for p in pairs if p["sure"]]
    lines = []
    for run in dict.fromkeys(p["run"] for p in sure):
        words = []
        for p in (p for p in sure if p["run"] == run):
            low, mean, high = (number(key, x) for x in sorted(abs(p[end]) for end in ("mean", "low", "high")))
            words.append(f"{p['minus']} by {mean} ({low} to {high})")
        lines.append(printable(f"{run} is surely better than {', '.join(words)}"))
    if pairs and not _can_be_sure(comparison, key):
        hint = "; --blocks 1000 gives intervals of one recording" if len(comparison.sequences) == 1 else ""
        found = counted(comparison.ranking(key).sequences, "sequence")
        lines.append(f"{found}: with fewer than {FEWEST} no difference is sure{hint}")
    elif len(sure) < len(pairs):
        lines.append("runs with a common rank: no sure difference" if sure else "no run is surely better than another")
    if comparison.blocks is not None:
        lines.append("intervals by weights of blocks of frames")
    elif len(comparison.sequences) > 1 and comparison.indicative(key):
        lines.append(FEW)
    if len(pairs) > 1:
        lines.append(f"intervals of differences hold with 95 % for all {len(pairs)} pairs together")
    return lines
