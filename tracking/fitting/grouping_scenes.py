"""Simulated scenes with true groups, as a fit of the belief sees them: rows of pairs, from exact and rough positions.

Each scene is seen twice: at 2.5 frames/s with the errors of labels, and at its own frame rate with the errors of a
detector and misses. Some scenes begin late, as if the recording had begun there.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.loading.resolve import Entry, resolve
from sim.rng import rng
from sim.sequence import simulate
from sim.types import Bools, Ints, Truth
from tracking.episodes.grouping_episodes import SURVEYED, LabelErrors, with_label_errors
from tracking.grouping.pair_evidence import evidence, frames_per_step, step_rows

SLOW = 2.5  # Frames/s of the slow copy.
DETECTED = LabelErrors(0.1, 1e-3, filmed=False)
MISSED = 0.05
BEGINS = (0.0, 4.0, 8.0)  # s: times at which scenes of successive seeds begin, if at least LEAST s are left.
LEAST = 10.0
MOST_PAIRS = 300  # Pairs of a scene that are kept, drawn at random: bounds memory.


@dataclass(frozen=True)
class PairScene:
    """One scene as R rows of pairs, sorted by pair, then step (`pair_evidence`)."""

    pair: Ints
    values: np.ndarray  # (R, len(NAMES)), float32
    together: Bools  # (R,): True if the two are in one true group in the step's last frame
    weight: int = 1  # number of times that the scene is named


def pair_scenes(names: Sequence[str], seeds: Sequence[int]) -> Iterator[PairScene]:
    """Yields two `PairScene`s for each entry of the named scenarios, suites or *.toml files and each seed: with exact,
    then with rough positions; a scene without pairs is left out. A name that is given n times has the weight n."""
    for entry, weight in [(entry, count) for name, count in Counter(names).items() for entry in resolve(name)]:
        for seed in seeds:
            truth = simulated(entry, seed)
            begin = BEGINS[seed % len(BEGINS)] if truth.length / truth.fps >= LEAST + max(BEGINS) else 0.0
            for rough in (False, True):
                found = pair_scene(truth, seed, entry.repeat, rough, begin)
                if found is not None:
                    yield replace(found, weight=weight)


def simulated(entry: Entry, seed: int) -> Truth:
    """Returns the truth of an entry that is simulated with a seed, without pictures and detections."""
    truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
    assert truth is not None
    return truth


def pair_scene(truth: Truth, seed: int, repeat: int, rough: bool, begin: float) -> PairScene | None:
    """Returns the rows of pairs of people from `begin` s on, each with whether the two are together; None without
    pairs. rough: True adds a detector's errors and misses, False a labeller's errors at 2.5 frames/s."""
    erring = with_label_errors(truth, DETECTED if rough else SURVEYED, seed, repeat)
    assert erring.pos is not None
    every = 1 if rough else max(1, round(truth.fps / SLOW))
    since, fps = round(begin * truth.fps), truth.fps / every
    ids, column = np.unique(truth.id, return_inverse=True)
    frame = truth.frame - 1 - since
    kept = (frame >= 0) & (frame % every == 0)
    if truth.truncation is not None:
        kept &= truth.truncation <= 0.5
    # true group by frame and column, -1 alone or absent
    labels = np.full(((truth.length - since - 1) // every + 1, len(ids)), -1, np.int64)
    labels[frame[kept] // every, column[kept]] = truth.group[kept]
    if rough:
        kept &= rng(seed, "label", 0, repeat=repeat).random(len(kept)) >= MISSED
    size = frames_per_step(fps)
    seen = step_rows(frame[kept] // every, column[kept], erring.pos[kept], len(labels), fps)
    parts = [(r.pair, r.step, r.a, r.b, r.values.astype(np.float32)) for r in evidence(seen, size / fps)]
    if not parts:
        return None
    pair, step, a, b, values = (np.concatenate(x) for x in zip(*parts, strict=True))
    first, second = (labels[step * size, p] for p in (a, b))
    drawn = np.flatnonzero(rng(len(pair), "label", 1).permutation(int(pair.max()) + 1)[pair] < MOST_PAIRS)
    order = drawn[np.lexsort((step[drawn], pair[drawn]))]
    together = (first >= 0) & (first == second)
    return PairScene(pair[order], values[order], together[order])
