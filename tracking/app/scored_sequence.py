"""Scores one or more runs of one sequence: what `score` does for each sequence, in this process or in a worker."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from scenarios.errors import InputError
from sim.types import DetectionMode, Sequence
from tracking.app.option_parsing import labelled
from tracking.app.stored_tracks import StoredTracks, find_tracks, match_tracks
from tracking.app.tracker_setup import TrackerSetup
from tracking.comparison import ComparedSequence, compare_one
from tracking.recordings.options import BoxScale, parse_box_scale
from tracking.running.run import TrackingRun
from tracking.scoring.groups import GroupMatch
from tracking.scoring.misreading import likely_misreading
from tracking.scoring.people import Similarity

Source = StoredTracks | str  # of the tracks of a sequence: stored ones, or the text that names a tracker class


@dataclass(frozen=True)
class ScoringJob:
    """What to score on a sequence, and how; similarity, group_match and blocks as of `compare`."""

    sources: tuple[Source, ...]  # of each run
    similarity: Similarity | None = None
    group_match: GroupMatch = "hull"
    blocks: int = 0
    oracles: bool = False  # score those, too
    box_scale: BoxScale | None = None  # factors of x and y of the boxes of texts


def is_class(text: str) -> bool:
    """Returns True if a text names a class, as file.py:Class or module:Class, and no path."""
    return ":" in text and not Path(text).exists()


def run_names(texts: list[str]) -> dict[str, str]:
    """Returns the given texts by short names, as {short name: text without its label}: a label, a class name or a file
    name, as `option_parsing.labelled`."""
    return labelled(texts, lambda text: text.rpartition(":")[2] if is_class(text) else Path(text).name)


def scoring_jobs(
    texts: Iterable[str], sequences: list[Sequence], box_scale: str | None = None, **how: Any
) -> list[ScoringJob]:
    """Returns a job for each sequence. texts: of each run, the path of stored tracks, or what names a tracker class.
    box_scale: the text of --box-scale; raises InputError if all are runs of flockscope. how: other fields of the jobs,
    by name."""
    runs = [
        [text] * len(sequences)
        if is_class(text)
        else [stored for _, stored in match_tracks(sequences, find_tracks(Path(text)))]
        for text in texts
    ]
    factors = scale_of_texts([source for run in runs for source in run], box_scale)
    return [ScoringJob(tuple(run[k] for run in runs), box_scale=factors, **how) for k in range(len(sequences))]


def scale_of_texts(given: Iterable[Source], box_scale: str | None) -> BoxScale | None:
    """Returns the factors of boxes in the text of --box-scale; raises InputError if no given source is a text."""
    if box_scale is not None and all(isinstance(source, str) or source.info for source in given):
        got, expected = "no tracks of another program", "a text of tracks"
        raise InputError(place="--box-scale", got=got, expected=expected, remedy="give it to `flockscope track`")
    return None if box_scale is None else parse_box_scale(box_scale)


def score_sequence(sequence: Sequence, job: ScoringJob) -> ComparedSequence:
    """Reads or makes the runs of a job on one sequence, and returns the scores of all of them."""
    return score_runs(sequence, read_runs(sequence, job), job)


def read_runs(sequence: Sequence, job: ScoringJob) -> list[TrackingRun]:
    """Returns the runs of a job: stored tracks are read, tracker classes track."""
    mode: DetectionMode | None = "file" if sequence.has_detections else None
    return [
        TrackerSetup(source, detections=mode).run(sequence)
        if isinstance(source, str)
        else source.read(sequence, job.box_scale)
        for source in job.sources
    ]


def score_runs(sequence: Sequence, runs: list[TrackingRun], job: ScoringJob) -> ComparedSequence:
    """Returns the scores of these runs of one sequence, as the job says; warns of tracks read wrongly."""
    for source, run in zip(job.sources, runs, strict=True):
        text = "" if sequence.truth is None else likely_misreading(sequence.truth, run, sequence.image_size)
        if text:
            name = source if isinstance(source, str) else source.path
            warnings.warn(f"{sequence.name}, {name}: {text}", stacklevel=2)
    return compare_one(sequence, runs, job.similarity, job.group_match, job.blocks, job.oracles)
