"""Looks: kernels against the slow way; who is whom in a shared blob; what is hidden is not learned."""

from __future__ import annotations

import numpy as np
import pytest

from tests import reference_templates as slow
from tests.tracking.papers.blob.test_person_template import HIGH, NO_LOOKS, WIDE, fitted, scenery
from tracking.papers.blob import person_look_kernels as looks

RED, BLUE, GREY = (30, 30, 200), (200, 30, 30), (120, 120, 120)


def picture(*people):
    """A grey picture of ellipses in one colour each; the last one is in front."""
    image = np.full((HIGH, WIDE, 3), GREY, np.uint8)
    for template, colour in people:
        image[slow.pixels((HIGH, WIDE), *template)] = colour
    image.setflags(write=False)
    return image


def learned(*people, times=5):
    """The looks of people who were seen alone."""
    found = looks.unknown(len(people))
    for k, (template, colour) in enumerate(people):
        for _ in range(times):
            image = picture((template, colour))
            looks.learn(image, np.array([template]), found[k : k + 1], np.array([0]), 0.1)
    return found


@pytest.mark.parametrize("seed", range(5))
def test_fits_are_the_slow_way(seed):
    r, _, cover, some = scenery(seed)
    some[1] = some[0] + [4.0, 0, 0, 0]  # equal feet: the first one hides
    image = r.integers(0, 256, (HIGH, WIDE, 3)).astype(np.uint8)
    seen = np.arange(looks.POINTS) % 6
    look = np.column_stack([r.uniform(0, 255, (looks.POINTS, 3)), r.uniform(50, 9000, looks.POINTS), seen])
    image.setflags(write=False)
    for k in range(len(some)):
        got = looks.look_fits(image, cover, some, k, look, 2, 1.5)
        assert np.allclose(got, slow.fits(image, cover, some, k, look, 2, 1.5), atol=1e-9)


def test_fits_of_pairs_are_the_slow_way():
    r, _, cover, some = scenery(3)
    image = r.integers(0, 256, (HIGH, WIDE, 3)).astype(np.uint8)
    image.setflags(write=False)
    seen = np.full((2, looks.POINTS, 1), 9.0)
    look = np.concatenate([r.uniform(0, 255, (2, looks.POINTS, 3)), r.uniform(50, 9000, seen.shape), seen], 2)
    rows, columns = np.array([1, 0, 1]), np.array([0, len(some) - 1, 1])
    got = looks.pair_fits(image, some, look, rows, columns)
    known = [slow.fits(image, 0 * cover, some, j, look[i], 0, 1.0)[0, 0] for i, j in zip(rows, columns, strict=True)]
    assert got == pytest.approx(np.array(known), abs=1e-9)


def test_what_is_learned_is_mean_and_variance_of_what_is_not_hidden():
    near, far = np.array([60.0, 84.0, 60.0, 24.0]), np.array([70.0, 80.0, 60.0, 24.0])
    both, found = np.stack([near, far]), looks.unknown(2)
    images = np.random.default_rng(0).integers(0, 256, (400, HIGH, WIDE, 3)).astype(np.uint8)
    images.setflags(write=False)
    for image in images:
        looks.learn(image, both, found, np.array([1]), 0.0)
    assert np.array_equal(found[0], looks.unknown(1)[0])
    row, column = slow.seen_at(np.zeros((HIGH, WIDE), int), both, 1, far)
    open_points = row >= 0
    assert 5 < open_points.sum() < looks.POINTS - 5
    assert np.array_equal(found[1, :, looks.SEEN], 400 * open_points)
    colours = images[:, row[open_points], column[open_points]].astype(float)
    assert np.allclose(found[1, open_points, :3], colours.mean(0), atol=1e-9)
    assert np.allclose(found[1, open_points, looks.VAR], colours.var(0).mean(1), rtol=0.03)


def test_looks_follow_the_last_pictures():
    one, found = np.array([[60.0, 80.0, 60.0, 24.0]]), looks.unknown(1)
    for colour in [RED] * 100 + [BLUE] * 30:
        looks.learn(picture((one[0], colour)), one, found, np.array([0]), 0.1)
    assert np.abs(found[0, :, :3] - BLUE).max() < 10


def test_looks_tell_who_is_whom_in_a_shared_blob():
    red, blue = np.array([52.0, 80.0, 60.0, 24.0]), np.array([64.0, 79.0, 60.0, 24.0])
    image = picture((blue, BLUE), (red, RED))
    mask = (image != GREY).any(2)
    expected, spread = np.stack([blue, red]) - [1.0, 0, 0, 0], np.full((2, 2), 6.0)
    known = learned((red, RED), (blue, BLUE))
    swapped = fitted(mask, expected, spread, 10.0, *NO_LOOKS)
    right = fitted(mask, expected, spread, 10.0, image, known)
    assert swapped[0, 0] > swapped[1, 0]
    assert np.abs(right - np.stack([red, blue])).max() <= 2.5


def test_people_without_a_look_are_placed_by_the_foreground_alone():
    _, foreground, _, expected = scenery(0)
    image, spread = picture(), np.full((len(expected), 2), 4.0)
    plain = fitted(foreground, expected, spread, 10.0, *NO_LOOKS)
    unknown = looks.unknown(len(expected))
    assert np.array_equal(fitted(foreground, expected, spread, 10.0, image, unknown), plain)


def test_people_who_touch_nobody_are_placed_by_the_foreground_alone():
    apart, spread = np.array([[20.0, 80.0, 40.0, 16.0], [90.0, 80.0, 40.0, 16.0]]), np.full((2, 2), 4.0)
    aside = apart + np.array([4.0, 0, 0, 0])
    image = picture((aside[0], RED), (aside[1], BLUE))
    mask = (picture((apart[0], RED), (apart[1], BLUE)) != GREY).any(2)
    known = learned((apart[0], RED), (apart[1], BLUE))
    assert np.array_equal(fitted(mask, apart, spread, 10.0, image, known), apart)
