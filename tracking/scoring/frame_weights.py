"""Scores of one recording as functions of weights of its frames, for intervals by resampling.

Identities and matchings are those of the whole recording. The weight w(t) of frame t enters every sum: a match, a miss,
a switch or an event of frame t counts w(t) times. So no frames are joined, and no switch or event is made by a join.
Fixed are also the core frames and who counts for MT, PT and ML. Only IDF1, IDP, IDR and IDTP assign ids anew for each
draw, as their definition is a best assignment. Weights of 1 give the scores of `evaluate`. Sums by frame are made once;
each draw of weights is a matrix product.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from sim.types import Array, Tracks, Truth
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.clear import weighted_clear
from tracking.scoring.evaluation import MatchedSides, Scorer
from tracking.scoring.group_scores import GroupMatch
from tracking.scoring.hota import weighted_hota
from tracking.scoring.identity import weighted_identity
from tracking.scoring.people_comparison import Similarity
from tracking.scoring.position_errors import weighted_positions
from tracking.scoring.weighted_group_scores import weighted_groups_and_events
from tracking.scoring.weighted_sums import WeightedScores, mean_of_known

PORTION = 100  # Draws that are computed together: bounds memory.


def weighted_scorers(
    truth: Truth,
    runs: Sequence[Sequence[Tracks]],
    similarity: Similarity | None = None,
    group_match: GroupMatch = "hull",
    frames: int | range | None = None,
) -> list[Callable[[Array], Array]]:
    """Returns for each run of one sequence a function from weights of frames to scores; arguments as of `evaluate`.

    The function takes D draws (D, length) of weights of the frames 1 … length, of mean 1, as counts are their sums.
    It returns all scores (D, K) in the order of `CATALOGUE`, nan where the frames of a denominator have no weight.
    """
    found = Scorer(truth).compare(runs, similarity, frames)
    return [_weighted(one, truth.length + 1, group_match) for one in found]


def _weighted(compared: MatchedSides, size: int, group_match: GroupMatch) -> Callable[[Array], Array]:
    parts: list[WeightedScores] = []
    if compared.people is not None:
        compared.people.require_unique_ids()
        parts += [scores(compared.people, size) for scores in (weighted_hota, weighted_clear, weighted_identity)]
        parts.append(weighted_positions(compared.sides))
    if compared.groups is not None:
        parts.append(weighted_groups_and_events(compared.sides, compared.groups, group_match))
    place = {key: k for k, key in enumerate(CATALOGUE)}

    def score(weights: Array) -> Array:
        padded = np.pad(np.asarray(weights, float), ((0, 0), (1, 0)))  # frame 0 is no frame
        out = np.full((len(padded), len(place)), np.nan)
        for first in range(0, len(padded), PORTION):
            rows = slice(first, first + PORTION)
            for part in parts:
                for key, values in part(padded[rows]).items():
                    out[rows, place[key]] = values
        out[:, place["objective"]] = mean_of_known(out[:, [place["HOTA"], place["group_F1"]]])
        return out

    return score
