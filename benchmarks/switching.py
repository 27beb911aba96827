"""What could be gained by changing a tracker's parameters during a sequence: an oracle that knows the truth.

    PYTHONPATH=. python benchmarks/switching.py [--cases blob:clutter:file,…] [--seeds a:b] [--train a:b] [--every 2.5]

Candidates are the defaults and one online parameter at a time, a quarter of its range (of the search space) lower or
higher. On training seeds the oracle plays all of them, and those it chose most are kept. On test seeds are compared:
the defaults; the fixed candidate that is best on the training seeds; the best fixed one of each sequence, which takes
the truth to know; and the oracle: every `--every` seconds it tries all of them from where the tracker is, and goes on
with the one whose answers so far score best. Differences are paired, with intervals of 95 % (bootstrap over
sequences), in points: hundredths of the objective.
"""

from __future__ import annotations

import argparse
import copy
import os
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, DetectionMode, Frame, Tracks
from sim.workers.protocol import THREAD_VARIABLES
from sim.workers.start import results_in_order, start_workers
from tracking.config import Config
from tracking.environment.episode_cache import Held
from tracking.environment.episodes import streams_for
from tracking.episode_source import Source, sources
from tracking.objective import ObjectiveScorer
from tracking.parameter_space import decode, encode, space_of
from tracking.prepare import PreparedTracker, prepare
from tracking.stats import bootstrap, paired
from tracking.tracker_registry import find
from tracking.tracks_check import ReportHistory

CASES = ("blob:clutter:file", "group-pda:clutter:file", "blob:lights:image", "group-pda:lights:image")
STEP = 0.5
"""Of the two units of a parameter's range in the cube: a quarter of it."""
KEPT = 10
"""Candidates beside the defaults."""


@dataclass(frozen=True)
class Job:
    """One source, played with these candidates."""

    tracker: str
    source: Source
    mode: DetectionMode
    candidates: tuple[Config, ...]
    every: float


@dataclass(frozen=True)
class Found:
    """fixed (K,): the objective with each candidate throughout; oracle: with the best of each segment; its choices."""

    fixed: Array
    oracle: float
    chosen: tuple[int, ...]


@dataclass(frozen=True)
class State:
    """A tracker in the middle of a sequence, what it answered so far, and how that scores."""

    tracker: Any
    history: ReportHistory
    answers: list[Tracks]
    score: float


def candidates(tracker: str, mode: DetectionMode) -> tuple[Config, ...]:
    """The defaults, and one parameter at a time lower and higher; without those that are no config, or the defaults."""
    kind: Any = find(tracker)
    base = kind.config_class()
    made = [base]
    for p in space_of(kind.config_class, mode, online=True):
        for step in (-STEP, STEP):
            config = decode((p,), encode((p,), base) + step, base)
            made += [] if config in made else [config]
    return tuple(made)


def change(base: Config, config: Config) -> str:
    """What a candidate changes, in words."""
    rows = zip(base.as_dict().items(), config.as_dict().values(), strict=True)
    return ", ".join(f"{name}={b:.3g}" if isinstance(b, float) else f"{name}={b}" for (name, a), b in rows if a != b)


def go(
    state: State, config: Config, frames: Sequence[Frame], ready: PreparedTracker, judge: ObjectiveScorer
) -> State | None:
    """The state after these frames with this config; None where the tracker refuses it there."""
    shared: list[Any] = [ready.context, ready.context.background, ready.context.camera]
    tracker = copy.deepcopy(state.tracker, {id(one): one for one in shared if one is not None})
    tracker.config = config
    there = replace(ready, tracker=tracker, history=copy.deepcopy(state.history))
    try:
        answers = [*state.answers, *(there.step(frame) for frame in frames)]
    except InputError:
        return None
    return State(tracker, there.history, answers, objective(there, judge, answers))


def objective(ready: PreparedTracker, judge: ObjectiveScorer, answers: list[Tracks]) -> float:
    """Of the frames so far; 0 where they hold nothing to score."""
    found = judge.scores(answers, ready.px_per_m(answers))["objective"]
    return found if np.isfinite(found) else 0.0


