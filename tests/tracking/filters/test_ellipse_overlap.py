"""Overlap of search regions: closed forms, invariance, and ten thousand pairs beside the nearest point of the other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.reference_components import meet, nearest
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


def test_touching_is_overlapping() -> None:
    assert one([0, 0], I2, [2, 0], I2)
    assert one([0, 0], I2, [0, 5], 16 * I2)
    assert one([0, 0], np.diag([4, 1]), [4, 0], np.diag([4, 1]))


@pytest.mark.parametrize("angle", [0.0, 0.3, np.pi / 2])
@pytest.mark.parametrize("minor", [1.0, 1e-3, 1e-6])
def test_concentric_ones_overlap(minor: float, angle: float) -> None:
    assert one([1, 1], turned(angle, 1, minor), [1, 1], turned(1.0, 0.001, 0.001))
    assert one([1, 1], turned(angle, 1, minor), [1, 1], turned(angle, 1, minor))


@pytest.mark.parametrize("minor", [1e-2, 1e-3, 1e-6])
def test_needles_that_cross(minor: float) -> None:
    along, across = np.diag([1, minor**2]), np.diag([minor**2, 1])
    assert one([0, 0], along, [0.9, 0.9], across)
    assert not one([0, 0], along, [1.1, 0], across)
    assert not one([0, 0], along, [1 + 2 * minor, 0.5], across)
    assert not one([0, 0], along, [0.9, 1 + 2 * minor], across)


@pytest.mark.parametrize("minor", [1e-2, 1e-4, 1e-6])
def test_needles_in_line(minor: float) -> None:
    along = np.diag([1, minor**2])
    assert not one([0, 0], along, [0, 3 * minor], along)  # side by side
    assert one([0, 0], along, [0, 1.9 * minor], along)
    for angle in np.linspace(0, np.pi, 7):  # head to head
        c = np.array([np.cos(angle), np.sin(angle)])
        needle = turned(angle, 1, max(minor, 1e-4))
        assert one([0, 0], needle, 1.999 * c, needle)
        assert not one([0, 0], needle, 2.001 * c, needle)


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


def test_close_to_touching() -> None:
    """Pairs moved apart until they nearly touch: a millionth nearer they meet, a millionth further they do not."""
    mean, S, other_mean, T = random_pairs(2, 1_000)
    d = other_mean - mean
    low, high = np.zeros(len(d)), np.full(len(d), 100.0)
    for _ in range(60):
        k = (low + high) / 2
        met = meet(mean, S, mean + k[:, None] * d, T, 1.0)
        low, high = np.where(met, k, low), np.where(met, high, k)
    assert overlap(mean, S, mean + (low * (1 - 1e-6))[:, None] * d, T, 1.0).all()
    assert not overlap(mean, S, mean + (high * (1 + 1e-6))[:, None] * d, T, 1.0).any()


@pytest.mark.parametrize("scale", [1.0, 1e-6, 1e6])
def test_affine_maps_leave_the_verdict(scale: float) -> None:
    r = np.random.default_rng(3)
    mean, S, other_mean, T = random_pairs(4, 2_000)
    _, sure = decided((mean, S, other_mean, T), 1.0, 1e-6)
    A = scale * (r.normal(size=(2_000, 2, 2)) + 1.5 * I2)
    shift = scale * r.normal(0, 10, 2)
    well = np.linalg.cond(A) < 100
    moved = [np.einsum("kij,kj->ki", A, m) + shift for m in (mean, other_mean)]
    bent = [A @ C @ A.transpose(0, 2, 1) for C in (S, T)]
    before, after = overlap(mean, S, other_mean, T, 1.0), overlap(moved[0], bent[0], moved[1], bent[1], 1.0)
    assert (sure & well).sum() > 1_800
    assert np.array_equal(before[sure & well], after[sure & well])


number = st.floats(-5, 5)
axis = st.floats(0.05, 3)


@settings(max_examples=300, deadline=None)
@given(number, number, st.floats(0, np.pi), axis, axis, st.floats(0, np.pi), axis, axis)
def test_neither_is_first(x, y, angle, a, b, other_angle, c, d) -> None:
    S, T = turned(angle, a, b), turned(other_angle, c, d)
    least = nearest(np.zeros((1, 2)), S[None], np.array([[x, y]]), T[None])[0]
    verdict = one([0, 0], S, [x, y], T)
    if abs(least - 1) > 1e-7:
        assert verdict == (least <= 1)
        assert one([x, y], T, [0, 0], S) == verdict


def test_the_gate_is_the_square_of_the_size() -> None:
    mean, S, other_mean, T = random_pairs(5, 500)
    _, sure = decided((mean, S, other_mean, T), GATE, 1e-6)
    expected = overlap(mean, GATE * S, other_mean, GATE * T, 1.0)
    assert np.array_equal(overlap(mean, S, other_mean, T, GATE)[sure], expected[sure])
    assert (expected != overlap(mean, S, other_mean, T, 1.0)).any()


def test_all_with_all() -> None:
    mean, S, _, _ = random_pairs(6, 40)
    found = regions_overlap(mean, S, 1.0)
    i, j = (k.ravel() for k in np.indices((40, 40)))
    assert np.array_equal(found.ravel(), overlap(mean[i], S[i], mean[j], S[j], 1.0))
    assert np.array_equal(found, found.T)
    assert found.diagonal().all()
    assert 40 < found.sum() < 1_600
    assert regions_overlap(np.zeros((0, 2)), np.zeros((0, 2, 2)), 1.0).shape == (0, 0)
