"""`flockscope score`: compares tracks with the truth; scores of each sequence, and their mean with its interval."""

from __future__ import annotations

import math
from pathlib import Path

from sim.store.atomic import write_file
from sim.store.own_files import output_file, refuse_foreign_file
from sim.store.seal import tracked_hash
from sim.types import Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.compare import conditions
from tracking.app.score_ranking import ranked_runs, ranking_result, scoring_notes
from tracking.app.score_tables import CSV_HEAD, checked_key, csv_bytes, summary, tables
from tracking.app.scored_sequence import is_class, run_names, score_sequence, scoring_jobs
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.comparison import ComparedSequence, check_blocks
from tracking.recordings.options import refuse_options
from tracking.scoring import pooled
from tracking.stats import SURE


def score(options: ScoreOptions, ranked: bool = False) -> CommandResult:
    """Scores every sequence of the truth with its tracks; ranks several runs, or with `ranked` also a single one."""
    source = source_of(options, options.truth, without="box_scale")
    names, sequences = run_names(options.tracks), source.open()
    first = next(iter(names.values()))
    check_blocks(options.blocks, len(sequences))
    ranked = ranked or len(options.tracks) > 1 or is_class(first)
    if ranked:
        refuse_options(vars(options), "box_scale", Path(first), "a ranking", "score the text alone")
    else:
        refuse_options(vars(options), "by", Path(first), "one run", "only several are ranked")
    if options.by is not None:
        checked_key(options.by)
    how = {"similarity": options.similarity, "group_match": options.group_match, "blocks": options.blocks}
    jobs = scoring_jobs(names.values(), sequences, options.box_scale, oracles=ranked, **how)
    if options.csv is not None:
        output_file(options.csv, ".csv", "--csv")
        if not (options.csv.is_file() and options.csv.read_bytes().startswith(CSV_HEAD)):
            refuse_foreign_file(options.csv, option="--csv")
    found = list(over_sequences("score", score_sequence, sequences, jobs, source, options.workers))
    if ranked:
        every = ranked_runs(list(names), sequences, found, options.by)
        result, rows = ranking_result(every), every.comparison.rows()
    else:
        result, rows = _run_result(sequences, found), {name: [one.scores[0] for one in found] for name in names}
    if options.csv is not None:
        averaged = ranked or result.data["mean"] is not None
        write_file(options.csv, csv_bytes([sequence.name for sequence in sequences], rows, averaged))
    return result


def _run_result(sequences: list[Sequence], found: list[ComparedSequence]) -> CommandResult:
    rows = [(sequence.name, one.scores[0]) for sequence, one in zip(sequences, found, strict=True)]
    given = [one.given[0] for one in found]
    means, notes = summary([scores for _, scores in rows]), scoring_notes(sequences, found)
    short = rows[0][1].length / sequences[0].fps < SURE
    for key, r in (found[0].blocks or {}).items():
        ends = {"low": float(r.low[0]), "high": float(r.high[0]), "indicative": short}
        means[key] = {"mean": float(r.mean[0]), **ends}
    together, mixed = pooled(scores for _, scores in rows), len({*given}) > 1
    if mixed:  # what trackers saw differently has no mean
        means, together = {key: {**one, "low": math.nan} for key, one in means.items()}, {}
        notes.append("no mean: the sequences have different detections")
    data = {
        "sequences": [
            {
                **conditions(sequence),
                "name": name, "similarity": s.similarity, "surface": s.surface, "group_match": s.group_match,
                "given": words, "frames_scored": s.frames, "label_step": s.step, "left_out": s.left_out, **s,
                "truth": tracked_hash(sequence),
            }
            for sequence, (name, s), words in zip(sequences, rows, given, strict=True)
        ],
        "mean": None if mixed else means, "pooled": None if mixed else together, "notes": notes,
    }  # fmt: skip
    return CommandResult(data, tables(rows, given, means, together, notes))
