"""All trackers on a suite, and what trackers of people add to the groups of the shared belief.

    python -m benchmarks.trackers [ranking] [--suite standard] [--seeds 20000:20001] [--workers 2]
    python -m benchmarks.trackers beyond-belief [--suite standard] [--seeds 20000:20001]

No pictures: points and boxes of the simulated detector. A tracker gets what it takes.
ranking: by input, below what the input allows (the oracle). Trackers of one rank range have no sure difference.
beyond-belief: group F1 of each tracker of people, with groups by the belief, by the rule, and those that it reports
itself; and the paired difference from `particle` with the belief, in which people do not depend on each other.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.support.options import add_seeds, new_parser, seeds_text
from benchmarks.support.tables import INDICATIVE, difference_cell, head, mean_cell, row, table
from scenarios.loading.resolve import resolve
from sim.dataset.generate import generate
from sim.sequence import simulate
from sim.workers.pool import WorkerOptions
from tracking.app.command_options import ScoreOptions, TrackOptions
from tracking.app.commands.score import score
from tracking.app.commands.track import track
from tracking.app.score_ranking import rank_words, shown_columns
from tracking.app.score_tables import number
from tracking.running import run as runs
from tracking.running import tracker_registry
from tracking.scoring.evaluation import evaluate

PEOPLE = ("particle", "relational", "joint", "blob")
GROUPINGS = ("belief", "rule")
BASE = ("particle", "belief")  # from which all differences are


def print_ranking(title: str, options: ScoreOptions) -> None:
    """Prints the ranking of some runs, also of a single one, of which `score` would show no oracle."""
    found = score(options, ranked=True).data
    by, rows = found["by"], found["ranking"]
    keys = shown_columns([one["scores"] for one in rows], by)
    print(f"\n{title}, mean of {len(found['sequences'])} sequences")
    head(["rank", "tracker", by, *keys])
    for one in rows:
        mean, low, high = (number(by, one[end], mean=True) for end in ("mean", "low", "high"))
        ends = f"{mean} [{low}, {high}]" + INDICATIVE * one["indicative"]
        name = "*oracle*" if one["first"] is None else f"`{one['run']}`"
        row([rank_words(one), name, ends, *(number(k, one["scores"][k], mean=True) for k in keys)])


def ranking(suite: str, seeds: range, workers: int) -> None:
    inputs = dict[str, list[str]]()
    for name in tracker_registry.names():
        inputs.setdefault("points" if "points" in tracker_registry.find(name).needs else "boxes", []).append(name)
    with tempfile.TemporaryDirectory() as folder:
        data, out = Path(folder) / "data", Path(folder) / "runs"
        generate([suite], seeds, data, workers=WorkerOptions(workers), streams=())
        for name in tracker_registry.names():
            track(TrackOptions(tracker=name, source=data, out=out / name, detections="file", workers=workers))
        for kind, names in sorted(inputs.items()):
            title = f"From {kind}, suite `{suite}`, seeds {seeds_text(seeds)}"
            print_ranking(title, ScoreOptions(truth=data, tracks=[str(out / n) for n in names], workers=workers))


def beyond_belief(suite: str, seeds: range) -> None:
    found = dict[tuple[str, str], list[float]]()
    for entry in resolve(suite):
        for seed in seeds:
            sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
            assert sequence.truth is not None
            for name in PEOPLE:
                run = runs.track(name, sequence, detections="file")
                grouped = {way: runs.group(sequence, run, grouping=way) for way in GROUPINGS}
                if "grouping" not in run.info:
                    grouped["its own"] = run
                for way, tracks in grouped.items():
                    found.setdefault((name, way), []).append(evaluate(sequence.truth, tracks)["group_F1"])
    base, rows = np.array(found[BASE]), dict[str, list[str]]()
    for (name, way), values in found.items():
        less = np.array(values) - base
        rows[f"`{name}`, {way}"] = [mean_cell(values, "group_F1"), difference_cell(less, "group_F1")]
    title = f"Group F1, suite `{suite}`, seeds {seeds_text(seeds)}, mean of {len(base)} sequences"
    table(title, "tracker, groups by", ["group F1", "minus `particle`, belief"], rows)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", nargs="?", default="ranking", choices=["ranking", "beyond-belief"])
    parser.add_argument("--suite", default="standard")
    add_seeds(parser, "20000:20001")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    if given.mode == "ranking":
        ranking(given.suite, given.seeds, given.workers)
    else:
        beyond_belief(given.suite, given.seeds)


if __name__ == "__main__":
    main()
