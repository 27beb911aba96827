"""Errors of places, velocities and extents: worked out by hand, and the extents by scipy's matrix roots."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import sqrtm

from tracking.scoring.position_errors import gaussian_wasserstein, people_errors, root_mean_square


def test_root_mean_square_of_lengths() -> None:
    assert root_mean_square(np.array([[3.0, 4.0], [0.0, 1.0], [np.nan, 0.0]])) == pytest.approx(np.sqrt((25 + 1) / 2))
    assert np.isnan(root_mean_square(np.zeros((0, 2))))


def test_only_mapped_people_count() -> None:
    true_pos = np.array([[0.0, 0.0], [5.0, 5.0], [9.0, 9.0]])
    est_pos = np.array([[5.0, 5.5], [80.0, 80.0], [0.3, 0.4]])
    found = people_errors(np.array([1, -1, 0]), true_pos, est_pos)
    assert found["RMSE_pos"] == pytest.approx(0.5)
    assert np.isnan(found["RMSE_vel"])
    found = people_errors(
        np.array([1, -1, 0]), true_pos, est_pos, np.zeros((3, 2)), np.array([[0, 1], [9, 9], [0, 2.0]])
    )
    assert found["RMSE_vel"] == pytest.approx(np.sqrt((1 + 4) / 2))


def test_distance_of_gaussians_by_hand() -> None:
    eye, zero = np.eye(2)[None], np.zeros((1, 2))
    assert gaussian_wasserstein(zero, eye, np.array([[3.0, 4.0]]), eye) == pytest.approx([5.0])
    # Aligned axes: differences of the standard deviations, 2 - 1 and 3 - 1.
    assert gaussian_wasserstein(zero, np.diag([4.0, 9.0])[None], zero, eye) == pytest.approx([np.sqrt(1 + 4)])
    # A line against a point, and against the line across.
    line, across = np.diag([1.0, 0.0])[None], np.diag([0.0, 1.0])[None]
    assert gaussian_wasserstein(zero, line, zero, 0 * eye) == pytest.approx([1.0])
    assert gaussian_wasserstein(zero, line, zero, across) == pytest.approx([np.sqrt(2)])
    assert np.isnan(gaussian_wasserstein(zero, np.nan * eye, zero, eye)).all()


def test_distance_of_gaussians_by_matrix_roots() -> None:
    r = np.random.default_rng(0)
    a, b = (m @ m.transpose(0, 2, 1) for m in r.normal(size=(2, 50, 2, 2)))
    p, q = r.normal(size=(2, 50, 2))
    expected = []
    for s1, s2, m1, m2 in zip(a, b, p, q, strict=True):
        root = sqrtm(s1)
        shape = np.trace(s1 + s2 - 2 * np.real(sqrtm(root @ s2 @ root)))
        expected.append(np.sqrt(((m1 - m2) ** 2).sum() + shape))
    assert gaussian_wasserstein(p, a, q, b) == pytest.approx(expected, abs=1e-9)
    assert gaussian_wasserstein(p, a, p, a) == pytest.approx(np.zeros(50), abs=1e-6)
