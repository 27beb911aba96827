"""Hulls of footprints, beside convex hulls of all corners."""

from __future__ import annotations

import numpy as np
import pytest

from sim.geometry.polygons import convex_hull
from sim.truth.group_hulls import FOOTPRINT, footprint_hulls
from tests.reference_polygons import area, contains, footprint_hull


def places_of(kind, r):
    places = r.uniform(0, 2, (r.integers(1, 7), 2))
    if kind == "grid":
        return np.round(2 * places) / 2
    if kind == "row":
        return places * [1, 0]
    if kind == "along an edge":
        return np.outer(places[:, 0], FOOTPRINT[4] - FOOTPRINT[3]) / 0.1
    if kind == "one place":
        return np.repeat(places[:1], len(places), axis=0)
    return places


@pytest.mark.parametrize("kind", ["anywhere", "grid", "row", "along an edge", "one place"])
def test_footprint_hull_is_the_hull_of_all_footprints(kind):
    r = np.random.default_rng(4)
    for _ in range(200):
        places = places_of(kind, r)
        hull, slow = (
            footprint_hull(places),
            convex_hull((places[:, None] + FOOTPRINT).reshape(-1, 2)),
        )
        assert area(hull) == pytest.approx(area(slow), abs=1e-9)
        edge = np.roll(hull, -1, axis=0) - hull
        after = np.roll(edge, -1, axis=0)
        assert (edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] > 0).all(), "strictly convex, counter-clockwise"
        assert contains(hull, places).all()


def test_footprints_of_many_groups_at_once():
    r = np.random.default_rng(5)
    count = np.array([2, 1, 3, 2, 5])
    places = r.uniform(0, 4, (count.sum(), 2))
    for hull, own in zip(footprint_hulls(places, count), np.split(places, np.cumsum(count)[:-1]), strict=True):
        np.testing.assert_array_equal(hull, footprint_hull(own))
