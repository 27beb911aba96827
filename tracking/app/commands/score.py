"""`flockscope score`: compares tracks with the truth; scores of each sequence, and their mean with its interval."""

from __future__ import annotations

import math
from collections.abc import Sequence as SequenceOf
from pathlib import Path

import numpy as np

from sim.io.formats.options import refuse_options
from sim.io.store.seal import tracked_hash
from sim.types import Sequence
from tracking.app.command_options import ScoreOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.compare import conditions
from tracking.app.commands.score_ranking import ranked_runs, ranking_result, scoring_notes
from tracking.app.commands.score_tables import Means, checked_key, tables
from tracking.app.commands.scored_sequence import is_class, run_names, score_sequence, scoring_jobs
from tracking.app.sequence_workers import over_sequences, source_of
from tracking.comparison import ComparedSequence, check_blocks
from tracking.scoring.catalogue import ALL, CATALOGUE
from tracking.scoring.evaluation import Scores
from tracking.stats import mean_interval


def score(options: ScoreOptions, ranked: bool = False) -> CommandResult:
    """Scores every sequence of the truth with its tracks; ranks several runs, or with `ranked` also a single one."""
    source = source_of(options, options.truth, without="box_scale")
    sequences, first = source.open(), options.tracks[0]
    check_blocks(options.blocks, len(sequences))
    ranked = ranked or len(options.tracks) > 1 or is_class(first)
    if ranked:
        refuse_options(vars(options), "box_scale", Path(first), "a ranking", "score the text alone")
    else:
        refuse_options(vars(options), "by", Path(first), "one run", "only several are ranked")
    if options.by is not None:
        checked_key(options.by)
    names = run_names(options.tracks)
    how = {"similarity": options.similarity, "group_match": options.group_match, "blocks": options.blocks}
    jobs = scoring_jobs(names.values(), sequences, options.box_scale, oracles=ranked, **how)
    found = list(over_sequences("score", score_sequence, sequences, jobs, source, options.workers))
    if not ranked:
        return _run_result(sequences, found)
    return ranking_result(ranked_runs(list(names), sequences, found, options.by))


def _run_result(sequences: list[Sequence], found: list[ComparedSequence]) -> CommandResult:
    rows = [(sequence.name, one.scores[0]) for sequence, one in zip(sequences, found, strict=True)]
    given = [one.given[0] for one in found]
    means, notes = summary([scores for _, scores in rows]), scoring_notes(sequences, found)
    for key, r in (found[0].blocks or {}).items():
        means[key] = {"mean": float(r.mean[0]), "low": float(r.low[0]), "high": float(r.high[0])}
    mixed = len({*given}) > 1
    if mixed:  # what trackers saw differently has no mean
        means = {key: {**one, "low": math.nan} for key, one in means.items()}
        notes.append("no mean: the sequences have different detections")
    data = {
        "sequences": [
            {
                **conditions(sequence),
                "name": name, "similarity": s.similarity, "surface": s.surface, "group_match": s.group_match,
                "given": words, "frames_scored": s.frames, "label_step": s.step, **s, "truth": tracked_hash(sequence),
            }
            for sequence, (name, s), words in zip(sequences, rows, given, strict=True)
        ],
        "mean": None if mixed else means, "notes": notes,
    }  # fmt: skip
    return CommandResult(data, tables(rows, given, means, notes))


def summary(scores: SequenceOf[Scores]) -> Means:
    """Returns the mean over sequences of each score by key, with its 95 % interval, within the score's range."""
    ends = np.array(mean_interval(np.array([[one[key] for key in CATALOGUE] for one in scores])))
    shown = (score.within(end).tolist() for score, end in zip(ALL, ends.T, strict=True))
    return {key: {"mean": m, "low": a, "high": b} for key, (m, a, b) in zip(CATALOGUE, shown, strict=True)}
