"""Hulls, means and extents of labelled groups."""

import numpy as np
import pytest

from sim.geometry.polygons import footprint_hull
from sim.truth.group_hulls import box_groups, frame_groups, groups_over_time


def test_groups_of_a_frame():
    id, group = np.array([9, 4, 7, 5, 8]), np.array([2, 1, 2, -1, 3])
    pos, vel = np.array([[0.0, 0], [5, 5], [1, 0], [9, 9], [3, 3]]), np.arange(10.0).reshape(5, 2)
    g = frame_groups(id, group, pos, vel)
    assert g.id.tolist() == [2], "groups of one are none"
    assert [m.tolist() for m in g.members] == [[7, 9]]
    assert (g.pos.tolist(), g.vel.tolist(), g.size.tolist()) == ([[0.5, 0]], [[2, 3]], [2])
    assert g.extent.tolist() == [[[0.25, 0], [0, 0]]]
    np.testing.assert_allclose(g.hull[0], footprint_hull(pos[[0, 2]]))


def test_groups_over_time_are_those_of_each_frame():
    r = np.random.default_rng(1)
    frame = np.sort(r.integers(2, 9, 60))
    frame = frame[frame != 5]
    id = np.arange(len(frame))
    group, pos, vel = r.integers(-1, 3, len(frame)), r.normal(size=(len(frame), 2)), r.normal(size=(len(frame), 2))
    many = groups_over_time(frame, id, group, pos, vel, 1, 10)
    for t, g in enumerate(many, start=1):
        one = frame_groups(*(x[frame == t] for x in (id, group, pos, vel)))
        assert g.id.tolist() == one.id.tolist()
        assert [m.tolist() for m in g.members] == [m.tolist() for m in one.members]
        for name in ("pos", "vel", "extent", "size"):
            np.testing.assert_allclose(getattr(g, name), getattr(one, name))
        assert all(np.array_equal(a, b) for a, b in zip(g.hull, one.hull, strict=True))


def test_groups_in_the_image():
    frame, id, group = np.zeros(3, np.int64), np.array([1, 2, 3]), np.array([1, 1, -1])
    pos = np.array([[10.0, 10], [30, 10], [90, 90]])
    box = np.array([[5.0, 0, 10, 20], [25, 0, 10, 20], [85, 80, 10, 20]])
    (g,) = box_groups(frame, id, group, pos, pos * 0, box, 0, 1)
    assert g.hull[0].tolist() == [[5, 0], [35, 0], [35, 20], [5, 20]]
    (g,) = groups_over_time(frame, id, group, pos, pos * 0, 0, 1, px_per_m=20.0)
    assert g.hull[0][:, 0].min() == pytest.approx(5)
    assert g.pos.tolist() == [[20, 10]]
