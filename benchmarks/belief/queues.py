"""Mode `queues` of `benchmarks.belief`: strangers who stand or walk close to each other in lines and crowds.

Scenes: those of the suite `lines`. Ids are known, positions exact or with errors as in mode `noise`, m across and along
the line of sight.
false: pairs reported in one group who are in no true group together, in pair-minutes for each minute that a person is
seen. precision, recall: of pairs of one frame. in queues: share of the true pairs found among people who both queue.
Means over sequences with 95 % intervals; differences are paired.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.belief.errors import SIZES, with_errors
from benchmarks.belief.pairs import linked_pairs, pairs_in_frames
from benchmarks.support.options import seeds_text
from benchmarks.support.tables import difference_cell, mean_cell, table
from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Bools, Ints, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.grouping_choice import Grouping
from tracking.grouping.link_rule import LinkRule

COLUMNS = ("false", "precision", "recall", "in queues")
OF = ("", "pairwise_precision", "pairwise_recall", "pairwise_recall")  # scores at whose range intervals are cut


def queues(seeds: range, belief: Belief, before: Belief | None) -> None:
    """Prints a table for each scene."""
    groupings: dict[str, Grouping] = {"rule": LinkRule(), "belief": belief, **({"before": before} if before else {})}
    print("false: pair-minutes for each person-minute")
    for entry in resolve("lines"):
        truths: list[Truth] = [simulate(entry.scenario, seed, entry.repeat, streams=()).truth for seed in seeds]
        rows: dict[str, list[str]] = {}
        for errors in SIZES[:3]:
            erring = [
                with_errors(t, errors, seed) if errors.along else t for t, seed in zip(truths, seeds, strict=True)
            ]
            found = {name: _values(truths, erring, grouping) for name, grouping in groupings.items()}
            rows |= {f"{errors.text} m, {name}": [*map(mean_cell, values.T, OF)] for name, values in found.items()}
            other = "before" if before else "rule"
            rows[f"{errors.text} m, belief minus {other}"] = _differences(found, other)
        table(f"{entry.name}, seeds {seeds_text(seeds)}", "errors, groups", COLUMNS, rows)


def _values(truths: list[Truth], erring: list[Truth], grouping: Grouping) -> Array:
    return np.array([pair_scores(t, e, grouping) for t, e in zip(truths, erring, strict=True)])


def _differences(found: Mapping[str, Array], other: str) -> list[str]:
    return [*map(difference_cell, (found["belief"] - found[other]).T, OF)]


def pair_scores(truth: Truth, erring: Truth, grouping: Grouping) -> list[float]:
    """Returns the values of `COLUMNS` of the groups that a grouping finds in `erring`, the truth with errors; nan
    without a pair to count."""
    i, j, same = pairs_in_frames(truth)
    found, waits = linked_pairs(erring, grouping, i, j), queueing(truth)
    hits, queue = found & same, same & waits[i] & waits[j]
    return [
        float((found & ~same).sum() / len(truth.id)),
        *(float(a.sum() / b.sum()) if b.any() else float("nan") for a, b in ((hits, found), (hits, same))),
        float(found[queue].mean()) if queue.any() else float("nan"),
    ]


def queueing(truth: Truth) -> Bools:
    """Returns which rows are people in a queue, (R,), by the events of the truth."""
    found = np.zeros(len(truth.id), bool)
    for event in truth.events or ():
        if event.kind == "queue":
            during: Ints = np.flatnonzero((truth.frame >= event.start) & (truth.frame <= event.end))
            found[during] |= np.isin(truth.id[during], event.members)
    return found
