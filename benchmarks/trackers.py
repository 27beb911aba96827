"""The table of trackers: all of them on the suite `standard`, ranked by input, below what the input allows (oracle).

    python -m benchmarks results trackers

No pictures: points and boxes of the simulated detector. A tracker gets what it takes.
"""

from __future__ import annotations

import math
import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.support.options import seed_range
from tracking import tracker_registry
from tracking.app.command_options import ScoreOptions, TrackOptions
from tracking.app.commands.score_ranking import COLUMNS, rank_words, ranking
from tracking.app.commands.score_tables import number
from tracking.app.commands.track import track
from tracking.app.sequence_workers import OpenedAs

SUITE = "standard"
SEEDS = "20000:20001"


def measure() -> dict[str, Any]:
    """Returns the suite and, by input, the score that ranks, the number of sequences, and the rows of the ranking."""
    from sim.dataset.generate import generate
    from sim.workers.start import WorkerOptions

    workers, given = os.cpu_count() or 1, dict[str, list[str]]()
    for name in tracker_registry.names():
        given.setdefault("boxes" if "boxes" in tracker_registry.find(name).needs else "points", []).append(name)
    with tempfile.TemporaryDirectory() as folder:
        data, runs = Path(folder) / "data", Path(folder) / "runs"
        generate([SUITE], seed_range(SEEDS), data, workers=WorkerOptions(workers), streams=())
        for name in tracker_registry.names():
            print(f"track {name}", file=sys.stderr, flush=True)
            track(TrackOptions(tracker=name, source=data, out=runs / name, detections="file", workers=workers))
        inputs = {
            kind: _ranked(ScoreOptions(truth=data, tracks=[str(runs / n) for n in names], workers=workers))
            for kind, names in sorted(given.items())
        }
        return {"suite": SUITE, "inputs": inputs}


def _ranked(options: ScoreOptions) -> dict[str, Any]:
    """Returns the ranking, also of a single run, of which `score` would show no oracle."""
    source = OpenedAs(options.truth, images=False)
    found = ranking(options, source, source.open()).data
    rows = [
        {
            **{key: row[key] for key in ("run", "first", "last", "mean", "low", "high")},
            **{key: row["scores"][key] if math.isfinite(row["scores"][key]) else None for key in COLUMNS},
        }
        for row in found["ranking"]
    ]
    return {"by": found["by"], "sequences": len(found["sequences"]), "rows": rows}


def markdown(figures: dict[str, Any]) -> str:
    """Returns a table for each input."""
    return "\n\n".join(_table(kind, figures["suite"], found) for kind, found in figures["inputs"].items())


def _table(kind: str, suite: str, found: dict[str, Any]) -> str:
    by, lines = found["by"], []
    keys = [key for key in COLUMNS if any(row[key] is not None for row in found["rows"])]
    lines.append(f"From {kind}, mean of {found['sequences']} sequences of the suite `{suite}`:\n")
    lines.append(f"| rank | tracker | {by} [95 %] | {' | '.join(keys)} |")
    lines.append("|" + "---|" * (len(keys) + 3))
    for row in found["rows"]:
        mean, low, high = (number(by, row[end], mean=True) for end in ("mean", "low", "high"))
        scores = " | ".join(number(key, math.nan if row[key] is None else row[key], mean=True) for key in keys)
        name = "*oracle*" if row["first"] is None else f"`{row['run']}`"
        lines.append(f"| {rank_words(row)} | {name} | {mean} [{low}, {high}] | {scores} |")
    return "\n".join(lines)
