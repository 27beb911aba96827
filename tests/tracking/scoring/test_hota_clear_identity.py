"""HOTA, CLEAR, Identity: equal to TrackEval on random and real cases, ties included; exactly 1 for the truth."""

from __future__ import annotations

import numpy as np
import pytest

from tests.matrix_pairs import matrix_pairs
from tests.reference_trackeval import trackeval_scores
from tracking.scoring.evaluation import weighted_people
from tracking.scoring.frame_weights import unweighted
from tracking.scoring.hota import hota_sums, unweighted_hota

SEEDS = range(15)


def random_case(seed: int, values=None, crowd: int = 9):
    """Frames with 0 … crowd - 1 on each side, those of equal number mostly similar; values: what similarities are."""
    r = np.random.default_rng(seed)
    true, est, similarity = [], [], []
    for _ in range(int(r.integers(1, 30))):
        i, j = (r.permutation(crowd)[: r.integers(0, crowd)] + offset for offset in (3, 500))
        s = r.random((len(i), len(j))) if values is None else r.choice(values, (len(i), len(j)))
        s *= r.random(s.shape) < 0.5
        s[(i[:, None] - 3 == j[None] - 500) & (r.random(s.shape) < 0.7)] = 0.75
        true.append(i), est.append(j), similarity.append(s)
    return true, est, similarity


def assert_equal_to_trackeval(true, est, similarity, pairs=None) -> None:
    pairs = pairs or matrix_pairs(true, est, similarity)
    found = unweighted(weighted_people(pairs, pairs.size, hota_sums(pairs, pairs.size)), pairs.size)
    assert unweighted_hota(pairs) == found["HOTA"], "to the last bit"
    assert found == pytest.approx(trackeval_scores(true, est, similarity), abs=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_equal_to_trackeval(seed: int) -> None:
    assert_equal_to_trackeval(*random_case(seed))


@pytest.mark.parametrize("seed", SEEDS)
def test_equal_to_trackeval_where_similarities_tie(seed: int) -> None:
    """Quarters add up exactly: whole matchings are equally good, and which one is taken shows in switches and AssA."""
    assert_equal_to_trackeval(*random_case(seed, values=(0.25, 0.5, 0.75, 1.0)))


@pytest.mark.parametrize("seed", range(5))
def test_equal_to_trackeval_in_a_crowd(seed: int) -> None:
    assert_equal_to_trackeval(*random_case(seed, crowd=60))


EDGES = {
    "nothing": ([[]], [[]], [np.zeros((0, 0))]),
    "no tracks": ([[1, 2], [2]], [[], []], [np.zeros((2, 0)), np.zeros((1, 0))]),
    "no truth": ([[], []], [[4], [4, 5]], [np.zeros((0, 1)), np.zeros((0, 2))]),
    "nobody true": ([[1], [], [1]], [[4], [4], [5]], [np.ones((1, 1)), np.zeros((0, 1)), np.ones((1, 1))]),
    "nobody said": ([[1], [1], [1]], [[4], [], [4]], [np.ones((1, 1)), np.zeros((1, 0)), np.ones((1, 1))]),
    "a miss": ([[1], [1], [1]], [[4], [5], [4]], [np.ones((1, 1)), np.zeros((1, 1)), np.ones((1, 1))]),
    "far": ([[1, 2]], [[4, 5]], [np.zeros((2, 2))]),
    "all equal": ([[1, 2]], [[4, 5]], [np.full((2, 2), 0.5)]),
    "rounded half": ([[1]], [[4]], [np.full((1, 1), 0.5 - 1e-16)]),
}


@pytest.mark.parametrize("case", EDGES.values(), ids=EDGES)
def test_equal_to_trackeval_at_the_edges(case) -> None:
    assert_equal_to_trackeval(*case)