def play(job: Job) -> Found:
    """Each candidate throughout, and the oracle."""
    held = Held(job.source, streams_for(job.tracker, job.mode))
    ready = prepare(job.tracker, held.sequence, params=job.candidates[0], detections=job.mode)
    frames = list(ready.frames())
    ready.reset(0)
    first = State(ready.tracker, ready.history, [], 0.0)
    fixed = []
    for config in job.candidates:  # a new tracker: some parameters are taken on at reset
        alone = prepare(job.tracker, held.sequence, params=config, detections=job.mode)
        alone.reset(0)
        fixed.append(objective(alone, held.judge, [alone.step(frame) for frame in frames]))
    state, chosen, long = first, [], max(1, round(job.every * held.sequence.fps))
    for begin in range(0, len(frames), long):
        tried = [go(state, c, frames[begin : begin + long], ready, held.judge) for c in job.candidates]
        best = max((k for k, t in enumerate(tried) if t is not None), key=lambda k: tried[k].score)  # type: ignore[union-attr]
        state = tried[best] or state
        chosen.append(best)
    return Found(np.array(fixed), state.score, tuple(chosen))


def played(jobs: list[Job], count: int) -> Iterator[Found]:
    """All jobs, in their order."""
    with start_workers(count) as run:
        for done, found in enumerate(results_in_order(run, play, jobs), 1):
            print(f"\r{done}/{len(jobs)} sequences", end="", file=sys.stderr, flush=True)
            yield found
    print(file=sys.stderr)


def case(name: str, given: argparse.Namespace) -> None:
    """One tracker on one scenario."""
    tracker, scenario, mode = name.split(":")
    every = candidates(tracker, mode)

    def found(seeds: str, among: tuple[Config, ...]) -> list[Found]:
        a, b = map(int, seeds.split(":"))
        jobs = [Job(tracker, s, mode, among, given.every) for s in sources(scenario, range(a, b))]
        return list(played(jobs, given.workers))

    train = found(given.train, every)
    wins = Counter(k for one in train for k in one.chosen)
    kept = [0, *[k for k, _ in wins.most_common() if k != 0][:KEPT]]
    fixed = np.mean([one.fixed[kept] for one in train], axis=0)
    best = int(fixed.argmax())
    test = found(given.seeds, tuple(every[k] for k in kept))
    rows = np.array([[f.fixed[0], f.fixed[best], f.fixed.max(), f.oracle] for f in test])
    mean, low, high = bootstrap(100 * rows)
    print(f"\n{name}, seeds {given.seeds}, every {given.every:g} s; {len(every)} candidates, kept on {given.train}:")
    print("  " + "; ".join(change(every[0], every[k]) for k in kept[1:]))
    print(f"  best fixed one on the training seeds: {change(every[0], every[kept[best]]) or 'the defaults'}\n")
    print("| | objective, points | less the best fixed one |\n|---|---|---|")
    words = ("defaults", "best fixed one", "best fixed one of each sequence", "oracle that switches")
    for k, word in enumerate(words):
        gain = "{:+.2f} [{:+.2f}, {:+.2f}]".format(*(float(v[k]) for v in paired(100 * rows[:, [1] * 4], 100 * rows)))
        print(f"| {word} | {mean[k]:.2f} [{low[k]:.2f}, {high[k]:.2f}] | {'–' if k == 1 else gain} |")
    used = Counter(kept[k] for f in test for k in f.chosen)
    share = ", ".join(
        f"{change(every[0], every[k]) or 'defaults'} {n / used.total():.0%}" for k, n in used.most_common(5)
    )
    print(f"\n  the oracle's choices: {share}", flush=True)


def main() -> None:
    made = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    made.add_argument("--cases", default=",".join(CASES), help="tracker:scenario:detections, separated by commas")
    made.add_argument("--seeds", default="20000:20100", help="test seeds a:b")
    made.add_argument("--train", default="0:8", help="training seeds a:b")
    made.add_argument("--every", type=float, default=2.5, help="s between decisions")
    made.add_argument("--workers", type=int, default=1)
    given = made.parse_args()
    for name in THREAD_VARIABLES:
        os.environ.setdefault(name, "1")
    for name in given.cases.split(","):
        case(name, given)


if __name__ == "__main__":
    main()
