"""All trackers on a suite, ranked by input, below what the input allows (the oracle).

    python -m benchmarks.trackers [--suite standard] [--seeds 20000:20001] [--workers 2]

No pictures: points and boxes of the simulated detector. A tracker gets what it takes. Trackers of one rank range have
no sure difference.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.support.options import add_seeds, new_parser, seeds_text
from benchmarks.support.tables import head, row
from sim.dataset.generate import generate
from sim.workers.pool import WorkerOptions
from tracking.app.command_options import ScoreOptions, TrackOptions
from tracking.app.commands.score import score
from tracking.app.commands.score_ranking import rank_words, shown_columns
from tracking.app.commands.score_tables import number
from tracking.app.commands.track import track
from tracking.running import tracker_registry


def print_ranking(title: str, options: ScoreOptions) -> None:
    """Prints the ranking of some runs, also of a single one, of which `score` would show no oracle."""
    found = score(options, ranked=True).data
    by, rows = found["by"], found["ranking"]
    keys = shown_columns([one["scores"] for one in rows], by)
    print(f"\n{title}, mean of {len(found['sequences'])} sequences")
    head(["rank", "tracker", by, *keys])
    for one in rows:
        mean, low, high = (number(by, one[end], mean=True) for end in ("mean", "low", "high"))
        name = "*oracle*" if one["first"] is None else f"`{one['run']}`"
        row([rank_words(one), name, f"{mean} [{low}, {high}]", *(number(k, one["scores"][k], mean=True) for k in keys)])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--suite", default="standard")
    add_seeds(parser, "20000:20001")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    inputs = dict[str, list[str]]()
    for name in tracker_registry.names():
        inputs.setdefault("points" if "points" in tracker_registry.find(name).needs else "boxes", []).append(name)
    with tempfile.TemporaryDirectory() as folder:
        data, runs = Path(folder) / "data", Path(folder) / "runs"
        generate([given.suite], given.seeds, data, workers=WorkerOptions(given.workers), streams=())
        for name in tracker_registry.names():
            track(TrackOptions(tracker=name, source=data, out=runs / name, detections="file", workers=given.workers))
        for kind, names in sorted(inputs.items()):
            title = f"From {kind}, suite `{given.suite}`, seeds {seeds_text(given.seeds)}"
            print_ranking(title, ScoreOptions(truth=data, tracks=[str(runs / n) for n in names], workers=given.workers))


if __name__ == "__main__":
    main()
