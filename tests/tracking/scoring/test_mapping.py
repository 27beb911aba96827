"""Estimated people as true people: by the best assignment of each frame, from a similarity of 0.5."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from tracking.scoring.mapping import mapped
from tracking.scoring.similarity import Rows, matrix_pairs, point_pairs


def test_the_total_counts_and_not_the_nearest_first() -> None:
    pairs = matrix_pairs([[7, 8]], [[1, 2]], [np.array([[0.9, 0.8], [0.75, 0.0]])])
    assert mapped(pairs).tolist() == [1, 0]  # 0.8 + 0.75 > 0.9


def test_one_metre_is_near_enough_and_more_is_not() -> None:
    rows = Rows(np.array([1, 2]), np.array([5, 5]))
    there = np.array([[1.0, 0.0], [1.001, 0.0]])
    assert mapped(point_pairs(rows, rows, np.zeros((2, 2)), there, 2.0)).tolist() == [0, -1]
    assert mapped(point_pairs(rows, rows, np.zeros((2, 2)), there, 2.0), least=0.6).tolist() == [-1, -1]


def test_nobody_on_either_side() -> None:
    assert mapped(matrix_pairs([[], [3]], [[4], []], [np.zeros((0, 1)), np.zeros((1, 0))])).tolist() == [-1]
    assert mapped(matrix_pairs([], [], [])).tolist() == []


@pytest.mark.parametrize("seed", range(20))
def test_equal_to_the_assignment_of_each_frame(seed: int) -> None:
    r = np.random.default_rng(seed)
    sizes = r.integers(0, 9, (12, 2))
    similarity = [r.random((n, m)) * (r.random((n, m)) < 0.6) for n, m in sizes]
    pairs = matrix_pairs([np.arange(n) for n, _ in sizes], [np.arange(m) for _, m in sizes], similarity)
    expected: list[int] = []
    for s, first in zip(similarity, np.cumsum(sizes[:, 0]) - sizes[:, 0], strict=True):
        weight = np.where(s >= 0.5, s, 0.0)
        who = np.full(s.shape[1], -1)
        for i, j in zip(*linear_sum_assignment(weight, maximize=True), strict=True):
            if weight[i, j] > 0:
                who[j] = first + i
        expected += who.tolist()
    assert mapped(pairs).tolist() == expected
