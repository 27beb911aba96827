"""Kernels of cell lists: which of N places in the plane are near a point, without a look at all of them.

A grid of square cells covers most of the places. It is a tuple: x and y of its corner, width of a cell, numbers of
columns and rows. Places beyond the grid are in its border cells, so that one far away costs nothing. A list is a tuple
of `first` (C,), the first place of each cell, `after` (N,), the next one in the cell of each place, -1 being the end,
and the grid.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints

FEW = 24
"""Up to so many places a look at all of them costs less than a list."""
COVERED = 3.0
"""The grid reaches so many mean deviations to each side of the mean place."""
MOST_RINGS = 8
"""`nearest_place` looks at all places if none is found so many cells away."""


@njit(cache=True)
def grid_of(places: Array, count: int) -> tuple[float, float, float, int, int]:
    """Returns the grid of `count` places (N, 2 or more), with about one place in a cell."""
    # mean deviations instead of bounds, so that one far place does not make all cells large
    x, y, wide, high = 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        x += places[k, 0] / count
        y += places[k, 1] / count
    for k in range(count):
        wide += abs(places[k, 0] - x) / count
        high += abs(places[k, 1] - y) / count
    # the two other terms bound the number of cells where the places lie on a line, or on one point
    size = max(4 * math.sqrt(wide * high / count), 4 * max(wide, high) / count, 1e-3)
    columns, rows = int(2 * COVERED * wide / size) + 1, int(2 * COVERED * high / size) + 1
    return x - COVERED * wide, y - COVERED * high, size, columns, rows


@njit(cache=True)
def _column(x: float, grid: Any) -> int:
    return int(min(max((x - grid[0]) / grid[2], 0.0), grid[3] - 1.0))


@njit(cache=True)
def _row(y: float, grid: Any) -> int:
    return int(min(max((y - grid[1]) / grid[2], 0.0), grid[4] - 1.0))


@njit(cache=True)
def empty_list(count: int, grid: Any) -> Any:
    """Returns a list without places, with room for `count` of them."""
    first, after = np.empty(grid[3] * grid[4], np.int64), np.empty(count, np.int64)
    for c in range(len(first)):
        first[c] = -1
    for k in range(count):
        after[k] = -1
    return first, after, grid


@njit(cache=True)
def insert(k: int, x: float, y: float, cells: Any) -> None:
    """Add place k at x, y to a list."""
    first, after, grid = cells
    c = _column(x, grid) * grid[4] + _row(y, grid)
    after[k], first[c] = first[c], k


@njit(cache=True)
def nearest_place(places: Array, k: int, cells: Any) -> int:
    """Returns the listed place nearest to place k, of equal ones the first; -1 without another one."""
    first, after, grid = cells
    middle, level = _column(places[k, 0], grid), _row(places[k, 1], grid)
    best, least = -1, np.inf
    for ring in range(min(MOST_RINGS, max(grid[3], grid[4])) + 1):
        for column in range(max(middle - ring, 0), min(middle + ring, grid[3] - 1) + 1):
            whole = abs(column - middle) == ring  # of the other columns all but the ends has been looked at
            for row in range(level - ring, level + ring + 1, 1 if whole else 2 * ring):
                if 0 <= row < grid[4]:
                    best, least = _nearer(places, k, first[column * grid[4] + row], after, best, least)
        if least < (ring * grid[2]) ** 2:  # what was not looked at is farther away
            return best
    for c in range(len(first)):
        best, least = _nearer(places, k, first[c], after, best, least)
    return best


@njit(cache=True)
def _nearer(places, k, at, after, best, least):  # type: ignore[no-untyped-def]
    """Returns the nearest place and its squared distance after a look at a cell, whose first place is `at`."""
    while at >= 0:
        far = (places[at, 0] - places[k, 0]) ** 2 + (places[at, 1] - places[k, 1]) ** 2
        if at != k and (far < least or (far == least and at < best)):
            best, least = at, far
        at = after[at]
    return best, least


@njit(cache=True)
def nearest_places(places: Array, count: int, nearest: Ints) -> None:
    """Writes the nearest other one of `count` places to each, of equal ones the first; -1 without."""
    if count <= FEW:
        for k in range(count):
            nearest[k], least = -1, np.inf
            for other in range(count):
                far = (places[other, 0] - places[k, 0]) ** 2 + (places[other, 1] - places[k, 1]) ** 2
                if other != k and far < least:
                    nearest[k], least = other, far
        return
    cells = empty_list(count, grid_of(places, count))
    for k in range(count):
        insert(k, places[k, 0], places[k, 1], cells)
    for k in range(count):
        nearest[k] = nearest_place(places, k, cells)
