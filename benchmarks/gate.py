"""How often the gate (`flockscope compare`) calls a regression where there is no difference; and this project's gate.

    python -m benchmarks.gate calls [--calls 1000]
    python -m benchmarks.gate headline [--write]

headline: compares the scores of all trackers on the suite `quick` with those in tests/tracking/app/headline. The exit
code is 1 unless each is without difference or better. --write stores the present scores.
calls: each call compares a baseline with another run, at tolerance 0, in one or four scores, over 2 to 24 sequences.
All values are random. In the first laws both sides have the same law, scene by scene:

    normal       scenes differ in difficulty, both runs err around it by normal noise
    skewed       scores near 1 with a long tail downwards
    ties at 1    the score is 1 in some third of the scenes
    mostly 1     the score is 1 on both sides in some eight of ten scenes
    counts       few switches per scene, mostly 0 to 2
    passed       scenes are passed (1) or not (0)
    uneven       noise differs by up to a hundred times between scenes
    alike        all scores of a call rise and fall together

In the last law only the means are equal: the run is a little worse in most scenes, and much better in few.
Cells: share of calls with at least one verdict `regression`, with Wilson's interval.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row, share
from sim.dataset.generate import generate
from sim.store.tables import json_document, plain
from sim.types import Array
from tracking.app.command_options import CompareOptions, ScoreOptions, TrackOptions
from tracking.app.command_result import CommandResult
from tracking.app.commands.compare import compare, judged
from tracking.app.commands.score import score
from tracking.app.commands.track import track

SEQUENCES = (2, 3, 6, 12, 24)
KEYS = (("HOTA",), ("HOTA", "MOTA", "IDF1", "group_F1"))
Law = Callable[[np.random.Generator, tuple[int, int]], Array]  # One side of a call: random scores (S, K).

EQUAL: dict[str, Law] = {
    "normal": lambda r, shape: 0.6 + r.normal(0, 0.05, shape),
    "skewed": lambda r, shape: r.beta(8, 2, shape),
    "ties at 1": lambda r, shape: np.minimum(1, r.normal(0.98, 0.05, shape)),
    "mostly 1": lambda r, shape: np.where(r.random(shape) < 0.9, 1, r.uniform(0.5, 1, shape)),
    "counts": lambda r, shape: -r.poisson(0.7, shape).astype(float),
    "passed": lambda r, shape: (r.random(shape) < 0.5).astype(float),
    "uneven": lambda r, shape: r.normal(0, 1, shape) * np.geomspace(0.001, 0.1, shape[0])[:, None],
    "alike": lambda r, shape: np.tile(r.normal(0.6, 0.05, (shape[0], 1)), shape[1]),
}
SKEWED = "equal means, skewed differences"


def sides(law: str, r: np.random.Generator, shape: tuple[int, int]) -> tuple[Array, Array]:
    """Returns the scores of the baseline and of the run, (S, K) each."""
    if law == SKEWED:
        return np.zeros(shape), 0.05 * (r.exponential(1, shape) - 1)
    scene = r.uniform(-0.3, 0.3, (shape[0], 1)) if law in ("normal", "alike") else 0.0
    return scene + EQUAL[law](r, shape), scene + EQUAL[law](r, shape)


def false_regressions(sequences: int, scores: int, calls: int, laws: tuple[str, ...] = tuple(EQUAL)) -> dict[str, int]:
    """Returns by law how many of `calls` calls have a verdict `regression`. scores: 1 or 4."""
    keys = next(keys for keys in KEYS if len(keys) == scores)
    names, found = [str(k) for k in range(sequences)], dict.fromkeys(laws, 0)
    for number, law in enumerate(laws):
        r = np.random.default_rng([60, sequences, scores, number])
        for _ in range(calls):
            rows = judged(keys, names, *sides(law, r, (sequences, scores)), 0.0)
            found[law] += any(one["verdict"] == "regression" for one in rows)
    return found


HEADLINE = Path(__file__).resolve().parents[1] / "tests" / "tracking" / "app" / "headline"
GROUPS = ("group_F1", "pairwise_F1")
TRACKERS = {**dict.fromkeys(("blob", "relational", "particle", "joint"), ("HOTA", *GROUPS)), "group-pda": GROUPS}
SEEDS = range(20_000, 20_003)
TOLERANCE = 0.02  # Another processor rounds differently, which can change a decision of a tracker.


def headline(folder: Path, stored: Path | None = HEADLINE) -> Iterator[tuple[str, Path, CommandResult]]:
    """Yields for each tracker its name, the file of its present scores as `compare --save` writes it, and their
    comparison with those of the folder `stored`, or None with themselves. folder: for data and runs."""
    data = folder / "data"
    generate(["quick"], SEEDS, data, streams=())
    for name, keys in TRACKERS.items():
        track(TrackOptions(tracker=name, source=data, out=folder / name, detections="file"))
        now, kept = folder / f"{name}.json", folder / f"{name}-kept.json"
        now.write_bytes(json_document(plain(score(ScoreOptions(truth=data, tracks=[str(folder / name)])).data)))
        before = now if stored is None else stored / f"{name}.json"
        options = CompareOptions(baseline=before, now=now, by=list(keys), tolerance=TOLERANCE, save=kept)
        yield name, kept, compare(options)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["calls", "headline"])
    parser.add_argument("--calls", type=int, default=1000)
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    if given.mode == "calls":
        print_calls(given.calls)
        return
    failed = False
    with tempfile.TemporaryDirectory() as folder:
        for name, kept, found in headline(Path(folder), None if given.write else HEADLINE):
            print(f"{name}\n{found.text}\n", flush=True)
            failed |= found.code != 0
            if given.write:
                shutil.copyfile(kept, HEADLINE / f"{name}.json")
    raise SystemExit(int(failed))


def print_calls(calls: int) -> None:
    print(f"\nCalls with a false regression, {calls} calls each, tolerance 0")
    head(["sequences", "scores", *EQUAL, SKEWED])
    for sequences in SEQUENCES:
        for keys in KEYS:
            found = false_regressions(sequences, len(keys), calls, (*EQUAL, SKEWED))
            row([str(sequences), str(len(keys)), *(share(count, calls) for count in found.values())])


if __name__ == "__main__":
    main()
