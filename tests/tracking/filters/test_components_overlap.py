"""Overlap of search regions: closed forms, invariance, and ten thousand pairs beside the nearest point of the other."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference_components import nearest
from tracking.filters import components_kernels
from tracking.filters.components import regions_overlap

GATE = 9.21
I2 = np.eye(2)


def turned(angle, major, minor):
    c, s = np.cos(angle), np.sin(angle)
    R = np.array([[c, -s], [s, c]])
    return R @ np.diag([major**2, minor**2]) @ R.T


def overlap(mean, covariance, other_mean, other_covariance, gate):
    """(K,) the kernel's answer for each pair of regions."""
    found = np.zeros(len(mean), bool)
    for k in range(len(mean)):
        a, b, d = gate * covariance[k], gate * other_covariance[k], other_mean[k] - mean[k]
        found[k] = components_kernels.overlap(d[0], d[1], a[0, 0], a[0, 1], a[1, 1], b[0, 0], b[0, 1], b[1, 1])
    return found


def one(mean, covariance, other_mean, other_covariance, gate=1.0):
    pair = (np.array(a, float)[None] for a in (mean, covariance, other_mean, other_covariance))
    return bool(overlap(*pair, gate)[0])


def random_pairs(seed, count, flat=1.0, reach=2.0):
    """Ellipses of all directions, semi-axes 0.2 to 2 (the minor ones: down to `flat` times that)."""
    r = np.random.default_rng(seed)
    axes = 10 ** r.uniform(np.log10(0.2), np.log10(2), (2, count, 2))
    axes[..., 1] *= 10 ** r.uniform(np.log10(flat), 0, (2, count))
    shape = np.array([[turned(a, *m) for a, m in zip(r.uniform(0, np.pi, count), m2, strict=True)] for m2 in axes])
    mean = r.uniform(-reach, reach, (2, count, 2))
    return mean[0], shape[0], mean[1], shape[1]


@pytest.mark.parametrize("gate", [1.0, GATE])
@pytest.mark.parametrize(("a", "b"), [(1.0, 1.0), (0.5, 2.0), (0.01, 30.0), (1e-6, 1.0), (1e5, 3e5)])
def test_circles_touch_at_the_sum_of_their_radii(a: float, b: float, gate: float) -> None:
    for angle in np.linspace(0, 2 * np.pi, 12):
        towards = np.sqrt(gate) * (a + b) * np.array([np.cos(angle), np.sin(angle)])
        inside, outside = (
            one([3, -2], a**2 * I2, [3, -2] + k * towards, b**2 * I2, gate) for k in (1 - 1e-9, 1 + 1e-9)
        )
        assert inside
        assert not outside


def decided(pairs, gate, margin):
    """The oracle's verdict, and where it is certain."""
    mean, S, other_mean, T = pairs
    least = nearest(mean, gate * S, other_mean, gate * T)
    return least <= 1, np.abs(least - 1) > margin


@pytest.mark.parametrize(("flat", "reach"), [(1.0, 2.0), (1e-2, 1.0)])
def test_ten_thousand_random_pairs(flat: float, reach: float) -> None:
    pairs = random_pairs(1, 10_000, flat, reach)
    expected, sure = decided(pairs, 1.0, 1e-6)
    assert sure.sum() > 9_990
    assert 0.2 < expected.mean() < 0.9
    assert np.array_equal(overlap(*pairs, 1.0)[sure], expected[sure])


def test_all_with_all() -> None:
    mean, S, _, _ = random_pairs(6, 40)
    found = regions_overlap(mean, S, 1.0)
    i, j = (k.ravel() for k in np.indices((40, 40)))
    assert np.array_equal(found.ravel(), overlap(mean[i], S[i], mean[j], S[j], 1.0))
    assert np.array_equal(found, found.T)
    assert found.diagonal().all()
    assert 40 < found.sum() < 1_600
    assert regions_overlap(np.zeros((0, 2)), np.zeros((0, 2, 2)), 1.0).shape == (0, 0)
