"""Finds lines of people who stand behind one another, each in one moment: the shape of a queue.

People of one moment who stand close to each other form a crowd. A line is an ordered set of people of a crowd for which
three tests hold along the straight line that fits them best: neighbours are 0.4 to 1.5 m apart (MIN_SPACING,
MAX_SPACING), nobody is more than 0.5 m (MAX_OFFSET) off the straight line, and the direction from one person to the
next turns by at most 60°. A circle of people in conversation can pass the first two tests, but not the third.

All moments are handled at once. Tables of positions (M, n, 2) hold M ordered sets; only the first `count` (M,)
positions of each set count.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.elementary import atan2, length, unit
from sim.types import Array, Bools, Ints

MIN_SPACING, MAX_SPACING = 0.4, 1.5  # m along the line
MAX_OFFSET = 0.5  # m
MIN_TURN_COSINE = 0.5  # cosine of the greatest turn from one person to the next
OFF_LINE = 1e9  # m: stands for the position along the line of people who are off it
MIN_CROWD_SHARE = 2 / 3  # of a crowd that must be in the line: else it is no queue
MAX_CELLS = 2_000_000  # numbers handled together: bounds memory


@dataclass(frozen=True, slots=True, eq=False)
class QueueShapes:
    """M lines of people who stand behind one another."""

    # (M, n) row numbers, in the table of positions, of the people in order along the line; only the first count (M,) of
    # each are valid
    rows: Ints
    count: Ints
    u: Array  # (M, 2) unit vector along the line from the first person towards the last
    middle: Array  # (M, 2) mean position x, y, m


def queue_shapes(pos: Array, i: Ints, j: Ints) -> Iterator[QueueShapes]:
    """Yields tables of the lines of all crowds, at most one for each crowd; a table holds crowds of equal size.

    pos (N, 2): m. i, j (K,): rows that stand close to each other; a crowd is connected by such pairs. The line is the
    whole crowd, else the longest line of three people and two thirds of the crowd; of several, the straightest.
    """
    for crowd in _crowds(len(pos), i, j):
        portion = max(1, MAX_CELLS // (crowd.shape[1] * crowd.shape[1] * crowd.shape[1]))
        for low in range(0, len(crowd), portion):
            some = crowd[low : low + portion]
            order, count = _best(pos[some])
            found = count > 0
            rows, count = np.take_along_axis(some[found], order[found], axis=1), count[found]
            yield QueueShapes(rows, count, *_axes(pos[rows], count)[:2])


def _crowds(people: int, i: Ints, j: Ints) -> Iterator[Ints]:
    """Yields the rows (C, n) of the C crowds of each size n > 1."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(i), np.int8), (i, j)), shape=(people, people))
    _, crowd = connected_components(graph, directed=False)
    order = np.argsort(crowd, kind="stable")
    size = np.bincount(crowd, minlength=1)
    first = np.cumsum(size) - size
    for n in np.unique(size[size > 1]):
        yield order[first[size == n, None] + np.arange(n)]


def _best(p: Array) -> tuple[Ints, Ints]:
    """Returns the order (C, n) of the people along the line in each crowd, and how many are in it (C,), or 0."""
    n = p.shape[1]
    whole_crowd = np.full(len(p), n)
    u = _axes(p, whole_crowd)[0]
    order = np.argsort((p * u[:, None]).sum(axis=2), axis=1, kind="stable")
    count = np.where(_fits(np.take_along_axis(p, order[..., None], axis=1), whole_crowd), n, 0)
    least = max(3, int(np.ceil(MIN_CROWD_SHARE * n - 1e-9)))
    rest = np.flatnonzero(count == 0) if n >= least else np.zeros(0, np.int64)
    if len(rest):
        crowd, some, long, residual = _lines_through_pairs(p[rest], least)
        ranked = np.lexsort((residual, -long, crowd))
        ranked = ranked[np.flatnonzero(np.diff(crowd[ranked], prepend=-1))]
        order[rest[crowd[ranked]]], count[rest[crowd[ranked]]] = some[ranked], long[ranked]
    return order, count


