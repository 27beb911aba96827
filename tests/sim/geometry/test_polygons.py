"""Polygons: overlap, hulls, gaps; beside dense rasters, samples and scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from sim.geometry import polygons
from sim.geometry.hull_kernels import convex_hull, convex_hulls
from tests.reference_polygons import area, contains, footprint_hull, iou_matrix, polygon_gap

SQUARE = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])


def random_hulls(seed, n, spread=3.0):
    r = np.random.default_rng(seed)
    return [convex_hull(r.uniform(0, spread, (r.integers(3, 20), 2)) + r.uniform(-1, 1, 2)) for _ in range(n)]


def raster_iou(a, b, step=0.01):
    x = np.arange(-1.5, 4.5, step) + step / 2
    grid = np.stack(np.meshgrid(x, x), -1).reshape(-1, 2)
    inside = [np.ones(len(grid), bool) for _ in (a, b)]
    for mask, hull in zip(inside, (a, b), strict=True):
        for p, q in zip(hull, np.roll(hull, -1, axis=0), strict=True):
            mask &= (q - p)[0] * (grid - p)[:, 1] - (q - p)[1] * (grid - p)[:, 0] >= 0
    return (inside[0] & inside[1]).sum() / (inside[0] | inside[1]).sum()


def test_overlap_is_that_of_a_dense_raster():
    some = random_hulls(1, 24)
    got = iou_matrix(some[:12], some[12:])
    for k in range(12):
        assert got[k, k] == pytest.approx(raster_iou(some[k], some[12 + k]), abs=5e-3)
    assert (got > 0.05).sum() > 20


SQUARES = [
    ((0.5, 0), 0.5), ((0.5, 0.5), 0.25), ((0, 0), 1), ((1, 0), 0), ((0, -1), 0), ((1, 1), 0), ((3, 0), 0),
    ((1e-12, 0), 1),
]  # fmt: skip


@pytest.mark.parametrize(("moved", "common"), SQUARES)
def test_squares(moved, common):
    zero = np.zeros(1, np.int64)
    a, b = polygons.pack([SQUARE]), polygons.pack([SQUARE + np.array(moved)])
    assert polygons.intersection_pairs(a, b, zero, zero)[0] == pytest.approx(common, abs=1e-9)
    assert polygons.iou_pairs(a, b, zero, zero)[0] == pytest.approx(common / (2 - common), abs=1e-9)


def test_no_area_no_overlap():
    none = np.zeros((0, 2))
    assert iou_matrix([none, SQUARE[:1], SQUARE[:2]], [SQUARE, none]).tolist() == [[0, 0]] * 3
    assert iou_matrix([], [SQUARE]).shape == (0, 1)
    assert np.isnan(polygons.gap_pairs(polygons.pack([none]), polygons.pack([SQUARE]), *np.zeros((2, 1), np.int64)))


def test_hull_of_points():
    for seed in range(50):
        points = np.random.default_rng(seed).normal(size=(12, 2))
        hull = convex_hull(points)
        assert area(hull) == pytest.approx(ConvexHull(points).volume)
        assert len(hull) == len(ConvexHull(points).vertices)
    assert convex_hull(np.array([[0, 0], [1, 1], [2, 2], [1, 1.0]])).tolist() == [[0, 0], [2, 2]]
    assert convex_hull(np.zeros((3, 2))).tolist() == [[0, 0]]
    assert convex_hull(np.zeros((0, 2))).shape == (0, 2)


def places_of(kind, r):
    places = r.uniform(0, 2, (r.integers(1, 7), 2))
    if kind == "grid":
        return np.round(2 * places) / 2
    if kind == "row":
        return places * [1, 0]
    if kind == "along an edge":
        return np.outer(places[:, 0], polygons.FOOTPRINT[4] - polygons.FOOTPRINT[3]) / 0.1
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
            convex_hull((places[:, None] + polygons.FOOTPRINT).reshape(-1, 2)),
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
    for hull, own in zip(polygons.footprint_hulls(places, count), np.split(places, np.cumsum(count)[:-1]), strict=True):
        np.testing.assert_array_equal(hull, footprint_hull(own))


@pytest.mark.parametrize(
    ("moved", "gap"), [((3, 0), 2), ((2, 2), 2**0.5), ((0.5, 0.5), 0), ((0.2, 0), 0), ((0, 1.25), 0.25)]
)
def test_gap(moved, gap):
    assert polygon_gap(SQUARE, SQUARE + np.array(moved)) == pytest.approx(gap, abs=1e-12)


def test_gap_of_one_inside_another_and_against_samples():
    assert polygon_gap(SQUARE, SQUARE * 0.2 + 0.4) == 0
    some = random_hulls(6, 20, spread=1.0)
    shifted = [h + np.random.default_rng(k).uniform(-3, 3, 2) for k, h in enumerate(some)]
    for a, b in zip(some, reversed(shifted), strict=True):
        s = np.linspace(0, 1, 200)[:, None]
        rims = [np.concatenate([p + s * (q - p) for p, q in zip(h, np.roll(h, -1, 0), strict=True)]) for h in (a, b)]
        sampled = np.hypot(*np.moveaxis(rims[0][:, None] - rims[1], -1, 0)).min()
        overlap = iou_matrix([a], [b])[0, 0] > 0
        assert polygon_gap(a, b) == pytest.approx(0 if overlap else sampled, abs=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_hulls_are_those_of_each_set_by_itself(seed: int) -> None:
    r = np.random.default_rng(seed)
    sets = [r.integers(0, 6, (int(r.integers(0, 12)), 2)).astype(float) for _ in range(30)]
    for points, found in zip(sets, convex_hulls(sets), strict=True):
        if len(np.unique(points, axis=0)) == len(points):
            np.testing.assert_array_equal(found, convex_hull(points))


def test_points_lines_and_nothing() -> None:
    point, line = np.array([[2.0, 1.0]]), np.array([[0.0, 0.0], [2.0, 2.0], [1.0, 1.0]])
    nothing, unknown = np.zeros((0, 2)), np.array([[0.0, 0.0], [np.nan, 1.0], [1.0, 0.0]])
    found = convex_hulls([point, nothing, line, unknown])
    assert [f.tolist() for f in found] == [[[2.0, 1.0]], [], [[0.0, 0.0], [2.0, 2.0]], []]
    assert convex_hulls([]) == ()
    assert [len(f) for f in convex_hulls([nothing, nothing])] == [0, 0]
