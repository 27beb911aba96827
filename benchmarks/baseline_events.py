"""How hard are the scenes? Scores of the baseline grouping rule on TRUE positions and velocities, scene by scene.

    PYTHONPATH=. python benchmarks/baseline_events.py --seeds 20000:20020 [scenario, suite or file …]

The rule sees people perfectly, so what it misses is in the scene. Counts of events are hits/false/missed, all sequences
together; `event` is the mean of the F1 of merges and of splits by these counts. Of the scores behind it means over
sequences; beneath, over all sequences, with 95 % intervals. An event F1 above 0.98 (*): too easy to tell trackers apart
by their events. A dash: no such event, and none told.
"""

from __future__ import annotations

import argparse

import numpy as np

from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, names, resolve
from sim.sequence import simulate
from sim.types import Tracks, Truth
from tracking.scoring import evaluate
from tracking.scoring.evaluation import Scores
from tracking.stats import bootstrap

KINDS = ("merge", "split", "cross", "queue")
COUNTS = tuple(f"{kind}_{count}" for kind in KINDS for count in ("TP", "FP", "FN"))
MEANS = {
    "late s": "event_latency", "pair F1": "pairwise_F1", "prec.": "pairwise_precision", "recall": "pairwise_recall",
    "group F1": "group_F1", "core": "group_F1_core", "GDSR2": "group_GDSR2", "IDSW": "group_IDSW",
    "lineage": "lineage_accuracy",
}  # fmt: skip
EASY = 0.98


def as_tracks(truth: Truth) -> list[Tracks]:
    """The true people as tracks that say nothing of groups."""
    return [alone(truth, index) for index in range(1, truth.length + 1)]


def alone(truth: Truth, index: int) -> Tracks:
    now = truth.at(index)
    assert now.pos is not None
    assert now.vel is not None
    n = len(now.id)
    nobody, cov, score = np.full(n, -1), np.zeros((n, 4, 4)), np.ones(n)
    return Tracks(index, now.t, "ground", "person", now.id, nobody, now.pos, now.vel, cov, None, score)


def measure(entry: Entry, seeds: range) -> list[Scores]:
    """The scores of each sequence; a seed that cannot be, or whose orders do not come true, is said and left out."""
    found = []
    for seed in seeds:
        try:
            truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
        except FlockscopeError as error:
            print(f"    {entry.name}, seed {seed}: {error.line()}")
            continue
        assert truth is not None
        found.append(evaluate(truth, as_tracks(truth)))
    return found


def line(name: str, found: list[Scores]) -> str:
    """One row of the table."""
    total = {key: int(sum(s[key] for s in found)) for key in COUNTS}
    counts = {kind: tuple(total[f"{kind}_{c}"] for c in ("TP", "FP", "FN")) for kind in KINDS}
    f1 = {kind: 2 * tp / (2 * tp + fp + fn) for kind, (tp, fp, fn) in counts.items() if tp + fp + fn}
    head = [f1[kind] for kind in ("merge", "split") if kind in f1]
    event = sum(head) / len(head) if head else float("nan")
    cells = [cell(event), *("/".join(map(str, c)) if any(c) else "–" for c in counts.values())]
    cells += [cell(v) for v in means(found)[0]]
    return row(name, cells) + (" *" if event > EASY else "")


def means(found: list[Scores]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return bootstrap(np.array([[s[key] for key in MEANS.values()] for s in found]))


def row(name: str, cells: list[str]) -> str:
    return (
        f"{name:26}"
        + f"{cells[0]:>7}"
        + "".join(f"{c:>11}" for c in cells[1:5])
        + "".join(f"{c:>9}" for c in cells[5:])
    )


def cell(value: float) -> str:
    return f"{value:.3f}" if np.isfinite(value) else "–"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", default=None, help="the whole catalogue where absent")
    parser.add_argument("--seeds", default="20000:20020", help="half-open range a:b")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    chosen = {name: resolve(name) for name in arguments.name} or {"catalogue": [e for n in names() for e in resolve(n)]}
    print(row("", ["event", *KINDS, *MEANS]))
    for name, entries in chosen.items():
        every: list[Scores] = []
        for entry in entries:
            found = measure(entry, range(first, last))
            every += found
            if found:
                print(line(entry.name, found), flush=True)
        print(line(f"{name}: {len(every)} seq.", every))
        for end, values in zip(("95 % low", "95 % high"), means(every)[1:], strict=True):
            print(row(f"  {end}", [""] * 5 + [cell(v) for v in values]))


if __name__ == "__main__":
    main()
