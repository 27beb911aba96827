"""Overlaps of hulls and people inside them: kernels against sim.geometry.polygons, F1 on cases worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.geometry.footprints import footprint_hulls
from sim.geometry.polygons import iou_matrix
from tracking.objective import hull_overlaps_kernels as kernels
from tracking.objective.hull_overlaps import GroupOutlines, count_inside, found_pairs
from tracking.scoring.candidate_pairs import FOUND
from tracking.scoring.group_scores import f1, matched_groups
from tracking.scoring.people_and_groups import bare_groups
from tracking.scoring.rows import FrameRows


def rows(frame):
    return FrameRows(np.asarray(frame, np.int64), np.arange(len(frame)))


def f1_of(true, est):
    return f1(len(matched_groups(true.pos, est.pos, found_pairs(true, est), FOUND).i), len(true), len(est))


@settings(deadline=None)
@given(st.integers(0, 10_000))
def test_overlaps_of_hulls(seed):
    rng = np.random.default_rng(seed)
    count = rng.integers(1, 6, 4)
    hulls = footprint_hulls(rng.normal(0, 0.7, (count.sum(), 2)), count)
    shapes = GroupOutlines.measured(
        rows(np.ones(4)), np.zeros((4, 2)), np.concatenate(hulls), np.cumsum([len(h) for h in hulls])
    )
    assert shapes.regular.all()
    i, j = (g.ravel() for g in np.indices((4, 4)))
    made = kernels.overlaps(shapes.vertex, shapes.ends, shapes.area, shapes.vertex, shapes.ends, shapes.area, i, j)
    assert made.reshape(4, 4) == pytest.approx(iou_matrix(hulls, hulls), abs=1e-9)
    near = kernels.candidates(
        shapes.rows.frame, shapes.box, shapes.area, shapes.rows.frame, shapes.box, shapes.area, 0.5
    )
    found = set(zip(*(rows.tolist() for rows in near), strict=True))
    assert all((a, b) in found for a, b, s in zip(i, j, made, strict=True) if s >= 0.5)


def test_f1_where_overlaps_are_a_half_or_have_rivals():
    """Squares: 0.5 exactly counts; of two partners one is taken."""
    square = np.array([[0.0, 0], [2, 0], [2, 1], [0, 1]])

    def shapes(*polygons):
        n = len(polygons)
        ends = np.cumsum([len(p) for p in polygons])
        return GroupOutlines.measured(
            rows(np.ones(n)), np.array([p.mean(0) for p in polygons]), np.concatenate(polygons), ends
        )

    half = square * [0.5, 1]
    assert f1_of(shapes(square), shapes(half)) == 1
    assert f1_of(shapes(square), shapes(half * [0.99999, 1])) == 0
    assert f1_of(shapes(square), shapes(square * 0.9, square * [0.8, 1])) == pytest.approx(2 / 3)
    assert f1_of(shapes(square, square * 0.9), shapes(square * 0.95, square * 0.8)) == 1
    assert np.isnan(f1_of(shapes(square).until(0), shapes(square).until(0)))


def test_people_inside_are_counted_to_two():
    box = np.array([[0.0, 0], [2, 0], [2, 2], [0, 2]])
    shape = GroupOutlines.measured(rows([1, 2, 3, 4]), np.zeros((4, 2)), np.tile(box, (4, 1)), 4 * np.arange(1, 5))
    place = np.array([[1.0, 1], [2.2, 1], [1, 1], [2.4, 1], [1, 1], [2.3, 1]])
    frame = np.array([1, 1, 2, 2, 3, 3])
    made = kernels.inside(
        frame[[0, 2, 4]], shape.vertex, shape.ends[:3], shape.box, shape.regular, frame, place, 0.3, 1e-7
    )
    assert made.tolist() == [2, 1, -1]
    groups = bare_groups(shape.rows, shape.pos, (box,) * 4)
    place = np.concatenate([place, np.ones((3, 2))])
    assert count_inside(shape, groups, rows([*frame, 4, 4, 4]), place, 1.0).tolist() == [2, 1, 2, 2]
