"""Kernels that find the nearest of many places in the plane, by a grid of square cells with a list of places each.

The grid covers the places that it is made for, with about one cell for each, so that the nearest one is found in a few
cells. A place may move within this area: it is taken out of its cell and put into another.
"""

from __future__ import annotations

import math

import numpy as np

from sim.compiler import njit
from sim.types import Array, Ints

FEW = 16  # So many places are compared in one cell.
BELOW = 1 - 1e-9  # Keeps rounding of cell numbers from ending a search too early.


@njit(cache=True)
def empty_cells(places: Array, count: int, corner: Array) -> Ints:
    """Returns the cells (R, C) of a grid over the first `count` places (K, 2 or more), all -1: empty.

    Writes corner (3,): least x and y, and the side of a cell.
    """
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for k in range(count):
        low_x, high_x = min(low_x, places[k, 0]), max(high_x, places[k, 0])
        low_y, high_y = min(low_y, places[k, 1]), max(high_y, places[k, 1])
    width, height, columns, rows = high_x - low_x, high_y - low_y, 1, 1
    side = max(math.sqrt(width * height / max(count, 1)), max(width, height) / max(count, 1))
    if count > FEW and side > 0:
        columns, rows = int(width / side) + 1, int(height / side) + 1
    corner[0], corner[1], corner[2] = low_x, low_y, side
    cells = np.empty((rows, columns), np.int64)
    cells[:] = -1
    return cells


@njit(cache=True)
def cell_of(places: Array, k: int, corner: Array, cells: Ints) -> tuple[int, int]:
    """Returns row and column of the cell of place k."""
    rows, columns = cells.shape
    if rows * columns == 1:
        return 0, 0
    row, column = (places[k, 1] - corner[1]) / corner[2], (places[k, 0] - corner[0]) / corner[2]
    return int(min(max(row, 0.0), rows - 1.0)), int(min(max(column, 0.0), columns - 1.0))


@njit(cache=True)
def put(places: Array, k: int, corner: Array, cells: Ints, after: Ints) -> None:
    """Adds place k to its cell; after (K,): the next place of each in its cell, -1: none."""
    row, column = cell_of(places, k, corner, cells)
    after[k], cells[row, column] = cells[row, column], k


@njit(cache=True)
def take(places: Array, k: int, corner: Array, cells: Ints, after: Ints) -> None:
    """Removes place k from its cell."""
    row, column = cell_of(places, k, corner, cells)
    other = cells[row, column]
    if other == k:
        cells[row, column] = after[k]
        return
    while after[other] != k:
        other = after[other]
    after[other] = after[k]


@njit(cache=True)
def nearest(places: Array, own: int, corner: Array, cells: Ints, after: Ints) -> int:
    """Returns the place in the cells that is nearest to place `own`, other than itself; the first of equal ones, -1 if
    there is none."""
    rows, columns = cells.shape
    row, column = cell_of(places, own, corner, cells)
    best, least, ring = -1, np.inf, 0
    while ring < max(rows, columns) and least >= BELOW * (max(ring - 1, 0) * corner[2]) ** 2:
        for r in range(max(row - ring, 0), min(row + ring + 1, rows)):
            step = 1 if abs(r - row) == ring else max(2 * ring, 1)
            for c in range(column - ring, column + ring + 1, step):
                other = cells[r, c] if 0 <= c < columns else -1
                while other >= 0:
                    dx, dy = places[other, 0] - places[own, 0], places[other, 1] - places[own, 1]
                    far = dx * dx + dy * dy
                    if other != own and (far < least or (far == least and other < best)):
                        best, least = other, far
                    other = after[other]
        ring += 1
    return best
