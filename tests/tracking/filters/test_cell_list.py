"""Cell lists: what they find is what a look at all places finds, and they look at few."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.filters import cell_list_kernels as cells


def scenes():
    """Crowds; people on a line, at one place, on a lattice with many equal distances, and with one far away."""
    draws = np.random.default_rng(0)
    yield draws.uniform(0, 60, (300, 2))
    yield draws.normal(0, 1, (50, 2))
    yield np.column_stack([draws.uniform(0, 100, 80), np.zeros(80)])
    yield np.zeros((30, 2))
    yield np.stack(np.meshgrid(np.arange(9.0), np.arange(9.0)), axis=-1).reshape(-1, 2)
    yield np.concatenate([draws.uniform(0, 20, (100, 2)), [[1e5, -1e5]]])
    yield draws.uniform(0, 5, (cells.FEW, 2))
    yield np.zeros((1, 2))


@pytest.mark.parametrize("places", list(scenes()))
def test_the_nearest_place_is_that_of_a_look_at_all(places):
    found = np.empty(len(places), np.int64)
    cells.nearest_places(places, len(places), found)
    square = np.square(places[:, None] - places).sum(axis=2)
    np.fill_diagonal(square, np.inf)
    expected = square.argmin(axis=1) if len(places) > 1 else [-1]
    assert found.tolist() == list(expected)


@pytest.mark.parametrize("places", list(scenes()))
@pytest.mark.parametrize("reach", [0.0, 1.0, 7.0, 1e6])
def test_all_places_within_reach_are_listed_once(places, reach):
    made, out = cells.cell_list(places, len(places)), np.empty(len(places), np.int64)
    for x, y in (*places[:40], (3.3, 900.0)):
        listed = out[: cells.listed_near(x, y, reach, made, out)].tolist()
        assert len(set(listed)) == len(listed)
        assert set(np.flatnonzero(np.hypot(*(places - (x, y)).T) <= reach)) <= set(listed)


def test_places_that_are_taken_out_are_found_no_more():
    places = np.random.default_rng(1).uniform(0, 10, (60, 2))
    made = cells.empty_list(60, cells.grid_of(places, 60))
    for k, (x, y) in enumerate(places):
        cells.insert(k, x, y, made)
    for k in range(1, 59):
        cells.remove(k, *places[k], made)
    assert cells.nearest_place(places, 0, made) == 59
    cells.remove(59, *places[59], made)
    assert cells.nearest_place(places, 0, made) == -1
