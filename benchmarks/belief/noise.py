"""Mode `noise` of `benchmarks.belief`: pairwise F1 on seq_hotel and zara01 from positions that err as cameras' do.

Errors are correlated over 1 s and larger along the line of sight, here y (`benchmarks.belief.errors`); 0.1/0.3 are the
standard deviations across and along it, m. Ids are known. Means over the draws of errors, seeds 0, 1, …; `both`: mean
of the two recordings. Further rows change one thing of the errors 0.15/0.6: their correlation time, the direction in
which they are larger, tracks that switch ids, missed people, frames a second.
naive: a causal rule without a fit. Two people are together if their mean offset over the last 6 s is below 1.3 m, and
the means over the two halves of this time differ by less than 0.3 m + 0.2 m/s times it.
SPENCER and the rule use velocities of the positions that err, over the last 0.5 s in whole frames.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.belief.errors import SIZES, Errors, each_second, missed, switched, with_errors
from benchmarks.belief.pairs import f1, labelled, linked_pairs, pairs_in_frames, spencer
from benchmarks.support.options import HOTEL, ZARA
from benchmarks.support.tables import head, number, row
from sim.truth.velocities import chords
from sim.types import Array, Bools, Ints, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.link_rule import LinkRule

SPAN, REACH, DRIFT, STRAY, APART = 6.0, 1.3, 0.2, 0.3, 6.0  # s, m, m/s, m, m: of the naive rule
FEW = 4  # rows below which the naive rule does not compare halves
USUAL = Errors(0.15, 0.6)
Case = Callable[[Truth, int], Truth]


def _plain(errors: Errors) -> Case:
    return lambda truth, seed: with_errors(truth, errors, seed)


CASES: Mapping[str, Case] = {
    **{f"{errors.text} m": _plain(errors) for errors in SIZES},
    **{f"{USUAL.text}, over {time:g} s": _plain(replace(USUAL, time=time)) for time in (0.0, 0.4, 3.0)},
    f"{USUAL.text}, larger along x": _plain(replace(USUAL, turn_deg=90.0)),
    f"{USUAL.text}, larger along a diagonal": _plain(replace(USUAL, turn_deg=45.0)),
    f"{USUAL.text}, ids switch within 2 m": lambda truth, seed: switched(with_errors(truth, USUAL, seed), 20.0, seed),
    f"{USUAL.text}, 30 % missed": lambda truth, seed: missed(with_errors(truth, USUAL, seed), 0.3, seed),
    f"{USUAL.text}, 1 frame/s": lambda truth, seed: with_errors(each_second(truth), USUAL, seed),
}


def noise(data: Path, draws: int, belief: Belief, before: Belief | None) -> None:
    """Prints the table."""
    beliefs = {"belief": belief, **({} if before is None else {"before": before})}
    columns = ["naive", "SPENCER", "rule", *beliefs]
    truths = {Path(folder).name: labelled(data / folder) for folder in (HOTEL, ZARA)}
    print(f"pairwise F1, {draws} draws of errors")
    head(["errors", "recording", *columns, *(["belief minus before"] if before else [])])
    for name, case in CASES.items():
        # without errors every draw is the same
        seeds = range(1 if name == f"{SIZES[0].text} m" else draws)
        found = {
            key: np.mean([scores(case(truth, seed), beliefs) for seed in seeds], axis=0)
            for key, truth in truths.items()
        }
        for key, values in {**found, "both": np.mean([*found.values()], axis=0)}.items():
            cells = [number(value) for value in values]
            row([name, key, *cells, *([f"{values[-2] - values[-1]:+.3f}"] if before else [])])


def scores(truth: Truth, beliefs: Mapping[str, Belief]) -> list[float]:
    """Returns the pairwise F1 of the naive rule, SPENCER, the baseline rule, and each belief."""
    i, j, same = pairs_in_frames(truth)
    assert truth.pos is not None
    moving = truth.replace(vel=chords(truth.frame, truth.id, truth.pos, truth.fps))
    found = [naive_pairs(truth, i, j), spencer(moving, i, j)]
    groupings: list[Grouping] = [LinkRule(), *beliefs.values()]
    found += [linked_pairs(truth, grouping, i, j) for grouping in groupings]
    once, frame = np.ones((1, truth.length)), truth.frame[i] - 1
    return [float(f1(once, frame, same, pairs)[0]) for pairs in found]


def naive_pairs(truth: Truth, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows the naive rule holds to be together. i, j (R,): rows of one frame, i before j."""
    assert truth.pos is not None
    frame, size = truth.frame[i], int(truth.id.max(initial=0)) + 1
    pair = truth.id[i] * size + truth.id[j]
    order = np.lexsort((frame, pair))
    frame, offset = frame[order], (truth.pos[j] - truth.pos[i])[order]
    total = np.concatenate([np.zeros((1, 2)), np.cumsum(offset, axis=0)])
    key, span = pair[order] * (2 * truth.length) + frame, round(SPAN * truth.fps)
    end = np.arange(len(key)) + 1
    begin = np.maximum(np.searchsorted(key, key - span, side="right"), np.searchsorted(pair[order], pair[order]))
    rows = end - begin

    def mean(first: Ints, last: Ints) -> Array:
        return np.asarray((total[last] - total[first]) / np.maximum(last - first, 1)[:, None])

    middle = end - rows // 2
    change = np.where(rows < FEW, 0.0, np.hypot(*(mean(middle, end) - mean(begin, middle)).T))
    here = np.abs(offset).max(axis=1, initial=0.0) <= APART
    near = np.hypot(*mean(begin, end).T) < REACH
    found = np.empty(len(order), bool)
    found[order] = here & near & (change < DRIFT * rows / truth.fps + STRAY)
    return found
