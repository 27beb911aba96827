"""`flockscope score TRUTH TRACKS TRACKS…`: a ranking of any number of runs, with the oracle above it."""

from __future__ import annotations

import csv
import io
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.errors import InputError
from scenarios.printable import counted, printable
from sim.types import Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.score_tables import GROUP_MATCH, SHOWN, SIMILARITY, empty_table, number, with_title
from tracking.app.commands.track import TrackerSetup
from tracking.app.progress import ProgressMeter
from tracking.app.stored_tracks import StoredTracks, find_tracks, match_tracks
from tracking.comparison import ORACLE, ComparedRuns, compare_one, joined
from tracking.ranking import Ranking, rank
from tracking.run import TrackingRun
from tracking.run_info import input_summary
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.scoring.misreading import likely_misreading
from tracking.stats import FEWEST

COLUMNS = ("HOTA", "MOTA", "IDF1", "group_F1", "pairwise_F1", "event_F1")
"""Scores beside the one that ranks."""


@dataclass(frozen=True)
class RankedRuns:
    """A comparison of runs by one score. scenarios: for each name of a scenario the indices of its sequences. given:
    by run, the detections that it got, in words.
    """

    comparison: ComparedRuns
    key: str
    scenarios: Mapping[str, list[int]]
    given: Mapping[str, list[str]]


def ranking(options: ScoreOptions, sequences: list[Sequence]) -> CommandResult:
    """Scores several runs on all sequences, and ranks them.

    The result's data: "by" (the score that ranks), "similarity", "sequences" (names), "ranking" (a dictionary for the
    oracle, then for each run, best first: "run", "first", "last", "mean", "low", "high", "detections", "scores": means
    of all scores), "differences" (of each pair of runs: "run", "minus", "mean", "low", "high", "sure"), "scenarios"
    (means by scenario and run), "scores" (by run and sequence).

    Raises InputError as `score`.
    """
    refused = {"--blocks": options.blocks, "--against": options.against, "--box-scale": options.box_scale}
    for option, value in refused.items():
        if value:
            raise InputError(
                place=option, got=counted(len(options.tracks), "run"), expected="one run, or one text",
                remedy="leave it out",
            )  # fmt: skip
    if options.by is not None and (options.by not in CATALOGUE or CATALOGUE[options.by].better == "neither"):
        raise InputError(
            place="--by", got=options.by, expected="a score with a better direction, such as HOTA",
            remedy="docs/reference/metrics.md lists them",
        )  # fmt: skip
    runs = {name: _source(text, sequences) for name, text in _names(options.tracks).items()}
    found, given = [], {name: list[str]() for name in runs}
    with ProgressMeter("score", len(sequences)) as meter:
        for k, sequence in enumerate(sequences):
            tracks = {name: _tracks(source, sequence, k) for name, source in runs.items()}
            warn_misread(sequence, list(tracks.values()))
            for name, run in tracks.items():
                given[name].append(input_summary(run.info) or "unknown (no run.json)")
            found.append(compare_one(sequence, list(tracks.values()), options.similarity, options.group_match))
            meter.step(sequence.name)
    comparison = joined(list(runs), [sequence.name for sequence in sequences], found)
    scenarios: dict[str, list[int]] = {}
    for k, sequence in enumerate(sequences):
        scenarios.setdefault(_scenario(sequence), []).append(k)
    every = RankedRuns(comparison, options.by or usual_key(comparison), scenarios, given)
    if options.csv is not None:
        _write_csv(options.csv, every)
    return CommandResult(_data(every), _text(every, options.all))


def warn_misread(sequence: Sequence, runs: list[TrackingRun]) -> None:
    """Warns about tracks that hardly match any label, with what would."""
    for run in runs:
        if sequence.truth is not None:
            text = likely_misreading(sequence.truth, run, size=sequence.image_size, given="run" if run.info else "text")
            if text:
                warnings.warn(f"{sequence.name}: {text}", stacklevel=2)


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


Source = str | list[tuple[Sequence, StoredTracks]]
"""The text that names a tracker class, or the stored tracks of each sequence."""


def _names(texts: list[str]) -> dict[str, str]:
    """Returns the texts on the command line by a short name: of the class, folder or file; the whole text if two share
    it. Raises InputError if a text is given twice.
    """
    short = [text.rpartition(":")[2] if is_class(text) else Path(text).name for text in texts]
    if len(set(texts)) < len(texts):
        twice = next(text for text in texts if texts.count(text) > 1)
        raise InputError(place="TRACKS", got=f"{twice} twice", expected="each run once", remedy="leave one out")
    return {name if short.count(name) == 1 and name else text: text for name, text in zip(short, texts, strict=True)}


