"""Templates over a mask: kernels against the slow way, support, settling, pruning."""

from __future__ import annotations

import numpy as np
import pytest

from tests import reference_templates as slow
from tests.tracking.papers.blob.test_new_people import mask_of
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob import person_template_search_kernels as search
from tracking.papers.blob.person_look_kernels import POINTS
from tracking.papers.blob.person_template import template_mask
from tracking.papers.blob.person_template_kernels import EXPLAINED

HIGH, WIDE = 90, 120
# A picture and looks for who is placed by the foreground alone.
NO_LOOKS = np.zeros((0, 0, 3), np.uint8), np.zeros((0, POINTS, 5))
NO_LOOKS[0].setflags(write=False)


def bare():
    return np.zeros((HIGH, WIDE), np.int16)


def fitted(foreground, *args):
    return search.fit_places(foreground, bare(), *args)


def somewhere(r, n):
    """(n, 4) templates, some of them reaching out of the image."""
    h = r.uniform(8, 50, n)
    return np.column_stack([r.uniform(-10, WIDE + 10, n), r.uniform(5, HIGH + 20, n), h, h * r.uniform(0.3, 0.8, n)])


def scenery(seed):
    """Foreground with holes, people some of whom stand elsewhere, and pixels that are explained already."""
    r = np.random.default_rng(seed)
    true = somewhere(r, 8)
    foreground = mask_of(*true) & (r.random((HIGH, WIDE)) < 0.9) | (r.random((HIGH, WIDE)) < 0.02)
    cover = np.where(slow.pixels((HIGH, WIDE), *somewhere(r, 1)[0]), EXPLAINED, 0).astype(np.int16)
    expected = np.concatenate([true + np.append(r.normal(0, 3, (8, 2)), np.zeros((8, 2)), 1), somewhere(r, 2)])
    return r, foreground, cover, expected


@pytest.mark.parametrize("seed", range(5))
def test_kernels_are_the_slow_way(seed):
    _, foreground, cover, some = scenery(seed)
    for t in some:
        got = search.worth_when_moved(foreground, cover, t, 2, 1.5)
        assert np.array_equal(got / 2, slow.moved(foreground, cover, t, 2, 1.5))
    area = [slow.area(cover.shape, t) for t in some]
    got = kernels.supports(foreground, cover, some, 0)
    assert np.allclose(got * area, [slow.worth(foreground, cover, t) for t in some], atol=1e-9)
    assert np.array_equal(template_mask((HIGH, WIDE), some), slow.painted((HIGH, WIDE), some) > 0)


@pytest.mark.parametrize("seed", range(4))
def test_all_together_are_the_slow_way(seed):
    r, foreground, cover, expected = scenery(seed)
    painted, spread = cover.copy(), r.uniform(1, 6, (len(expected), 2))
    at = search.fit_places(foreground, painted, expected, spread, 40.0, *NO_LOOKS)
    assert np.array_equal(at, slow.settle(foreground, cover, expected, spread, 40.0))
    assert np.array_equal(painted, cover + slow.painted(cover.shape, at))
    assert np.allclose(kernels.supports(foreground, painted, at, 1), slow.alone(foreground, cover, at), atol=1e-12)
    pieces = kernels.supports(foreground, painted, at, 1, True)
    assert np.allclose(pieces, slow.pieces(foreground, cover, at), atol=1e-12)
    assert np.allclose(kernels.visible_share(painted, at), slow.shown(cover, at), atol=1e-12)
    for by_pieces in (True, False):
        again = painted.copy()
        stays = kernels.prune(foreground, again, at, 0.45, by_pieces)
        assert np.flatnonzero(stays).tolist() == slow.prune(foreground, cover, at, 0.45, by_pieces).tolist()
        assert 0 < stays.sum() < len(at)
        assert np.array_equal(again, cover + slow.painted(cover.shape, at[stays]))


def test_support_is_one_on_ones_own_pixels_and_minus_a_half_on_none():
    one = np.array([[60.0, 80.0, 60.0, 24.0]])
    empty = np.zeros((HIGH, WIDE), np.int16)
    assert kernels.supports(mask_of(one[0]), empty, one, 0)[0] == pytest.approx(1.0, abs=0.02)
    assert kernels.supports(np.zeros((HIGH, WIDE), bool), empty, one, 0)[0] == pytest.approx(-0.5, abs=0.02)


@pytest.mark.parametrize("gap", [14.0, 20.0])
def test_two_in_one_blob_settle_where_they_are(gap):
    true = np.array([[50.0, 80.0, 60.0, 24.0], [50.0 + gap, 76.0, 60.0, 24.0]])
    expected = true + np.array([[3.0, -2.0, 0, 0], [-3.0, 2.0, 0, 0]])
    found = fitted(mask_of(*true), expected, np.full((2, 2), 4.0), 100.0, *NO_LOOKS)
    assert np.abs(found - true).max() <= 1.5


def test_a_post_in_front_keeps_the_template_whole():
    one = np.array([[60.0, 80.0, 60.0, 24.0]])
    cut = mask_of(one[0])
    cut[:, 57:62] = False
    moved = one + np.array([2.0, 1.0, 0, 0])
    found = fitted(cut, moved, np.full((1, 2), 4.0), 20.0, *NO_LOOKS)
    assert np.abs(found - one).max() <= 1.5


def test_a_piece_of_who_is_partly_covered_is_enough_but_two_on_one_are_one():
    """Half hidden behind another template and half of the rest gone; then the same person twice."""
    near, far = np.array([60.0, 84.0, 60.0, 24.0]), np.array([72.0, 80.0, 60.0, 24.0])
    cut = mask_of(near, far)
    cut[:48, 73:] = False
    cover, both = bare(), np.stack([near, far])
    kernels.paint_all(cover, both, 1)
    assert 0.4 < kernels.supports(cut, cover, both, 1, True)[1] < 0.9
    assert kernels.prune(cut, cover, both, 0.3, True).tolist() == [True, True]
    twice = np.stack([near, near + np.array([4.0, 0, 0, 0])])
    cover = bare()
    kernels.paint_all(cover, twice, 1)
    assert kernels.prune(mask_of(near), cover, twice, 0.3, True).tolist() == [True, False]
