"""Outlines of derived groups: hulls and connected people against the exact functions of sim and tracking.grouping."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.geometry.footprints import footprint_hulls
from sim.geometry.polygons import convex_hull, iou_matrix
from tracking.grouping.group_labels import label_people
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.grouping.merge_split_events import TrackedMotion
from tracking.objective import derived_outlines_kernels as kernels
from tracking.objective.derived_outlines import flat_convex_hulls, flat_footprint_hulls
from tracking.objective.hull_overlaps import FLAT
from tracking.objective.hull_overlaps_kernels import measure


@settings(deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_footprints(seed, whole):
    """Also of people who stand on a line, on each other, or alone."""
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 6, 5)
    pos = rng.integers(-2, 3, (count.sum(), 2)).astype(float) if whole else rng.normal(0, 1, (count.sum(), 2))
    vertex, ends = flat_footprint_hulls(pos, np.cumsum(count), 1.0)
    made = [vertex[a:b] for a, b in pairwise([0, *ends])]
    area, _, regular = measure(vertex, ends, FLAT)
    assert regular.all()
    for mine, twin, own in zip(made, footprint_hulls(pos, count), area, strict=True):
        assert iou_matrix([mine], [twin])[0, 0] == pytest.approx(1, abs=1e-9)
        assert own == pytest.approx(measure(twin, np.array([len(twin)]), FLAT)[0][0], abs=1e-9)


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_hulls_of_points(seed):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, (rng.integers(1, 12), 2)).astype(float)
    vertex, ends = kernels.minkowski_sums(*flat_convex_hulls(points, np.array([len(points)])), np.zeros((1, 2)))
    assert {tuple(p) for p in vertex.tolist()} == {tuple(p) for p in convex_hull(points).tolist()}
    assert ends.tolist() == [len(vertex)]


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_partitions_are_those_of_the_rule(seed):
    """Who is with whom in each frame, names apart; people come, go, and are not seen for a while."""
    rng = np.random.default_rng(seed)
    length, people = 40, 7
    walk = np.cumsum(rng.normal(0, 0.12, (length, people, 2)), 0) + rng.uniform(0, 3, (people, 2))
    seen = rng.random((length, people)) < 0.8
    frame, column = np.nonzero(seen)
    pos, rule, fps = walk[frame, column], LinkRule(window=0.6, patience=0.4, acquaintance=0.2, memory=0.3), 10.0
    links = find_links(frame, column, pos, np.zeros_like(pos), length, fps, rule)
    places = np.where(seen[..., None], walk, np.nan)
    expected = label_people(frame, column, TrackedMotion(places, np.zeros_like(places), fps), links, rule)[0]
    made = kernels.connected_people(frame, column, length, people, 3, links.frame, links.a, links.b, links.on)
    for t in range(length):
        here = frame == t
        assert together(column[here], made[here]) == together(column[here], expected[here])


def together(who, label):
    return {frozenset(who[label == g].tolist()) for g in set(label[label >= 0].tolist())}
