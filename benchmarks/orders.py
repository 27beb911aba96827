"""Do orders come true? Every scenario over many seeds: unfulfilled orders, events measured, spread of their onsets.

PYTHONPATH=. python benchmarks/orders.py --seeds 0:100 [scenario …]
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import numpy as np

from scenarios.errors import FlockscopeError
from scenarios.loading import load, names
from sim.sequence import simulate


def survey(name: str, seeds: range) -> None:
    scenario = load(name)
    failed: list[str] = []
    onsets: dict[str, list[float]] = defaultdict(list)
    orders = 0
    for seed in seeds:
        try:
            truth = simulate(scenario, seed).truth
        except FlockscopeError as error:
            failed.append(f"seed {seed}: {error.line()}")
            continue
        assert truth is not None
        orders += len(truth.orders)
        for event in truth.events or ():
            onsets[event.kind].append((event.start - 1) / truth.fps)
    events = ", ".join(f"{k} {len(v)} at {np.mean(v):.1f} ± {np.std(v):.1f} s" for k, v in sorted(onsets.items()))
    print(
        f"{name}: {len(failed)} of {len(seeds)} seeds failed, {orders} orders came true; {events or 'no events'}",
        flush=True,
    )
    for line in failed:
        print(f"    {line}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenario", nargs="*", default=None)
    parser.add_argument("--seeds", default="0:100", help="half-open range a:b")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    for name in arguments.scenario or names():
        survey(name, range(first, last))


if __name__ == "__main__":
    main()
