"""Rows of the replay page: outlines of groups as wholes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sim.geometry.hull_kernels import convex_hull
from tests.reference_polygons import area, footprint_hull
from tracking.app.replay_page import page_rows


@given(st.lists(st.tuples(st.floats(0, 8), st.floats(0, 8)), min_size=1, max_size=9))
def test_thinned_hulls_are_nearly_the_same(places: list[tuple[float, float]]) -> None:
    """Never outside, no more than two steps of tolerance inside, in their order."""
    hull = footprint_hull(np.array(places))
    less = page_rows.simplified(hull, 0.02)
    assert len(less) <= page_rows.MAX_CORNERS
    assert {tuple(p) for p in less} <= {tuple(p) for p in hull}
    np.testing.assert_allclose(area(less), area(convex_hull(less)), rtol=1e-9)
    edge = np.roll(less, -1, axis=0) - less
    normal = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
    beyond = ((hull[:, None] - less[None]) * normal[None]).sum(axis=2).max(axis=1)
    assert beyond.max() <= 0.0401
