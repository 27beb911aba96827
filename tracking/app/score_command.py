"""`flockscope score`: how good tracks are, for each sequence and in the mean."""

from __future__ import annotations

from pathlib import Path

from scenarios.errors import InputError
from sim.io.source import open_source
from tracking.app.answer import Answer
from tracking.app.paired import pair, results
from tracking.scoring import evaluate

SHOWN = ("HOTA", "DetA", "AssA", "MOTA", "IDF1", "IDSW")


def score(truth: Path, tracks: Path) -> Answer:
    """Scores of individuals of all tracks that belong to a sequence of `truth`."""
    sequences = open_source(truth)
    rows = []
    for sequence, result in pair(sequences, results(tracks)):
        labels = sequence.truth
        if labels is None:
            raise InputError(
                file=truth, place=sequence.name, got="no labels", expected="gt/gt.txt or another ground truth",
                remedy="score a sequence with truth",
            )  # fmt: skip
        rows.append({"sequence": sequence.name, **evaluate(labels, result.read(sequence))})
    head = f"{'sequence':<28}" + "".join(f"{key:>8}" for key in SHOWN)
    lines = [f"{row['sequence']:<28}" + "".join(f"{row[key]:8.3f}" for key in SHOWN) for row in rows]
    return Answer({"scores": rows}, "\n".join([head, *lines]))
