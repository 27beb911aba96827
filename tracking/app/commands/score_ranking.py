"""`flockscope score TRUTH TRACKS TRACKS…`: a ranking of any number of runs, below the oracles of their inputs.

Also here: what differs between the runs of a ranking: tracker, parameters, input, scale and further facts of run.json.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError, counted, printable, shortened
from sim.types import Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import (
    GROUP_MATCH,
    LOWER,
    SHOWN,
    SIMILARITY,
    TABLES,
    arrow,
    chance,
    checked_key,
    new_table,
    number,
    with_title,
)
from tracking.app.commands.scored_sequence import ScoredSequence, ScoringJob, score_sequence
from tracking.app.option_parsing import output_file
from tracking.app.sequence_workers import OpenedAs, results_over_sequences
from tracking.app.stored_tracks import StoredTracks, find_tracks, match_tracks
from tracking.comparison import ComparedRuns, joined
from tracking.ranking import Ranking, rank
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.stats import FEWEST, SURE

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
SETTINGS = {"config": "parameter", "grouping": "grouping"}

MOST_VALUES = 3  # Most values of a run that the text shows.


def run_differences(infos: Mapping[str, SequenceOf[Mapping[str, Any]]]) -> list[dict[str, Any]]:
    """Returns in what runs differ: for each fact "what" and "runs", by run the values on the sequences, each once."""
    told = {name: rows for name, rows in infos.items() if all(rows)}
    every = [info for rows in told.values() for info in rows]
    tables = ["config"] if len({info.get("tracker") for info in every}) < 2 else []
    tables += ["grouping"] if all(info.get("grouping") for info in every) else []
    facts = {name: [_facts(info, tables) for info in rows] for name, rows in told.items()}
    found = []
    for what in dict.fromkeys(key for rows in facts.values() for each in rows for key in each):
        values = {name: [each.get(what) for each in rows] for name, rows in facts.items()}
        if what == FACTS["truth_hash"]:  # a tracker class has none
            values = {name: row for name, row in values.items() if None not in row}
        if any(row != next(iter(values.values()), None) for row in values.values()):
            once = {name: [v for k, v in enumerate(row) if v not in row[:k]] for name, row in values.items()}
            found.append({"what": what, "runs": once})
    return found


def _facts(info: Mapping[str, Any], tables: SequenceOf[str]) -> dict[str, Any]:
    found = {words: info.get(key) for key, words in FACTS.items()}
    for key in tables:
        found |= {f"{SETTINGS[key]} {name}": value for name, value in (info.get(key) or {}).items()}
    return found


def differences_words(differences: SequenceOf[Mapping[str, Any]]) -> list[str]:
    """Returns lines of text on the differences; [] if there are none."""
    lines = ["the runs differ in"] if differences else []
    for d in differences:
        values = ", ".join(f"{name} {_words(row)}" for name, row in d["runs"].items())
        lines.append(printable(f"  {d['what']}: {values}"))
    return lines


def _words(values: SequenceOf[Any]) -> str:
    return " or ".join(map(_word, values[:MOST_VALUES])) + (" or others" if len(values) > MOST_VALUES else "")


def _word(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return "none" if value is None else str(value)


COLUMNS = ("HOTA", "MOTA", "IDF1", "group_F1", "pairwise_F1", "event_F1")  # Scores beside the one that ranks.

INDICATIVE = f"intervals are indicative under {SURE:g} s: the recording lasts {{seconds:.4g}} s"
LONGEST_INPUT = 40  # Characters of an input that a table shows at most.


@dataclass(frozen=True)
class RankedRuns:
    """A comparison of runs by one score, and what is shown of it."""

    comparison: ComparedRuns
    key: str  # the score
    ranking: Ranking
    table: list[dict[str, Any]]  # rows of `ComparedRuns.to_arrow`, the oracles first
    pairs: list[dict[str, Any]]  # the difference of each pair of runs, the better one first
    scenarios: Mapping[str, list[int]]  # indices of its sequences by scenario
    by_scenario: Mapping[str, Ranking]  # by the score, of the sequences of each scenario
    settings: list[dict[str, Any]]  # in what the runs differ
    notes: list[str]


def ranking(options: ScoreOptions, source: OpenedAs, sequences: list[Sequence]) -> CommandResult:
    """Scores several runs on all sequences, and ranks them."""
    if options.box_scale:
        raise InputError(
            place="--box-scale", got=counted(len(options.tracks), "run"), expected="one text", remedy="leave it out"
        )
    if options.by is not None:
        checked_key(options.by)
    if options.csv is not None:
        output_file(options.csv, ".csv", "--csv")
    names = run_names(options.tracks)
    runs = stored_runs(names, sequences)
    how = (options.similarity, options.group_match, options.blocks)
    jobs = [ScoringJob(sources, *how, oracles=True) for sources in zip(*runs, strict=True)]
    found = results_over_sequences("score", score_sequence, sequences, jobs, source, options.workers)
    notes = short_notes(sequences[0], found[0].scores[0]) if options.blocks else []
    every = ranked_runs(list(names), sequences, found, options.by, notes)
    if options.csv is not None:
        _write_csv(options.csv, every.comparison)
    return CommandResult(_data(every), _text(every, options.all))


def ranked_runs(
    names: list[str], sequences: list[Sequence], found: list[ScoredSequence], by: str | None, notes: list[str]
) -> RankedRuns:
    """Returns the ranking of runs whose scores were found on each sequence."""
    comparison = joined(names, [s.name for s in sequences], [one.compared for one in found])
    every = [*sparse_notes([one.scores[0] for one in found]), *dict.fromkeys(one.note for one in found if one.note)]
    settings = run_differences({name: [one.infos[k] for one in found] for k, name in enumerate(names)})
    scenarios: dict[str, list[int]] = {}
    for k, sequence in enumerate(sequences):
        scenarios.setdefault(_scenario(sequence), []).append(k)
    return _ranked(comparison, by or usual_key(comparison), scenarios, settings, [*every, *notes])


def short_notes(sequence: Sequence, scores: Scores) -> list[str]:
    """Returns a list with one note if the recording lasts less than 60 s, so that its intervals are only indicative."""
    seconds = scores.length / sequence.fps
    return [INDICATIVE.format(seconds=seconds)] if seconds < SURE else []


def sparse_notes(scores: list[Scores]) -> list[str]:
    """Returns a list with one note if only some frames are scored, because the labels of a sequence are sparse."""
    sparse = [one for one in scores if one.step != 1]
    if not sparse:
        return []
    steps = " and ".join(dict.fromkeys("some frames" if s.step is None else f"1 frame in {s.step}" for s in sparse))
    where = "" if len(scores) == 1 else f" of {len(sparse)} of {len(scores)} sequences"
    scored, length = (sum(getattr(s, name) for s in sparse) for name in ("frames", "length"))
    return [f"labels{where} are sparse ({steps}): only annotated frames are scored, {scored} of {length}"]


def usual_key(comparison: ComparedRuns) -> str:
    """Returns "objective"; "group_F1" if it would mean something else for some runs, which track whole groups."""
    people = np.isfinite(comparison.values("HOTA")).any(axis=1)
    return "group_F1" if people.any() and not people.all() else "objective"


def run_names(texts: list[str]) -> dict[str, str]:
    """Returns the texts that name runs, by a short name. Raises InputError if one is given twice."""
    short = [text.rpartition(":")[2] if is_class(text) else Path(text).name for text in texts]
    if len(set(texts)) < len(texts):
        twice = next(text for text in texts if texts.count(text) > 1)
        raise InputError(place="TRACKS", got=f"{twice} twice", expected="each run once", remedy="leave one out")
    return {name if short.count(name) == 1 and name else text: text for name, text in zip(short, texts, strict=True)}


def is_class(text: str) -> bool:
    """Returns True if a text names a class, as file.py:Class or module:Class, and no path."""
    return ":" in text and not Path(text).exists()


def stored_runs(names: Mapping[str, str], sequences: list[Sequence]) -> list[list[StoredTracks | str]]:
    """Returns for each run its stored tracks of each sequence, or the text that names a tracker class."""
    return [
        [text] * len(sequences)
        if is_class(text)
        else [stored for _, stored in match_tracks(sequences, find_tracks(Path(text)))]
        for text in names.values()
    ]


def _scenario(sequence: Sequence) -> str:
    name, dash, seed = sequence.name.rpartition("-s")
    return name if dash and set(seed) <= set("0123456789-r") else sequence.name


def _ranked(
    comparison: ComparedRuns,
    key: str,
    scenarios: Mapping[str, list[int]],
    settings: list[dict[str, Any]],
    notes: list[str],
) -> RankedRuns:
    rankings = {each: comparison.ranking(each) for each in CATALOGUE}
    table, own = comparison.to_arrow(key).to_pylist(), rankings[key]
    pairs = []
    for name, other in _pairs(comparison, own):
        scores = {each: _difference(rankings[each], comparison.runs, name, other) for each in CATALOGUE}
        pairs.append({"run": name, "minus": other, **scores[key], "scores": scores})
    by_scenario = {name: comparison.ranking(key, rows) for name, rows in scenarios.items()}
    return RankedRuns(comparison, key, own, table, pairs, scenarios, by_scenario, settings, notes)


def _pairs(comparison: ComparedRuns, ranking: Ranking) -> list[tuple[str, str]]:
    return list(combinations((comparison.runs[k] for k in ranking.order.tolist()), 2))


def _difference(ranking: Ranking, runs: tuple[str, ...], first: str, second: str) -> dict[str, Any]:
    """Returns the difference of two runs, first minus second. "sure": False, or if the first is "better" or "worse"."""
    places = {runs[k]: place for place, k in enumerate(ranking.order.tolist())}
    i, j = places[first], places[second]
    sure = "better" if ranking.better[i, j] else "worse" if ranking.better[j, i] else False
    ends = (ranking.less, ranking.less_low, ranking.less_high)
    mean, low, high = (float(part[i, j]) for part in ends)
    return {"mean": mean, "low": low, "high": high, "sure": sure}


def _data(every: RankedRuns) -> dict[str, Any]:
    c = every.comparison
    own = ("run", "input", "first", "last", "mean", "low", "high")
    return {
        "by": every.key,
        "similarity": c.similarity,
        "sequences": list(c.sequences),
        "ranking": [
            {**{key: row[key] for key in own}, "scores": {key: row.get(key, math.nan) for key in CATALOGUE}}
            for row in every.table
        ],
        "differences": every.pairs,
        "settings": every.settings,
        "scenarios": {
            name: {c.runs[k]: float(m) for k, m in zip(found.order.tolist(), found.mean, strict=True)}
            for name, found in every.by_scenario.items()
        },
        "scores": {
            run: {name: dict(one) for name, one in zip(c.sequences, row, strict=True) if one is not None}
            for run, row in c.rows().items()
        },
        "notes": every.notes,
    }


def _text(every: RankedRuns, all_sequences: bool) -> Any:
    from rich.console import Group

    parts = [_ranking_table(every)]
    if len(every.scenarios) > 1:
        parts.append(_scenario_table(every))
    if all_sequences:
        parts.append(_sequence_table(every.comparison))
    if len(every.pairs) == 1:
        parts.append(_score_differences(every))
    elif every.pairs:
        parts.append(_pair_differences(every))
    c = every.comparison
    match = next(iter(c.scores.values()))[0].group_match
    lines = [
        *differences_words(every.settings),
        *verdict(c, every.key),
        *every.notes,
        f"people compared by {SIMILARITY[c.similarity]}, groups by {GROUP_MATCH[match]}",
        "oracle: true ids on the same input, without false alarms",
    ]
    return Group(*parts, "\n".join(lines))


def _ranking_table(every: RankedRuns) -> Any:
    keys = shown_columns(every.table, every.key)
    inputs = {row["input"] for row in every.table[len(every.comparison.oracles) :]}
    numbers = [arrow(every.key), "95 % interval", *keys]
    table = new_table(["rank", "run"], numbers, ["input"] if len(inputs) > 1 else [])
    for row in every.table:
        cells = [rank_words(row), printable(shortened(row["run"], 2 * LONGEST_INPUT))]
        cells += [number(every.key, row["mean"], mean=True), _interval(every.key, row)]
        cells += [number(k, row[k], mean=True) for k in keys]
        cells += [printable(shortened(row["input"], LONGEST_INPUT))] if len(inputs) > 1 else []
        table.add_row(*cells, style="dim" if row["first"] is None else None)
    count = len(every.comparison.sequences)
    of = f"mean of {counted(count, 'sequence')}" if count > 1 else "one sequence"
    given = f"input {printable(next(iter(inputs)))}" if len(inputs) == 1 else f"{len(inputs)} different inputs"
    foot = "" if len(inputs) == 1 else "runs that got different inputs: a rank compares trackers with their inputs"
    return with_title(f"ranking by {every.key}, {of}, {given}", table, foot)


def shown_columns(table: list[dict[str, Any]], key: str) -> list[str]:
    """Returns which of `COLUMNS` a ranking by `key` shows beside it: those that are known for some row."""
    others = [k for k in COLUMNS if k not in (key, key.removesuffix("_hull"))]
    return [k for k in others if any(math.isfinite(row.get(k, math.nan)) for row in table)]


def rank_words(row: Mapping[str, Any]) -> str:
    """Returns the range of ranks of a row of a ranking in words; "" for an oracle."""
    first, last = row["first"], row["last"]
    return "" if first is None else str(first) if first == last else f"{first}–{last}"


def _interval(key: str, ends: Mapping[str, Any]) -> str:
    if not math.isfinite(ends["low"]):
        return ""
    return f"{number(key, ends['low'], mean=True)} to {number(key, ends['high'], mean=True)}"


def _scenario_table(every: RankedRuns) -> Any:
    """Returns a table of the mean of the ranking score by scenario, oracle and run; the best run has a star if sure."""
    c, shown = every.comparison, [row["run"] for row in every.table]
    table = new_table(["scenario"], ["sequences", *(printable(shortened(name, LONGEST_INPUT)) for name in shown)])
    scores = c.rows()
    for scenario, found in every.by_scenario.items():
        rows = every.scenarios[scenario]
        means = {c.runs[k]: m for k, m in zip(found.order.tolist(), found.mean.tolist(), strict=True)}
        for name in shown[: len(c.oracles)]:
            values = [math.nan if (one := scores[name][k]) is None else one[every.key] for k in rows]
            means[name] = float(rank(np.array([values])).mean[0])
        alone = c.runs[found.order[0]] if found.last[0] == 1 and len(c.runs) > 1 else None
        cells = [number(every.key, means[name], mean=True) + ("*" if name == alone else "") for name in shown]
        table.add_row(printable(scenario), str(len(rows)), *cells)
    foot = f"* surely better than every other run; {chance(len(every.scenarios))}"
    return with_title(f"{arrow(every.key)} by scenario", table, foot)


def _sequence_table(c: ComparedRuns) -> Any:
    table, rows = new_table(["sequence", "run"], map(arrow, SHOWN)), c.rows()
    for k, sequence in enumerate(c.sequences):
        for name, row in rows.items():
            if (one := row[k]) is not None:
                table.add_row(printable(sequence), printable(name), *(number(key, one[key]) for key in SHOWN))
    return with_title("each sequence", table)


def _score_differences(every: RankedRuns) -> Any:
    (pair,) = every.pairs
    known = [key for keys in TABLES.values() for key in keys if math.isfinite(pair["scores"][key]["mean"])]
    keys = [key for key in known if key != "objective" or usual_key(every.comparison) == key]
    rows = {arrow(key): (key, pair["scores"][key]) for key in keys}
    title = printable(f"{pair['run']} minus {pair['minus']}")
    sure = [chance(len(rows))] if _can_be_sure(every.comparison, every.ranking) else []
    return with_title(title, _difference_table("score", rows), "; ".join([LOWER, *sure]))


def _can_be_sure(comparison: ComparedRuns, ranking: Ranking) -> bool:
    return comparison.blocks is not None or ranking.sequences >= FEWEST


def _pair_differences(every: RankedRuns) -> Any:
    rows = {printable(f"{pair['run']} minus {pair['minus']}"): (every.key, pair) for pair in every.pairs}
    return with_title(f"differences, {arrow(every.key)}", _difference_table("runs", rows))


def _difference_table(first: str, rows: Mapping[str, tuple[str, Mapping[str, Any]]]) -> Any:
    table = new_table([first], ["difference", "95 % interval"], [""])
    for name, (key, d) in rows.items():
        sure = f"surely {d['sure']}" if d["sure"] else ""  # of the run named first
        table.add_row(name, number(key, d["mean"], mean=True), _interval(key, d), sure)
    return table


def verdict(comparison: ComparedRuns, key: str) -> list[str]:
    """Returns lines that say in words which runs are surely better, and that the others share ranks."""
    ranking = comparison.ranking(key)
    pairs = [
        {"run": i, "minus": j, **_difference(ranking, comparison.runs, i, j)} for i, j in _pairs(comparison, ranking)
    ]
    sure = [p for p in pairs if p["sure"]]
    lines = []
    for run in dict.fromkeys(p["run"] for p in sure):
        nearest, *others = (p for p in sure if p["run"] == run)
        low, mean, high = (number(key, x) for x in sorted(abs(nearest[end]) for end in ("mean", "low", "high")))
        rest = f", and than {printable(', '.join(p['minus'] for p in others))}" if others else ""
        by = f"by {mean} ({low} to {high})"
        lines.append(f"{printable(run)} is surely better than {printable(nearest['minus'])} {by}{rest}")
    if pairs and not _can_be_sure(comparison, ranking):
        hint = "; --blocks 1000 gives intervals of one recording" if len(comparison.sequences) == 1 else ""
        found = counted(ranking.sequences, "sequence")
        lines.append(f"{found}: with fewer than {FEWEST} no difference is sure{hint}")
    elif len(sure) < len(pairs):
        lines.append("runs with a common rank: no sure difference" if sure else "no run is surely better than another")
    if comparison.blocks is not None:
        lines.append("intervals by weights of blocks of frames")
    if len(pairs) > 1:
        lines.append(f"intervals of differences hold with 95 % for all {len(pairs)} pairs together")
    return lines


def _write_csv(path: Path, c: ComparedRuns) -> None:
    from sim.io.files.atomic import write_file

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["sequence", "run", *CATALOGUE])
    for k, sequence in enumerate(c.sequences):
        for name, row in c.rows().items():
            if (one := row[k]) is not None:
                writer.writerow([sequence, name, *("" if math.isnan(v) else repr(v) for v in one.values())])
    write_file(path, text.getvalue().encode())