def _axes(p: Array, count: Ints) -> tuple[Array, Array, Array]:
    """Returns the best straight line of each set: unit vector (M, 2), middle (M, 2) m, root of the squared distances
    (M,).
    """
    within = np.arange(p.shape[1]) < count[:, None]
    middle = np.where(within[..., None], p, 0.0).sum(axis=1) / count[:, None]
    arm = np.where(within[..., None], p - middle[:, None], 0.0)
    xx, yy, xy = ((arm[..., a] * arm[..., b]).sum(axis=1) for a, b in ((0, 0), (1, 1), (0, 1)))
    u = unit(0.5 * atan2(2 * xy, xx - yy))
    whole = p[np.arange(len(p)), count - 1] - p[:, 0]
    u = np.where(((u * whole).sum(axis=1) >= 0)[:, None], u, -u)
    least = (xx + yy) / 2 - length(np.stack([(xx - yy) / 2, xy], axis=-1))
    return u, middle, np.sqrt(np.maximum(least, 0.0))


def _fits(p: Array, count: Ints) -> Bools:
    """Returns which of M ordered sets of positions pass the three tests of a line."""
    u, middle, _ = _axes(p, count)
    arm = p - middle[:, None]
    off = np.abs(u[:, None, 0] * arm[..., 1] - u[:, None, 1] * arm[..., 0])
    within = np.arange(p.shape[1]) < count[:, None]
    good = (off <= MAX_OFFSET) | ~within
    good[:, 1:] &= _steps_fit((arm * u[:, None]).sum(axis=2)) | ~within[:, 1:]
    good[:, 2:] &= _turns_fit(p) | ~within[:, 2:]
    return np.asarray(good.all(axis=1))


def _steps_fit(along: Array) -> Bools:
    steps = np.diff(along, axis=1)
    return np.asarray((steps >= MIN_SPACING) & (steps <= MAX_SPACING))


def _turns_fit(p: Array) -> Bools:
    step = np.diff(p, axis=1)
    size = length(step)
    return np.asarray((step[:, :-1] * step[:, 1:]).sum(axis=2) >= MIN_TURN_COSINE * size[:, :-1] * size[:, 1:])


def _lines_through_pairs(p: Array, least: int) -> tuple[Ints, Ints, Ints, Array]:
    """Returns crowd, order, length and misfit of lines sought through each two people of crowds (C, n, 2)."""
    i, j = np.triu_indices(p.shape[1], 1)
    crowd, seed = np.nonzero(_steps_fit(np.stack([np.zeros((len(p), len(i))), _lengths(p, i, j)], axis=1))[:, 0])
    i, j, places = i[seed], j[seed], p[crowd]
    rows = np.arange(len(crowd))
    u = places[rows, j] - places[rows, i]
    u /= length(u)[:, None]
    arm = places - (places[rows, i] + places[rows, j])[:, None] / 2
    off = np.abs(u[:, None, 0] * arm[..., 1] - u[:, None, 1] * arm[..., 0])
    along = np.where(off <= MAX_OFFSET, (arm * u[:, None]).sum(axis=2), OFF_LINE)
    order = np.argsort(along, axis=1, kind="stable")
    places = np.take_along_axis(places, order[..., None], axis=1)
    links = _steps_fit(np.take_along_axis(along, order, axis=1))
    links[:, 1:] &= _turns_fit(places) | ~links[:, :-1]
    start, count = _longest(links)
    order = np.take_along_axis(order, np.minimum(start[:, None] + np.arange(p.shape[1]), p.shape[1] - 1), axis=1)
    places = np.take_along_axis(p[crowd], order[..., None], axis=1)
    good = np.flatnonzero((count >= least) & _fits(places, count))
    return crowd[good], order[good], count[good], _axes(places[good], count[good])[2]


def _lengths(p: Array, i: Ints, j: Ints) -> Array:
    return length(p[:, j] - p[:, i])


def _longest(links: Bools) -> tuple[Ints, Ints]:
    """Returns start and length (M,) of the longest run of linked positions in each row."""
    start, count, run = np.zeros(len(links), np.int64), np.ones(len(links), np.int64), np.ones(len(links), np.int64)
    for k in range(links.shape[1]):
        run = np.where(links[:, k], run + 1, 1)
        start, count = np.where(run > count, k + 2 - run, start), np.maximum(run, count)
    return start, count
