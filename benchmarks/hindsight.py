"""What could be gained by changing a tracker's parameters while it runs?

    python -m benchmarks hindsight [TRACKER …] [--constants 32] [--seeds 20000:20003] [--environments DIR]

Constants drawn round the defaults, these among them, are played on the test seeds of the suite `drift`, whose detector
changes twice within a minute. Chosen on the very scenes by which they are judged, in the objective (mean of HOTA and
group_F1), with 95 % intervals over scenes, beside the best constant:

defaults        the tracker's own
best constant   that of the best mean
of each scene   the best constant of each scene
of each part    in each part of each scene the constant that was best in its windows; played anew, and told when the
                parts begin, which no tracker knows

What the last has over the third is what only a change within a scene can earn; no way that does not know the scenes
reaches either. More constants would find more. The last table has both by entry. SORT and ByteTrack are those of
roboflow `trackers` (benchmarks/peers).
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.adaptation import SEARCHED, SEED, TRACKERS, Bench, Scene, playable, scenes
from benchmarks.peers.environments import DEFAULT, make_environments
from benchmarks.support.options import add_seeds, add_trackers, new_parser, one_thread
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from sim.types import Array
from tracking.tuning.adaptive import EVERY, Played, drawn_residuals

SUITE = "drift"


def best_of_parts(scene: Scene, played: Sequence[Played]) -> Array:
    """Returns the number of the constant that is best in each part (changes + 1,)."""
    score = np.array([one.score for one in played])  # (constants, windows)
    part = np.array([scene.part(EVERY * (k + 0.5)) for k in range(score.shape[1])])
    sums = np.array([score[:, part == k].sum(axis=1) for k in range(len(scene.changes) + 1)])
    return sums.argmax(axis=1)


def told(bench: Bench, scene: Scene, residuals: Array) -> float:
    """Returns the objective of an episode that is played by residuals (parts, P) of the defaults, each in its part."""
    return bench.objective(scene, lambda k, _: residuals[scene.part(EVERY * (k + 0.5))])


def hindsight(name: str, constants: int, seeds: range) -> None:
    """Prints the tables of one tracker."""
    bench = Bench(name)
    test = playable(bench, scenes(SUITE, seeds))
    drawn = drawn_residuals(bench.space, constants, np.random.default_rng(SEED))  # the first is 0
    played = [[bench.play(scene, bench.still, each) for each in drawn] for scene in test]
    objective = np.array([[one.objective for one in each] for each in played])  # (scenes, constants)
    found = {
        "defaults": objective[:, 0], "best constant": objective[:, objective.mean(axis=0).argmax()],
        "of each scene": objective.max(axis=1),
        "of each part": np.array(
            [told(bench, scene, drawn[best_of_parts(scene, each)]) for scene, each in zip(test, played, strict=True)]
        ),
    }  # fmt: skip
    print(f"\n{name}, {SUITE}: {len(test)} scenes, {constants} constants")
    head(["parameters", "objective", "beside the best constant"])
    for key, values in found.items():
        gain = values - found["best constant"]
        row([key, mean_cell(values), difference_cell(gain) if key != "best constant" else "–"])
    head(["entry", *found])
    for entry in dict.fromkeys(scene.source.name for scene in test):
        mine = [scene.source.name == entry for scene in test]
        row([entry, *(f"{values[mine].mean():.3f}" for values in found.values())])


def main() -> None:
    parser = new_parser(__doc__)
    add_trackers(parser, SEARCHED)
    parser.add_argument("--constants", type=int, default=32, help="constants that are played")
    add_seeds(parser, "20000:20003")
    parser.add_argument("--environments", type=Path, default=DEFAULT, metavar="DIR", help="folder of the libraries")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    one_thread()
    make_environments(given.environments, ("roboflow",))
    for tracker in given.trackers or TRACKERS:
        hindsight(tracker, given.constants, given.seeds)


if __name__ == "__main__":
    main()
