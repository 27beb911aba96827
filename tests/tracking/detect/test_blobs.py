"""Blobs: ellipses of known shapes, thresholds in metres, symmetries, contours; equal to loops over regions."""

import cv2
import numpy as np
import pytest

from tests import reference_blobs as slow
from tracking.detect import blobs


def ellipse(size, x, y, h, w, theta):
    """(H, W) pixels whose centres lie in the ellipse of full axes h, w."""
    v, u = np.mgrid[: size[0], : size[1]] + 0.5
    along = (u - x) * np.cos(theta) + (v - y) * np.sin(theta)
    across = -(u - x) * np.sin(theta) + (v - y) * np.cos(theta)
    return np.hypot(along / (h / 2), across / (w / 2)) <= 1


@pytest.mark.parametrize("theta", np.radians([-80, -45, -10, 0, 30, 60, 89]))
def test_an_ellipse_is_found_as_it_is(theta):
    found = blobs.find(ellipse((120, 160), 81.3, 57.8, 80, 30, theta), 50)
    np.testing.assert_allclose(found.ellipse[0], [81.3, 57.8, 80, 30, theta], atol=0.25)
    assert found.area[0] == pytest.approx(np.pi * 80 * 30 / 4, rel=0.01)
    lam = np.square([80 / 4, 30 / 4])
    assert found.angle_var[0] == pytest.approx(lam[0] * lam[1] / (found.area[0] * (lam[0] - lam[1]) ** 2), rel=0.05)


def pattern(seed=0, size=(90, 110)):
    """Regions of many shapes."""
    rng = np.random.default_rng(seed)
    return cv2.GaussianBlur(rng.normal(size=size), (0, 0), 3) > 0.03


@pytest.mark.parametrize("seed", range(4))
def test_moments_of_all_equal_a_loop_over_each(seed):
    found = blobs.find(pattern(seed), 20)
    assert len(found) > 5
    assert found.label.dtype == np.int32
    for row in range(len(found)):
        v, u = np.nonzero(found.label == row + 1)
        assert len(u) == found.area[row] >= 20
        assert found.box[row].tolist() == [u.min(), v.min(), np.ptp(u) + 1, np.ptp(v) + 1]
        cov = np.cov(np.stack([u, v]), bias=True) + np.eye(2) / 12
        values, vectors = np.linalg.eigh(cov)
        x, y, h, w, theta = found.ellipse[row]
        np.testing.assert_allclose([x, y], [u.mean() + 0.5, v.mean() + 0.5])
        np.testing.assert_allclose([h, w], 4 * np.sqrt(values[::-1]))
        axis = np.array([np.cos(theta), np.sin(theta)])
        assert abs(axis @ vectors[:, 1]) == pytest.approx(1, abs=1e-6)
        assert -np.pi / 2 < theta <= np.pi / 2
    assert np.all(np.diff(found.area) <= 0)


@pytest.mark.parametrize("size", [(1, 1), (1, 70), (70, 1), (37, 64), (40, 61), (33, 8)])
def test_regions_are_the_slow_way(size):
    """Specks, lines and spirals; widths that eight divides and others; the same from any view of memory."""
    r = np.random.default_rng(size[1])
    for share in (0.0, 0.1, 0.4, 0.6, 0.9, 1.0):
        mask = r.random(size) < share
        for least in (1, 4):
            found = blobs.find(mask, least)
            assert np.array_equal(found.label, slow.regions(mask, least))
            assert np.array_equal(blobs.find(np.asfortranarray(mask), least).label, found.label)
            assert np.array_equal(found.area, np.bincount(found.label.ravel(), minlength=len(found) + 1)[1:])


@pytest.mark.parametrize("mask", [np.zeros((20, 30), bool), np.eye(3, dtype=bool)], ids=["nothing", "too small"])
def test_nothing_to_find(mask):
    found = blobs.find(mask, 100)
    assert len(found) == 0
    assert found.box.shape == (0, 4)
    assert found.ellipse.shape == (0, 5)
    assert not found.label.any()


@pytest.mark.parametrize("turn", [np.fliplr, np.flipud, np.transpose])
def test_a_turned_mask_is_cleaned_alike(turn):
    mask = pattern(7)
    assert np.array_equal(blobs.clean(turn(mask), 40), turn(blobs.clean(mask, 40)))


def test_cleaning_takes_specks_and_fills_holes_by_the_scale():
    rng = np.random.default_rng(8)
    person = ellipse((200, 200), 100, 100, 80, 24, np.pi / 2)
    noisy = person ^ (rng.random(person.shape) < 0.03)
    cleaned = blobs.clean(noisy, 50)
    assert np.mean(cleaned != person) < 0.2 * np.mean(noisy != person)
    split = person.copy()
    split[98:101] = False
    assert len(blobs.find(blobs.clean(split, 50), 50)) == 1
    assert len(blobs.find(split, 50)) == 2
    torn = person.copy()
    torn[90:110] = False
    assert len(blobs.find(blobs.clean(torn, 50), 50)) == 2
