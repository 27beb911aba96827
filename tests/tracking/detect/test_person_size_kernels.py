"""Tables of sizes between their nodes: the same as numpy's, at the ends, beyond them and where nothing is known."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.detect.person_size_kernels import look_up


def slow(table, at):
    """Bilinear values, all points at once."""
    at = np.clip(np.nan_to_num(at), 0.0, np.array(table.shape[:0:-1]) - 1.001)
    (u, v), (a, b) = at.astype(int).T, (at - np.floor(at)).T
    low = table[:, v, u] * (1 - a) + table[:, v, u + 1] * a
    high = table[:, v + 1, u] * (1 - a) + table[:, v + 1, u + 1] * a
    return (low * (1 - b) + high * b).T


@pytest.mark.parametrize("n", [0, 1, 50])
def test_values_between_nodes_are_the_slow_way(n):
    r = np.random.default_rng(n)
    table = r.random((2, 6, 8))
    table[:, 0] = np.nan
    at = r.uniform(-3, 11, (n, 2))
    at[: n // 10, 0], at[n // 5 : n // 4] = np.nan, (np.inf, -np.inf)
    assert np.array_equal(look_up(table, at), slow(table, at), equal_nan=True)
