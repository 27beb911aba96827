"""How probable it is that two tracked people belong together, for every pair and frame: a table of pairs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.truth.merge_split_rules import runs
from sim.types import Array, Ints, Tracks
from tracking.grouping.belief import Belief, beliefs_of_tracks
from tracking.grouping.pair_evidence import frames_per_step
from tracking.grouping.tracks_table import tabulate


@dataclass(frozen=True, slots=True, eq=False)
class PairProbabilities:
    """Rows of pairs, sorted by frame, then ids: frame (R,) from 1; a, b (R,): ids, a < b; probability (R,), 0 to 1."""

    frame: Ints
    a: Ints
    b: Ints
    probability: Array


def pair_probabilities(tracks: Sequence[Tracks], fps: float, px_per_m: float, belief: Belief) -> PairProbabilities:
    """Returns the probability that two people belong together, for all pairs less than 4 m apart, in each frame.

    The belief changes once in a step of at most 0.4 s and holds until the next.
    """
    table = tabulate(tracks, fps, px_per_m)
    found = beliefs_of_tracks(table.frame, table.column, table.pos, table.length, fps, belief)
    size = frames_per_step(fps)
    known = found.step * size
    row, frame = runs(known, np.minimum(known + size, table.length))
    present = np.zeros((table.length, len(table.ids)), bool)
    present[table.frame, table.column] = True
    a, b = found.a[row], found.b[row]
    both = present[frame, a] & present[frame, b]
    row, frame, a, b = row[both], frame[both], a[both], b[both]
    order = np.lexsort((b, a, frame))
    probability = 1 / (1 + np.exp(-found.log_odds[row]))
    return PairProbabilities(frame[order] + 1, table.ids[a[order]], table.ids[b[order]], probability[order])
