"""The nearest of many places, by a grid, is that of a look at all of them."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Array
from tracking.filters.nearest_kernels import empty_cells, nearest, put, take


def nearest_of_all(places: Array, own: int, kept: list[int]) -> int:
    others = [k for k in kept if k != own]
    away = [np.square(places[k] - places[own]).sum() for k in others]
    return others[int(np.argmin(away))] if others else -1


@pytest.mark.parametrize("count", [0, 1, 2, 16, 17, 60])
@pytest.mark.parametrize("shape", ["scattered", "on a line", "in one place", "rounded", "one far away"])
def test_nearest_is_that_of_all(count: int, shape: str) -> None:
    r = np.random.default_rng(count)
    places = r.uniform(-5, 5, (count, 2))
    if shape == "on a line":
        places[:, 1] = 2.0
    elif shape == "in one place":
        places[:] = 1.0
    elif shape == "rounded":  # many are equally near
        places = np.round(places)
    elif count:
        places[0] = 1e6 if shape == "one far away" else 0.0
    corner, after = np.empty(3), np.empty(count, np.int64)
    cells = empty_cells(places, count, corner)
    assert cells.size <= 3 * count + 1
    for k in range(count):
        put(places, k, corner, cells, after)
    kept = list(range(count))
    for gone in r.permutation(count)[: count // 2].tolist():
        assert [nearest(places, k, corner, cells, after) for k in kept] == [
            nearest_of_all(places, k, kept) for k in kept
        ]
        take(places, gone, corner, cells, after)
        kept.remove(gone)
        moved = kept[0]
        take(places, moved, corner, cells, after)
        places[moved] = (places[moved] + places[gone]) / 2
        put(places, moved, corner, cells, after)
