"""Do the orders of scenarios come true, and how hard are the scenes for the baseline grouping rule?

    python -m benchmarks.scenario_check orders [--seeds 0:100] [scenario, suite or file …]
    python -m benchmarks.scenario_check difficulty [--seeds 20000:20020] [--rule baseline,present] [--without queue]
                                                   [scenario, suite or file …]

orders: one row per scenario: seeds on which an order failed (with reasons on stderr), orders that came true, number of
people, pace, and number and onset (mean ± standard deviation, s) of each kind of measured event. Pace is a person's
greatest speed over any 0.8 s from the firing of an order until it has come true (10 s later at most), divided by the
person's own speed: the greater of the speeds that their group has before and after the order. Quantiles 50, 99, 100 %;
the aim is at most 1.15.
difficulty: scores of the baseline rule on true positions and velocities, so that what it misses is due to the scene.
The rule `present` is trivial: it judges the present alone (two frames), with the distance and velocity difference of
the baseline rule. --without: entries whose name holds this word are left out.
`event` is the mean of the F1 of merges and of splits by the counts of all sequences together. The columns of kinds are
hits/false/missed of all sequences; a dash means neither a true nor a reported event. The further scores are means over
sequences, below them their 95 % intervals. An event F1 above 0.98 is marked *: events there separate no trackers.
Without a scenario the whole catalogue is played.
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from benchmarks.support.options import add_seeds, new_parser
from benchmarks.support.tables import head, number, row
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, names, resolve
from scenarios.schema.scenario import Scenario
from sim.crowd.population import draw_population, walking_speed
from sim.crowd.world import run
from sim.sequence import observe, simulate
from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY
from sim.truth.order_fulfilment import PATIENCE, RULE_TIME
from sim.types import Array, Motion, Truth
from tracking.grouping.grouped_tracks import with_groups
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.link_rule import LinkRule
from tracking.scoring import evaluate
from tracking.scoring.evaluation import Scores
from tracking.stats import mean_interval

WINDOW = 0.8  # s
RULES = {
    "baseline": LinkRule(),
    "present": LinkRule(
        window=0.2, share=1.0, acquaintance=0.0, apart=MERGE_DISTANCE, patience=0.2, diverge=MERGE_VELOCITY
    ),
}
KINDS = ("merge", "split", "cross", "queue")
COUNTS = ("TP", "FP", "FN")
MEANS = {
    "latency, s": "event_latency", "pair F1": "pairwise_F1", "precision": "pairwise_precision",
    "recall": "pairwise_recall", "group F1": "group_F1_hull", "core": "group_F1_core", "GDSR2": "group_GDSR2",
    "IDSW": "group_IDSW", "lineage": "lineage_accuracy",
}  # fmt: skip
EASY = 0.98


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


def rule_scores(entry: Entry, seeds: range, rules: Sequence[str]) -> dict[str, list[Scores]]:
    """Returns the scores of each sequence by rule; a seed that cannot be simulated is printed and left out."""
    found: dict[str, list[Scores]] = {rule: [] for rule in rules}
    for seed in seeds:
        try:
            truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
        except FlockscopeError as error:
            print(f"{entry.name}, seed {seed}: {error.line()}")
            continue
        assert truth is not None
        tracks = people_as_tracks(truth)
        for rule in rules:
            found[rule].append(evaluate(truth, with_groups(tracks, truth.fps, truth.px_per_m, RULES[rule])))
    return found


def difficulty_cells(found: Sequence[Scores]) -> list[str]:
    """Returns the cells of one scenario: event F1, counts by kind, means."""
    counts = {kind: [int(sum(s[f"{kind}_{count}"] for s in found)) for count in COUNTS] for kind in KINDS}
    f1 = [2 * tp / (2 * tp + fp + fn) for kind, (tp, fp, fn) in counts.items() if kind in KINDS[:2] and tp + fp + fn]
    event = sum(f1) / len(f1) if f1 else float("nan")
    cells = [number(event) + (" *" if event > EASY else "")]
    cells += ["/".join(map(str, c)) if any(c) else "–" for c in counts.values()]
    return cells + [number(v) for v in score_means(found)[0]]


def score_means(found: Sequence[Scores]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns mean, low and high end of the scores of MEANS."""
    return mean_interval(np.array([[s[key] for key in MEANS.values()] for s in found]))


def difficulty(title: str, entries: Sequence[Entry], seeds: range, rules: Sequence[str]) -> None:
    """Prints the rows of some entries, and of all of them together, for each rule."""
    every: dict[str, list[Scores]] = {rule: [] for rule in rules}
    for entry in entries:
        for rule, found in rule_scores(entry, seeds, rules).items():
            every[rule] += found
            if found:
                row([entry.name, rule, *difficulty_cells(found)])
    for rule, found in every.items():
        row([f"{title}: {len(found)} sequences", rule, *difficulty_cells(found)])
        for end, values in zip(("95 % low", "95 % high"), score_means(found)[1:], strict=True):
            row([end, rule, *[""] * (1 + len(KINDS)), *(number(v) for v in values)])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["orders", "difficulty"])
    parser.add_argument("name", nargs="*", help="scenarios, suites or files; the whole catalogue by default")
    add_seeds(parser, None)
    parser.add_argument("--rule", default="baseline", help=f"difficulty: of {', '.join(RULES)}, separated by commas")
    parser.add_argument("--without", metavar="WORD", help="leaves out entries whose name holds this word")
    args: argparse.Namespace = parser.parse_intermixed_args()
    chosen = {name: resolve(name) for name in args.name} or {"catalogue": [e for n in names() for e in resolve(n)]}
    if args.without:
        chosen = {title: [e for e in entries if args.without not in e.name] for title, entries in chosen.items()}
    if args.mode == "orders":
        head(["scenario", "seeds failed", "orders that came true", "people", "pace (50, 99, 100 %)", "events"])
        for entry in [e for entries in chosen.values() for e in entries]:
            orders(entry, args.seeds or range(100))
        return
    rules = args.rule.split(",")
    if not set(rules) <= RULES.keys():
        parser.error(f"--rule: expected some of {', '.join(RULES)}, got {args.rule}")
    head(["scenario", "rule", "event", *KINDS, *MEANS])
    for title, entries in chosen.items():
        difficulty(title, entries, args.seeds or range(20_000, 20_020), rules)


if __name__ == "__main__":
    main()
