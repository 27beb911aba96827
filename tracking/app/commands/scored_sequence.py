"""Scores one or more runs of one sequence: what `score` does for each sequence, in this process or in a worker."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sim.io.formats.options import BoxScale
from sim.types import Sequence
from tracking.app.commands.track import TrackerSetup
from tracking.app.stored_tracks import StoredTracks
from tracking.comparison import ComparedSequence, compare_one
from tracking.running.run import TrackingRun, input_summary
from tracking.scoring.evaluation import Scores
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.misreading import likely_misreading
from tracking.scoring.people_comparison import Similarity

MOVED = "all tracks are compared {plane}"
SURFACE_WORDS = {"ground": "on the ground, boxes by their foot points", "image": "in the image, as some lie there"}


@dataclass(frozen=True)
class ScoringJob:
    """What to score on a sequence, and how; similarity, group_match and blocks as of `compare`."""

    sources: tuple[StoredTracks | str, ...]  # of each run, its stored tracks or the text that names a tracker class
    similarity: Similarity | None = None
    group_match: GroupMatch = "hull"
    blocks: int = 0
    oracles: bool = False  # score those, too
    box_scale: BoxScale | None = None  # factors of x and y of the boxes of texts


@dataclass(frozen=True)
class ScoredSequence:
    """The scores of runs of one sequence."""

    compared: ComparedSequence
    infos: list[Mapping[str, Any]]  # content of run.json of each run, {} without
    note: str = ""  # what was done to compare them

    @property
    def scores(self) -> list[Scores]:
        """The scores of each run."""
        return self.compared.scores

    @property
    def given(self) -> list[str]:
        """The detections that each run got, in words; "" without run.json."""
        return [input_summary(info) for info in self.infos]


def score_sequence(sequence: Sequence, job: ScoringJob) -> ScoredSequence:
    """Returns the scores of all runs of one sequence, compared alike."""
    return score_runs(sequence, read_runs(sequence, job), job)


def read_runs(sequence: Sequence, job: ScoringJob) -> list[TrackingRun]:
    """Returns the runs of a job: stored tracks are read, tracker classes track."""
    return [_tracks(source, sequence, job.box_scale) for source in job.sources]


def score_runs(sequence: Sequence, runs: list[TrackingRun], job: ScoringJob) -> ScoredSequence:
    """Returns the scores of the runs of a job."""
    for run in runs:
        if sequence.truth is not None:
            text = likely_misreading(sequence.truth, run, size=sequence.image_size, given="run" if run.info else "text")
            if text:
                warnings.warn(f"{sequence.name}: {text}", stacklevel=2)
    compared = compare_one(sequence, runs, job.similarity, job.group_match, job.blocks, job.oracles)
    surface = compared.scores[0].surface
    moved = {"ground" if run[0].plane != "image" else "image" for run in runs if len(run)} - {surface}
    note = MOVED.format(plane=SURFACE_WORDS[surface]) if moved else ""
    return ScoredSequence(compared, [run.info for run in runs], note)


def _tracks(source: StoredTracks | str, sequence: Sequence, box_scale: BoxScale | None) -> TrackingRun:
    if isinstance(source, str):
        return TrackerSetup(source, detections="file" if sequence.has_detections else None).run(sequence)
    return source.read(sequence, box_scale)
