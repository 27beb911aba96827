"""What an agent gains that changes a tracker's parameters as it goes, beside the best fixed ones by the same search.

    PYTHONPATH=. python benchmarks/agent.py --case blob:clutter:file --parameters gate,coast_time [--statistics …]

Both are found by CMA-ES (tracking.agent_search) on training seeds, the agent from the fixed ones on; on test seeds are
compared: the defaults, the fixed parameters, the agent. Differences are paired, 95 % (bootstrap over sequences), in
points: hundredths of the objective. What an oracle would gain: benchmarks/switching.py.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from sim.workers.protocol import THREAD_VARIABLES
from sim.workers.start import start_workers
from tracking.agent_search import learn, played
from tracking.environment.episodes import sources
from tracking.stats import bootstrap, paired

STATISTICS = "births,flicker,weak,surplus,orphans,missed,innovation"


def said(done: int, total: int, gain: float) -> None:
    """Progress, a line for every fifth generation."""
    if done % 5 == 0 or done == total:
        print(f"  {done} of {total} generations, mean gain {100 * gain:+.2f} points", flush=True)


def main() -> None:
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--case", default="blob:clutter:file", help="tracker:scenario:detections")
    made.add_argument("--parameters", required=True, help="those that change, separated by commas")
    made.add_argument("--statistics", default=STATISTICS)
    made.add_argument("--every", type=float, default=2.5, help="s between decisions")
    made.add_argument("--generations", type=int, default=20)
    made.add_argument("--seeds", default="20000:20040", help="test seeds a:b")
    made.add_argument("--set", nargs="*", default=[], help="of the scenes, key=value: smaller pictures cost less")
    made.add_argument("--workers", type=int, default=2)
    made.add_argument("--out", type=Path, help="the agent found, *.json")
    given = made.parse_args()
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    tracker, scenario, mode = given.case.split(":")
    names, seen = given.parameters.split(","), given.statistics.split(",")
    found = learn(
        tracker, scenario, names, seen, every=given.every, generations=given.generations, detections=mode,
        set=given.set, workers=given.workers, progress=said,
    )  # fmt: skip
    for word, gain in (("fixed ones less the defaults", found.gain), ("agent less the fixed ones", found.more)):
        print("  in validation {}: {:+.2f} [{:+.2f}, {:+.2f}]".format(word, *(100 * g for g in gain)))
    test = sources(scenario, range(*map(int, given.seeds.split(":"))), given.set)
    none = replace(found.fixed, offset=np.zeros(len(names)))
    with start_workers(given.workers) as run:
        rows = np.stack([played(run, p, test, mode) for p in (none, found.fixed, found.agent)], axis=1)
    mean, low, high = bootstrap(100 * rows)
    print(f"\n{given.case}, seeds {given.seeds}, {', '.join(names)} every {given.every:g} s by {', '.join(seen)}\n")
    print("| | objective, points | less the defaults | less the fixed ones |\n|---|---|---|---|")
    for k, word in enumerate(("defaults", "fixed ones, found", "agent")):
        less = [
            "{:+.2f} [{:+.2f}, {:+.2f}]".format(*(float(v[k]) for v in paired(100 * rows[:, [j] * 3], 100 * rows)))
            for j in (0, 1)
        ]
        print(f"| {word} | {mean[k]:.2f} [{low[k]:.2f}, {high[k]:.2f}] | {less[0] if k else '–'} | {less[1]} |")
    if given.out is not None:
        given.out.write_text(found.agent.to_json(), encoding="utf-8")


if __name__ == "__main__":
    main()
