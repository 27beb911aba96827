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
    """M lines of people who stand behind one another.

    - rows (M, n): row numbers, in the table of positions, of the people in order along the line; only the first count
      (M,) of each are valid.
    - u (M, 2): unit vector along the line from the first person towards the last. middle (M, 2): mean position x, y, m.
    """

    rows: Ints
    count: Ints
    u: Array
    middle: Array


def queue_shapes(pos: Array, i: Ints, j: Ints) -> Iterator[QueueShapes]:
    """Yields tables of the lines of all crowds, at most one line for each crowd; a table holds crowds of equal size.

    pos (N, 2): x, y in m. i, j (K,): pairs of rows of pos that stand close to each other. A crowd is a set of two or
    more rows connected by such pairs. The line holds the whole crowd if that passes the three tests: neighbours 0.4 to
    1.5 m apart along the straight line, nobody more than 0.5 m off it, turns of at most 60°. Else it is the longest
    line of at least three people and two thirds of the crowd that passes them, if any; of several, the straightest. A
    table may be empty. Nothing is yielded without pairs.
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
    """Yields for each size n > 1 that occurs, ascending, the rows (C, n) of the C crowds of n people, ascending in each
    crowd.

    people: number of rows. i, j (K,): pairs of rows that stand close; a crowd is a set of rows that pairs connect.
    """
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
    """Returns the order (C, n) of the people along the line in each crowd, and the number of people in the line (C,).

    The order holds indices into the crowd; only the first `number` entries are valid. The number is 0 for a crowd
    without a line. p (C, n, 2): positions, m. Unless the whole crowd is a line, the longest line of at least 3 people
    and two thirds of the crowd is taken; of several, the one with the smallest squared distances from its straight
    line.
    """
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
    """Returns the straight line that fits each of M sets of positions best (least squared distances).

    Three arrays: its unit vector (M, 2), from the first position towards the last; the mean position (M, 2), m; the
    root of the sum of squared distances from the line (M,), m. p (M, n, 2): positions, m, of which the first count (M,)
    are valid.
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
    """Returns for each of M ordered sets of positions whether it passes the three tests of a line, shape (M,).

    The tests: at most 0.5 m off the best straight line, neighbours 0.4 to 1.5 m apart along it, turns of at most 60°. p
    (M, n, 2): m, of which the first count (M,) are valid.
    """
    u, middle, _ = _axes(p, count)
    arm = p - middle[:, None]
    off = np.abs(u[:, None, 0] * arm[..., 1] - u[:, None, 1] * arm[..., 0])
    within = np.arange(p.shape[1]) < count[:, None]
    good = (off <= MAX_OFFSET) | ~within
    good[:, 1:] &= _steps_fit((arm * u[:, None]).sum(axis=2)) | ~within[:, 1:]
    good[:, 2:] &= _turns_fit(p) | ~within[:, 2:]
    return np.asarray(good.all(axis=1))


def _steps_fit(along: Array) -> Bools:
    """Returns whether neighbours are 0.4 to 1.5 m apart, shape (M, n - 1); along (M, n): positions along
    the line, m.
    """
    steps = np.diff(along, axis=1)
    return np.asarray((steps >= MIN_SPACING) & (steps <= MAX_SPACING))


def _turns_fit(p: Array) -> Bools:
    """Returns whether the direction turns by at most 60° at each inner position, shape (M, n - 2); p (M, n, 2): m."""
    step = np.diff(p, axis=1)
    size = length(step)
    return np.asarray((step[:, :-1] * step[:, 1:]).sum(axis=2) >= MIN_TURN_COSINE * size[:, :-1] * size[:, 1:])


def _lines_through_pairs(p: Array, least: int) -> tuple[Ints, Ints, Ints, Array]:
    """Returns lines of `least` or more people in crowds p (C, n, 2), m: at most one for each two people 0.4 to 1.5 m
    apart.

    Each is sought along the straight line through the two and passes the tests of a line. Four arrays for M lines:
    crowd (M,), from 0; order (M, n) of the people in the crowd, of which the first `length` are valid; length (M,);
    root of the sum of squared distances from the line (M,), m.
    """
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
    """Returns the distances (C, K), m, between positions i and j (K,) of each crowd p (C, n, 2)."""
    return length(p[:, j] - p[:, i])


def _longest(links: Bools) -> tuple[Ints, Ints]:
    """Returns the start index (M,) and length (M,), in positions, of the longest run of linked positions in each of M
    rows.

    links (M, n - 1): True if position k is linked to position k + 1. Without links the start is 0 and the length 1. Of
    equally long runs the first is taken.
    """
    start, count, run = np.zeros(len(links), np.int64), np.ones(len(links), np.int64), np.ones(len(links), np.int64)
    for k in range(links.shape[1]):
        run = np.where(links[:, k], run + 1, 1)
        start, count = np.where(run > count, k + 2 - run, start), np.maximum(run, count)
    return start, count
