"""Mode `decisions` of `benchmarks.belief`: what decides who is together now.

Pairwise F1 by SPENCER, by the groups of now, by those of events, which change late, and of pairs whose probability is
above 0.5; on two recordings, and in means over sequences, of `streets` by quarters of density, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.belief.pairs import f1, labelled, linked_pairs, pairs_in_frames, spencer
from benchmarks.support.options import HOTEL, ZARA
from benchmarks.support.replaced_code import replaced_code
from benchmarks.support.tables import difference_cell, head, mean_cell, number, row
from scenarios.loading.resolve import resolve
from sim.types import Bools, Ints, Truth
from tracking.fitting.grouping_scenes import simulated
from tracking.grouping import grouping_choice
from tracking.grouping.belief import Belief
from tracking.grouping.belief_groups import BeliefGroups, FoundGroups
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.motion_history import PeopleRows
from tracking.grouping.pair_beliefs import pair_probabilities
from tracking.grouping.tracks_table import tabulate

DECIDED = ("SPENCER", "now", "groups of events", "probability above 0.5")


class LateGroups(BeliefGroups):
    """The groups of events in place of those of now."""

    def add(self, rows: PeopleRows, column: Ints, end: int) -> FoundGroups:
        """Adds the frames up to `end`, as `BeliefGroups.add`, and returns the links alone."""
        return replace(super().add(rows, column, end), now=None)


def probable_pairs(truth: Truth, belief: Belief, i: Ints, j: Ints) -> Bools:
    """Returns which pairs of rows are together with a probability above 0.5."""
    found = pair_probabilities(tabulate(people_as_tracks(truth), truth.fps, truth.px_per_m), truth.fps, belief)
    told = found.probability > 0.5
    size = int(truth.id.max()) + 1
    low, high = np.sort([truth.id[i], truth.id[j]], axis=0)
    keys = (found.frame * size + found.a) * size + found.b
    return np.isin((truth.frame[i] * size + low) * size + high, keys[told])


def decision_scores(truth: Truth, belief: Belief) -> list[float]:
    """Returns the pairwise F1 of each decision of `DECIDED`, nan without mates."""
    i, j, same = pairs_in_frames(truth)
    with replaced_code([(grouping_choice, "BeliefGroups", LateGroups)]):
        late = linked_pairs(truth, belief, i, j)
    found = (spencer(truth, i, j), linked_pairs(truth, belief, i, j), late, probable_pairs(truth, belief, i, j))
    once, frame = np.ones((1, truth.length)), truth.frame[i] - 1
    return [float(f1(once, frame, same, x)[0]) if same.any() else float("nan") for x in found]


def decisions(names: Sequence[str], seeds: range, belief: Belief, data: Path) -> None:
    head(["", *DECIDED, "now minus above 0.5"])
    for folder in (HOTEL, ZARA):
        scores = decision_scores(labelled(data / folder), belief)
        row([Path(folder).name, *map(number, scores), f"{scores[1] - scores[3]:+.3f}"])
    for name in names:
        truths = [simulated(entry, seed) for entry in resolve(name) for seed in seeds]
        found = np.array([decision_scores(truth, belief) for truth in truths])
        rows = {f"{Path(name).stem}, {len(truths)} sequences": np.arange(len(truths))}
        if name == "streets":
            order = np.argsort([len(truth.frame) / truth.length for truth in truths])
            rows |= {f"{name}, quarter {k} by people in view": q for k, q in enumerate(np.array_split(order, 4), 1)}
        for title, chosen in rows.items():
            scores = found[chosen][np.isfinite(found[chosen, 0])]
            row([title, *map(mean_cell, scores.T), difference_cell(scores[:, 1] - scores[:, 3])])
