"""How often the gate (`flockscope compare`) calls a regression where there is no difference.

    python -m benchmarks.gate [--calls 1000]

Each call compares a baseline with another run, at tolerance 0, in one or four scores, over 2 to 24 sequences. All
values are random. In the first laws both sides have the same law, scene by scene:

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

from collections.abc import Callable

import numpy as np

from benchmarks.support.options import new_parser
from benchmarks.support.tables import head, row, share
from sim.types import Array
from tracking.app.commands.compare import judged

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


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--calls", type=int, default=1000)
    calls = parser.parse_args().calls
    print(f"\nCalls with a false regression, {calls} calls each, tolerance 0")
    head(["sequences", "scores", *EQUAL, SKEWED])
    for sequences in SEQUENCES:
        for keys in KEYS:
            found = false_regressions(sequences, len(keys), calls, (*EQUAL, SKEWED))
            row([str(sequences), str(len(keys)), *(share(count, calls) for count in found.values())])


if __name__ == "__main__":
    main()