def is_class(text: str) -> bool:
    """Returns True if a text names a class, as file.py:Class or module:Class, and no path."""
    return ":" in text and not Path(text).exists()


def _source(text: str, sequences: list[Sequence]) -> Source:
    return text if is_class(text) else match_tracks(sequences, find_tracks(Path(text)))


def _tracks(source: Source, sequence: Sequence, k: int) -> TrackingRun:
    if isinstance(source, str):
        return TrackerSetup(source, detections="file" if sequence.has_detections else None).run(sequence)
    return source[k][1].read(sequence)


def _scenario(sequence: Sequence) -> str:
    """Returns the name of a sequence without its seed: the scenario, or the name of a recording."""
    name, dash, seed = sequence.name.rpartition("-s")
    return name if dash and set(seed) <= set("0123456789-r") else sequence.name


def _entries(every: RankedRuns) -> list[dict[str, Any]]:
    """Returns the oracle, then the runs from the best on, as dictionaries of the result's data."""
    table = every.comparison.to_arrow(every.key).to_pylist()
    own = ("run", "first", "last", "mean", "low", "high")
    return [
        {
            **{key: row[key] for key in own},
            "detections": list(dict.fromkeys(every.given.get(row["run"], []))),
            "scores": {key: row.get(key, math.nan) for key in CATALOGUE},
        }
        for row in table
    ]


def _pairs(every: RankedRuns) -> list[dict[str, Any]]:
    """Returns the difference of each pair of runs, the better one first, with its joint interval."""
    found = every.comparison.ranking(every.key)
    names = [every.comparison.runs[k] for k in found.order.tolist()]
    return [
        {
            "run": names[i], "minus": names[j], "mean": float(found.less[i, j]), "low": float(found.less_low[i, j]),
            "high": float(found.less_high[i, j]), "sure": bool(found.better[i, j]),
        }
        for i in range(len(names)) for j in range(i + 1, len(names))
    ]  # fmt: skip


def _by_scenario(every: RankedRuns) -> dict[str, Ranking]:
    return {name: every.comparison.ranking(every.key, rows) for name, rows in every.scenarios.items()}


def _data(every: RankedRuns) -> dict[str, Any]:
    c = every.comparison
    scenarios = {
        name: {c.runs[k]: float(m) for k, m in zip(found.order.tolist(), found.mean, strict=True)}
        for name, found in _by_scenario(every).items()
    }
    scores = {ORACLE: c.oracle, **c.scores}
    return {
        "by": every.key,
        "similarity": c.similarity,
        "sequences": list(c.sequences),
        "ranking": _entries(every),
        "differences": _pairs(every),
        "scenarios": scenarios,
        "scores": {
            run: {name: dict(one) for name, one in zip(c.sequences, rows, strict=True)} for run, rows in scores.items()
        },
    }


def _text(every: RankedRuns, all_sequences: bool) -> Any:
    from rich.console import Group

    parts = [_ranking_table(every)]
    if len(every.scenarios) > 1:
        parts.append(_scenario_table(every))
    if all_sequences:
        parts.append(_sequence_table(every))
    c = every.comparison
    match = next(iter(c.scores.values()))[0].group_match
    lines = [
        *_verdict(every),
        *sparse_notes(c.oracle),
        f"people compared by {SIMILARITY[c.similarity]}, groups by {GROUP_MATCH[match]}",
        f"{ORACLE}: true ids on the same detections, without false alarms",
    ]
    return Group(*parts, "\n".join(lines))


def _ranking_table(every: RankedRuns) -> Any:
    entries = _entries(every)
    keys = [
        k
        for k in COLUMNS
        if k not in (every.key, every.key.removesuffix("_hull")) and any(math.isfinite(e["scores"][k]) for e in entries)
    ]
    inputs = {text for e in entries for text in e["detections"]}
    table = empty_table()
    for name in ("rank", "run"):
        table.add_column(name, no_wrap=True)
    for name in (every.key, "95 % interval", *keys):
        table.add_column(name, justify="right", no_wrap=True)
    if len(inputs) > 1:
        table.add_column("detections", overflow="fold")
    for e in entries:
        cells = [rank_words(e), printable(e["run"]), number(every.key, e["mean"], mean=True), _interval(every.key, e)]
        cells += [number(k, e["scores"][k], mean=True) for k in keys]
        cells += [printable(", ".join(e["detections"]))] if len(inputs) > 1 else []
        table.add_row(*cells, style="dim" if e["first"] is None else None)
    detections = "" if len(inputs) > 1 else f", detections {printable(next(iter(inputs)))}"
    title = f"ranking by {every.key}, mean of {counted(len(every.comparison.sequences), 'sequence')}{detections}"
    return with_title(title, table)


