"""Newcomers: guesses and their choice against the slow way; how many came in together."""

from __future__ import annotations

import numpy as np
import pytest

from tests import reference_templates as slow
from tracking.detect import blobs
from tracking.papers.blob import person_template
from tracking.papers.blob.person_template_kernels import EXPLAINED

HIGH, WIDE = 90, 120


def mask_of(*templates):
    """(H, W) foreground of ellipses."""
    return np.any([slow.pixels((HIGH, WIDE), *t) for t in templates], 0)


class Fixed:
    """People are of one size everywhere."""

    above = False

    def __init__(self, h, w):
        self.size = h, w

    def at(self, foot):
        return np.tile(np.array(self.size, float), (len(foot), 1))


def region(seed):
    """A region of one to four people who overlap, with holes."""
    r = np.random.default_rng(seed)
    first = np.array([r.uniform(20, 60), r.uniform(50, 88), r.uniform(24, 48), 0])
    first[3] = first[2] * 0.4
    step = np.array([0.7 * first[3], 0, 0, 0])
    people = first + np.arange(r.integers(1, 5))[:, None] * step + np.append(r.normal(0, 2, 2), [0, 0])
    return mask_of(*people) & (r.random((HIGH, WIDE)) < 0.95), first[2:]


@pytest.mark.parametrize("seed", range(6))
def test_guesses_are_the_slow_way(seed):
    mask, (h, w) = region(seed)
    found = blobs.find(mask, 20)
    got = person_template._guesses(found, 0, 6, Fixed(h, w))
    assert np.array_equal(got, np.concatenate(slow.guesses(found.label == 1, 6, Fixed(h, w))))


@pytest.mark.parametrize("seed", range(4))
def test_who_enters_is_the_slow_way(seed):
    mask, (h, w) = region(seed)
    guesses = slow.guesses(blobs.find(mask, 20).label == 1, 4, Fixed(h, w))
    cover, person = np.zeros(mask.shape, np.int16), float(np.pi / 4 * h * w)
    got = person_template._in_region(mask, cover.copy(), np.concatenate(guesses), person, 0.4)
    assert len(got)
    assert np.array_equal(got, slow.enter(mask, cover, guesses, person, 0.4))


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_as_many_come_in_as_there_are(count):
    """Side by side, a head's width of each hidden behind the next."""
    true = np.array([[20.0 + 20 * k, 80.0 - 2 * (k % 2), 60.0, 24.0] for k in range(count)])
    cover = np.zeros((HIGH, WIDE), np.int16)
    found = person_template.find_new_people(mask_of(*true), cover, Fixed(60.0, 24.0), 0.5)
    assert np.array_equal(cover, slow.painted(cover.shape, found))
    assert len(found) == count
    assert np.abs(np.sort(found[:, 0]) - true[:, 0]).max() < 4


def test_what_is_explained_brings_nobody():
    one = np.array([[60.0, 80.0, 60.0, 24.0]])
    for explained in (1, EXPLAINED):
        cover = slow.painted((HIGH, WIDE), one).astype(np.int16) * np.int16(explained)
        assert not len(person_template.find_new_people(mask_of(one[0]), cover, Fixed(60.0, 24.0), 0.5))


def test_people_are_of_the_size_that_they_have_where_they_stand():
    class Leaning:
        above = False

        def at(self, foot):
            h = np.where(foot[:, 0] < 50, 80.0, 30.0)
            return np.stack([h, 0.4 * h], axis=1)

    cover = np.zeros((HIGH, WIDE), np.int16)
    found = person_template.find_new_people(mask_of([100.0, 70.0, 30.0, 12.0]), cover, Leaning(), 0.5)
    np.testing.assert_allclose(found, [[100, 70, 30, 12]], atol=2)
