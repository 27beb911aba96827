"""Ellipsoids of any dimension: the test of the plane, spheres, full states whose parts overlap although they do not."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.filters.components_kernels import overlap
from tracking.papers.stereo.group_life import separation


def random_matrix(r: np.random.Generator, size: int) -> np.ndarray:
    a = r.standard_normal((size, size))
    return a @ a.T + 0.1 * np.eye(size)


def test_in_the_plane_it_decides_as_the_kernel_does() -> None:
    r, both = np.random.default_rng(0), set()
    for _ in range(300):
        d, A, B = 3 * r.standard_normal(2), random_matrix(r, 2), random_matrix(r, 2)
        found = separation(d, A, B) <= 1
        assert found == overlap(*d, A[0, 0], A[0, 1], A[1, 1], B[0, 0], B[0, 1], B[1, 1])
        both.add(found)
    assert both == {True, False}


@pytest.mark.parametrize("size", [1, 3, 6])
def test_balls_touch_at_the_sum_of_their_radii(size: int) -> None:
    d = np.zeros(size)
    d[-1] = 5.0
    assert separation(d, 4.0 * np.eye(size), 9.0 * np.eye(size)) == pytest.approx(1.0)
    assert separation(1.1 * d, 4.0 * np.eye(size), 9.0 * np.eye(size)) == pytest.approx(1.21)


def test_it_does_not_depend_on_the_order_or_the_coordinates() -> None:
    r = np.random.default_rng(1)
    d, A, B, T = r.standard_normal(6), random_matrix(r, 6), random_matrix(r, 6), r.standard_normal((6, 6))
    first = separation(d, A, B)
    assert separation(-d, B, A) == pytest.approx(first)
    assert separation(T @ d, T @ A @ T.T, T @ B @ T.T) == pytest.approx(first, rel=1e-6)


def test_overlap_in_each_part_is_not_overlap() -> None:
    """Unit discs 1.8 apart in position and 1.8 in velocity."""
    d, one = np.array([1.8, 1.8]), np.eye(2)
    assert separation(d[:1], one[:1, :1], one[:1, :1]) < 1
    assert separation(d, one, one) > 1