def rank_words(entry: Mapping[str, Any]) -> str:
    """Returns the range of ranks of a row of a ranking in words; "" for the oracle."""
    first, last = entry["first"], entry["last"]
    return "" if first is None else str(first) if first == last else f"{first}–{last}"


def _interval(key: str, entry: Mapping[str, Any]) -> str:
    if not math.isfinite(entry["low"]):
        return ""
    return f"{number(key, entry['low'], mean=True)} to {number(key, entry['high'], mean=True)}"


def _scenario_table(every: RankedRuns) -> Any:
    """Returns a table of the mean of the ranking score by scenario and run; the best of a row has a star if sure."""
    c, table = every.comparison, empty_table()
    names = [c.runs[k] for k in c.ranking(every.key).order.tolist()]
    for name in ("scenario", "sequences", ORACLE, *names):
        table.add_column(printable(name), justify="left" if name == "scenario" else "right", no_wrap=True)
    for scenario, found in _by_scenario(every).items():
        rows = every.scenarios[scenario]
        best = rank(np.array([[c.oracle[k][every.key] for k in rows]])).mean[0]
        means = {c.runs[k]: m for k, m in zip(found.order.tolist(), found.mean.tolist(), strict=True)}
        alone = c.runs[found.order[0]] if found.last[0] == 1 and len(c.runs) > 1 else None
        cells = [number(every.key, means[name], mean=True) + ("*" if name == alone else "") for name in names]
        table.add_row(printable(scenario), str(len(rows)), number(every.key, best, mean=True), *cells)
    return with_title(f"{every.key} by scenario; * surely the best of the row", table)


def _sequence_table(every: RankedRuns) -> Any:
    c, table = every.comparison, empty_table()
    for name in ("sequence", "run", *SHOWN):
        table.add_column(name, justify="left" if name in ("sequence", "run") else "right", no_wrap=True)
    for k, sequence in enumerate(c.sequences):
        for name, one in ((ORACLE, c.oracle[k]), *((run, c.scores[run][k]) for run in c.runs)):
            table.add_row(printable(sequence), printable(name), *(number(key, one[key]) for key in SHOWN))
    return with_title("each sequence", table)


def _verdict(every: RankedRuns) -> list[str]:
    """Returns lines that say in words which runs are surely better, and that the others share ranks."""
    pairs, count = _pairs(every), every.comparison.ranking(every.key).sequences
    sure = [p for p in pairs if p["sure"]]
    lines = []
    for run in dict.fromkeys(p["run"] for p in sure):
        nearest, *others = (p for p in sure if p["run"] == run)
        low, mean, high = (number(every.key, x) for x in sorted(abs(nearest[end]) for end in ("mean", "low", "high")))
        rest = f", and than {printable(', '.join(p['minus'] for p in others))}" if others else ""
        by = f"by {mean} ({low} to {high})"
        lines.append(f"{printable(run)} is better than {printable(nearest['minus'])} {by}{rest}")
    if count < FEWEST:
        lines.append(f"{counted(count, 'sequence')}: with fewer than {FEWEST} no difference is sure")
    elif len(sure) < len(pairs):
        lines.append("runs with a common rank: no sure difference" if sure else "no run is surely better than another")
    return [*lines, f"intervals of differences hold with 95 % for all {counted(len(pairs), 'pair')} together"]


def _write_csv(path: Path, every: RankedRuns) -> None:
    """Writes one row per sequence and run (the oracle, too) with every score of the catalogue."""
    from sim.io.files.atomic import write_file

    c, text = every.comparison, io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["sequence", "run", *CATALOGUE])
    for k, sequence in enumerate(c.sequences):
        for name, one in ((ORACLE, c.oracle[k]), *((run, c.scores[run][k]) for run in c.runs)):
            writer.writerow([sequence, name, *("" if math.isnan(v) else repr(v) for v in one.values())])
    write_file(path, text.getvalue().encode())
