"""Hulls of many sets at once, beside the plain one of a set."""

from __future__ import annotations

import numpy as np
import pytest

from sim.geometry.hull_kernels import convex_hulls
from sim.geometry.polygons import convex_hull


@pytest.mark.parametrize("seed", range(20))
def test_hulls_are_those_of_each_set_by_itself(seed: int) -> None:
    r = np.random.default_rng(seed)
    sets = [r.integers(0, 6, (int(r.integers(0, 12)), 2)).astype(float) for _ in range(30)]
    for points, found in zip(sets, convex_hulls(sets), strict=True):
        if len(np.unique(points, axis=0)) == len(points):
            np.testing.assert_array_equal(found, convex_hull(points))


def test_points_lines_and_nothing() -> None:
    point, line = np.array([[2.0, 1.0]]), np.array([[0.0, 0.0], [2.0, 2.0], [1.0, 1.0]])
    nothing, unknown = np.zeros((0, 2)), np.array([[0.0, 0.0], [np.nan, 1.0], [1.0, 0.0]])
    found = convex_hulls([point, nothing, line, unknown])
    assert [f.tolist() for f in found] == [[[2.0, 1.0]], [], [[0.0, 0.0], [2.0, 2.0]], []]
    assert convex_hulls([]) == ()
    assert [len(f) for f in convex_hulls([nothing, nothing])] == [0, 0]
