"""Pieces of one person from pixels: their union has the moments of all their pixels."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.detect import blobs
from tracking.papers.blob import update_from_pixels


@pytest.mark.parametrize("seed", range(4))
def test_the_union_of_pieces_is_the_blob_of_their_pixels(seed):
    r = np.random.default_rng(seed)
    mask = np.zeros((80, 90), bool)
    for k in range(3):
        top, left, high, wide = 25 * k + 2, *r.integers(4, 30, 1), *r.integers(8, 20, 2)
        mask[top : top + high, left : left + wide] = True
    pieces = blobs.find(mask, 1)
    assert len(pieces) == 3
    found, var = update_from_pixels.union(pieces.area, pieces.ellipse)
    v, u = np.nonzero(mask)
    at = np.stack([u, v], 1) + 0.5
    n, cov = np.array([float(len(at))]), np.cov(at.T, bias=True)[None] + np.eye(2) / 12
    expected, expected_var = blobs.ellipses(n, at.mean(0)[None], cov)
    assert found == pytest.approx(expected[0])
    assert var == pytest.approx(expected_var[0])


def test_a_piece_belongs_to_the_nearest_track_that_holds_it():
    boxes = np.array([[100.0, 100, 60, 20], [104, 100, 60, 20], [300, 100, 60, 20]])
    centre = np.array([[102.0, 90], [300, 120], [200, 100], [101, 100]])
    d2 = np.array([[30.0, 9, 9, 1], [20, 9, 9, 2], [99, 50, 9, 9]])
    free = np.array([True, True, True, False])
    assert update_from_pixels.owners(centre, boxes, d2, free).tolist() == [1, 2, -1, -1]
    assert update_from_pixels.owners(centre, boxes[:0], d2[:0], free).tolist() == [-1] * 4
