"""Do orders come true? Every scenario over many seeds: unfulfilled orders, events measured, spread of their onsets, and
how fast people walk while they obey.

    PYTHONPATH=. python benchmarks/orders.py --seeds 0:100 [scenario, suite or file …]

Pace: each person's greatest speed over any 0.8 s from an order's firing to its coming true (10 s later at the most), as
a share of the own speed: the faster of the group's that the order finds and of the group's that it makes. The aim is
1.15 at the most.
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import numpy as np

from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, names, resolve
from scenarios.schema.scenario import Scenario
from sim.crowd.population import draw_population, walking_speed
from sim.crowd.world import run
from sim.sequence import observe
from sim.truth.order_fulfilment import PATIENCE, RULE_TIME
from sim.types import Array, Motion, Truth
from tracking.stats import wilson

WINDOW = 0.8  # s


def paces(scenario: Scenario, motion: Motion, truth: Truth) -> Array:
    """Greatest speed of each person while obeying, as a share of the own speed; one value per order and person."""
    found = np.full(len(motion.free_speed), np.nan)
    for party in draw_population(scenario, motion.scene, motion.seed, motion.repeat):
        found[[m.column for m in party.members]] = party.speed
    shares = []
    for order in motion.orders:
        assert order.fired is not None
        onset = min(e.start for e in truth.events or () if e.start >= order.fired)
        last = min(onset + RULE_TIME[order.kind] * motion.fps, order.fired + PATIENCE * motion.fps)
        for part in order.before if order.kind == "queue" else order.after:
            columns = np.array(part) - 1
            made = walking_speed(list(motion.free_speed[columns]), scenario.crowd.slowdown_per_member)
            pos = motion.pos[order.fired - 1 : int(last), columns]
            k = round(WINDOW * motion.fps)
            speed = np.linalg.norm(pos[k:] - pos[:-k], axis=2) / WINDOW
            shares.append(np.nanmax(speed, axis=0) / np.maximum(found[columns], made))
    return np.concatenate(shares) if shares else np.zeros(0)


def survey(entry: Entry, seeds: range) -> None:
    """Print what became of the entry's orders."""
    failed: list[str] = []
    onsets: dict[str, list[float]] = defaultdict(list)
    orders, pace, people = 0, [np.zeros(0)], []
    for seed in seeds:
        try:
            motion = run(entry.scenario, seed, entry.repeat)
            truth = observe(entry.scenario, motion).truth
        except FlockscopeError as error:
            failed.append(f"seed {seed}: {error.line()}")
            continue
        assert truth is not None
        orders += len(truth.orders)
        people.append(len(motion.height))
        pace.append(paces(entry.scenario, motion, truth))
        for event in truth.events or ():
            onsets[event.kind].append((event.start - 1) / truth.fps)
    _, low, high = wilson(len(failed), len(seeds))
    text = [
        f"{entry.name}: {len(failed)} of {len(seeds)} seeds failed ({low:.1%} to {high:.1%} of all)",
        f"{orders} orders came true",
    ]
    if people:
        text.append(f"{min(people)} to {max(people)} people")
    if orders:
        text.append("pace " + ", ".join(f"{np.quantile(np.concatenate(pace), q):.2f}" for q in (0.5, 0.99, 1)))
    text += [f"{k} {len(v)} at {np.mean(v):.1f} ± {np.std(v):.1f} s" for k, v in sorted(onsets.items())]
    print("; ".join(text), *failed, sep="\n    ", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", nargs="*", default=None, help="the whole catalogue where absent")
    parser.add_argument("--seeds", default="0:100", help="half-open range a:b")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    for name in arguments.name or names():
        for entry in resolve(name):
            survey(entry, range(first, last))


if __name__ == "__main__":
    main()
