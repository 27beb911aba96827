"""Pairing: the paper's nearest neighbour, and least total cost against all pairings."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference_tracking import best_pairing
from tracking.filters import assignment


def test_nearest_takes_each_measurement_to_its_deepest_gate():
    cost = np.array([[1.0, 4.0, np.inf, np.inf], [2.0, 3.0, np.inf, 0.5]])
    rows, columns = assignment.nearest(cost)
    assert rows.tolist() == [0, 1, 1]
    assert columns.tolist() == [0, 1, 3]


@pytest.mark.parametrize("seed", range(40))
def test_optimal_is_the_best_of_all_pairings(seed):
    r = np.random.default_rng(seed)
    cost = r.uniform(0, 14, (r.integers(1, 5), r.integers(1, 5)))
    cost[r.random(cost.shape) < 0.5] = np.inf
    rows, columns = assignment.optimal(cost, 10.0)
    assert len(set(rows)) == len(rows)
    assert len(set(columns)) == len(columns)
    assert (cost[rows, columns] < 10).all()
    total = cost[rows, columns].sum() + 10 * (len(cost) - len(rows))
    assert total == pytest.approx(best_pairing(np.minimum(cost, 1e6), 10.0))


@pytest.mark.parametrize("shape", [(0, 3), (3, 0), (0, 0), (2, 2)])
def test_nothing_in_any_gate(shape):
    cost = np.full(shape, np.inf)
    for rows, columns in (assignment.nearest(cost), assignment.optimal(cost, 5.0)):
        assert len(rows) == len(columns) == 0
