"""Mode `calibration --inputs` of `benchmarks.belief`: how sure the belief is and ought to be, by what it is given.

Inputs: truth (exact positions), .1/.3, .15/.6 (positions with errors as in mode `noise`, m across and along the line of
sight), boxes (of six cameras in turn, at the places where they stand; `benchmarks.belief.cameras`). Ids are known.
Pairs of people within the belief's reach in one frame; sequences weigh the same, 15 bins of probability. Calibration
error: mean over bins of |mean probability - share of mates|, weighed by the rows of the bin. pairs: pairs of a frame.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from benchmarks.belief.cameras import VIEWS, known_boxes, seen_by
from benchmarks.belief.errors import SIZES, with_errors
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import head, number, row
from scenarios.errors import InputError
from scenarios.loading.resolve import Entry, resolve
from sim.sequence import simulate
from sim.types import Array, Bools, Tracks, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.foot_points import standing
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.pair_beliefs import pair_probabilities
from tracking.grouping.tracks_table import tabulate

BINS = 15  # of equal width, between the probabilities 0 and 1
Made = Callable[[Entry, int, int, Path], tuple[Truth, Sequence[Tracks]]]


def _with_errors(index: int) -> Made:
    def made(entry: Entry, seed: int, number: int, data: Path) -> tuple[Truth, Sequence[Tracks]]:
        truth = simulate(entry.scenario, seed, entry.repeat, streams=()).truth
        return truth, people_as_tracks(with_errors(truth, SIZES[index], seed) if index else truth)

    return made


def _boxes(entry: Entry, seed: int, number: int, data: Path) -> tuple[Truth, Sequence[Tracks]]:
    sequence = seen_by(VIEWS[number % len(VIEWS)], entry, seed, data)
    assert sequence.camera is not None
    return sequence.truth, standing(known_boxes(sequence), sequence.camera, sequence.scene)


INPUTS: dict[str, Made] = {
    "truth": _with_errors(0), ".1/.3": _with_errors(1), ".15/.6": _with_errors(2), "boxes": _boxes,
}  # fmt: skip


def calibration_by_input(names: Sequence[str], seeds: range, belief: Belief, inputs: Sequence[str], data: Path) -> None:
    """Prints the table."""
    unknown = set(inputs) - INPUTS.keys()
    if unknown:
        expected = ", ".join(INPUTS)
        raise InputError(place="--inputs", got=min(unknown), expected=expected, remedy="name some of them")
    print(f"seeds {seeds_text(seeds)}")
    head(["suite", "input", "pairs", "calibration error", "mean probability", "share of mates", "above 0.9", "mates"])
    for name in names:
        for key in inputs:
            every = [(entry, seed) for entry in resolve(name) for seed in seeds]
            parts = [told(*INPUTS[key](entry, seed, k, data), belief) for k, (entry, seed) in enumerate(every)]
            probability, true = (np.concatenate(x) for x in zip(*parts, strict=True))
            weight = np.concatenate([np.full(len(p), 1 / max(len(p), 1)) for p, _ in parts])
            row([Path(name).stem, key, str(len(true)), *cells(probability, true, weight)])


def told(truth: Truth, tracks: Sequence[Tracks], belief: Belief) -> tuple[Array, Bools]:
    """Returns the probability of each pair of one frame, (R,), and whether it is one true group."""
    pairs = pair_probabilities(tabulate(tracks, truth.fps, truth.px_per_m), truth.fps, belief)
    size = int(truth.id.max(initial=0)) + 1
    key = truth.frame * size + truth.id
    a, b = (truth.group[np.searchsorted(key, pairs.frame * size + id)] for id in (pairs.a, pairs.b))
    return pairs.probability, (a >= 0) & (a == b)


def cells(probability: Array, true: Bools, weight: Array) -> list[str]:
    """Returns the cells of an input: calibration error, means of all rows, and of those above 0.9."""
    place = np.minimum((probability * BINS).astype(np.int64), BINS - 1)
    total = weight.sum()
    error = float(np.abs(np.bincount(place, weight * (probability - true), BINS)).sum() / total)
    sure = probability > 0.9
    mates = float(np.average(true[sure], weights=weight[sure])) if sure.any() else float("nan")
    means = (float(x @ weight / total) for x in (probability, true))
    return [number(error), *(number(x) for x in means), f"{float(weight[sure].sum() / total):.1%}", number(mates)]
