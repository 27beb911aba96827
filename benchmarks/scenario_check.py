"""Do the orders of scenarios come true?

    python -m benchmarks.scenario_check orders [--seeds 0:100] [scenario, suite or file …]

orders: one row per scenario: seeds on which an order failed (with reasons on stderr), orders that came true, number of
people, pace, and number and onset (mean ± standard deviation, s) of each kind of measured event. Pace is a person's
greatest speed over any 0.8 s from the firing of an order until it has come true (10 s later at most), divided by the
person's own speed: the greater of the speeds that their group has before and after the order. Quantiles 50, 99, 100 %;
the aim is at most 1.15.
Without a scenario the whole catalogue is played.
"""

from __future__ import annotations

import sys
from collections import defaultdict

import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, row
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, names, resolve
from scenarios.schema.scenario import Scenario
from sim.crowd.population import draw_population, walking_speed
from sim.crowd.world import run
from sim.sequence import observe
from sim.truth.order_fulfilment import PATIENCE, RULE_TIME
from sim.types import Array, Motion, Truth

WINDOW = 0.8  # s


def paces(scenario: Scenario, motion: Motion, truth: Truth) -> Array:
    """Returns the pace while obeying, one value per order and person."""
    own = np.full(len(motion.free_speed), np.nan)
    for group in draw_population(scenario, motion.scene, motion.seed, motion.repeat):
        own[[m.column for m in group.members]] = group.speed
    shares = []
    for order in motion.orders:
        assert order.fired is not None
        onset = min(e.start for e in truth.events or () if e.start >= order.fired)
        last = min(onset + RULE_TIME[order.kind] * motion.fps, order.fired + PATIENCE * motion.fps)
        for members in order.before if order.kind == "queue" else order.after:
            columns = np.array(members) - 1
            after = walking_speed(list(motion.free_speed[columns]), scenario.crowd.slowdown_per_member)
            pos = motion.pos[order.fired - 1 : int(last), columns]
            k = round(WINDOW * motion.fps)
            speed = np.linalg.norm(pos[k:] - pos[:-k], axis=2) / WINDOW
            shares.append(np.nanmax(speed, axis=0) / np.maximum(own[columns], after))
    return np.concatenate(shares) if shares else np.zeros(0)


def orders(entry: Entry, seeds: range) -> None:
    """Prints the row of one scenario."""
    failed: list[str] = []
    onsets: dict[str, list[float]] = defaultdict(list)
    count, pace, people = 0, [np.zeros(0)], []
    for seed in seeds:
        try:
            motion = run(entry.scenario, seed, entry.repeat)
            truth = observe(entry.scenario, motion).truth
        except FlockscopeError as error:
            failed.append(f"seed {seed}: {error.line()}")
            continue
        assert truth is not None
        count += len(truth.orders)
        people.append(len(motion.height))
        pace.append(paces(entry.scenario, motion, truth))
        for event in truth.events or ():
            onsets[event.kind].append((event.start - 1) / truth.fps)
    speeds = ", ".join(f"{np.quantile(np.concatenate(pace), q):.2f}" for q in (0.5, 0.99, 1)) if count else "–"
    events = "; ".join(f"{len(v)} {k} at {np.mean(v):.1f} ± {np.std(v):.1f} s" for k, v in sorted(onsets.items()))
    crowd = f"{min(people)}–{max(people)}" if people else "–"
    row([entry.name, f"{len(failed)} of {len(seeds)}", str(count), crowd, speeds, events])
    print(*failed, sep="\n", end="\n" * bool(failed), file=sys.stderr)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["orders"])
    parser.add_argument("name", nargs="*", help="scenarios, suites or files; the whole catalogue by default")
    add_seeds(parser, "0:100")
    args = parser.parse_intermixed_args()
    head(["scenario", "seeds failed", "orders that came true", "people", "pace (50, 99, 100 %)", "events"])
    for entry in [e for name in args.name or names() for e in resolve(name)]:
        orders(entry, args.seeds)


if __name__ == "__main__":
    main()
