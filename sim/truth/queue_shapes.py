"""QueueShapes: people of one moment who stand behind one another; those of all moments are found at once.

Along the line that fits them best their spacing is 0.4-1.5 m and nobody is more than 0.5 m off it. From one to the next
the way turns by 60° at most: a conversation circle passes the first two tests when projected, never the third.
Tables of places (M, n, 2) hold M sets, in order, of which the first `count` (M,) places are meant.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sim.types import Array, Bools, Ints

MIN_SPACING, MAX_SPACING = 0.4, 1.5  # m along the line
MAX_OFFSET = 0.5  # m
MIN_TURN_COSINE = 0.5  # cosine of the greatest turn from one to the next
OFF_LINE = 1e9  # m: where those stand who are off a line
MIN_CROWD_SHARE = 2 / 3  # of a standing crowd that must be in the chain: else it is a crowd
MAX_CELLS = 2_000_000  # seeds times people looked at together: bounds memory


@dataclass(frozen=True, slots=True, eq=False)
class QueueShapes:
    """M chains: rows (M, n) of people in order, the first `count` (M,) of each; u (M, 2): direction from the first
    towards the last; middle (M, 2)."""

    rows: Ints
    count: Ints
    u: Array
    middle: Array


def queue_shapes(pos: Array, i: Ints, j: Ints) -> Iterator[QueueShapes]:
    """The chain, if there is one, of each crowd among places pos (N, 2); i, j: rows of who stand close to each other,
    which makes crowds. Crowds of equal size come together, each crowd's rows in ascending order."""
    for crowd in _crowds(len(pos), i, j):
        portion = max(1, MAX_CELLS // crowd.shape[1] ** 3)
        for low in range(0, len(crowd), portion):
            some = crowd[low : low + portion]
            order, count = _best(pos[some])
            found = count > 0
            rows, count = np.take_along_axis(some[found], order[found], axis=1), count[found]
            yield QueueShapes(rows, count, *_axes(pos[rows], count)[:2])


def _crowds(people: int, i: Ints, j: Ints) -> Iterator[Ints]:
    """Rows (C, n) of the C connected crowds of n > 1 people, for each n."""
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
    """Order (C, n) and length (C,) of the chain in each crowd p (C, n, 2), 0 where there is none: all of them, or the
    longest, straightest one along the line through two of them."""
    n = p.shape[1]
    everybody = np.full(len(p), n)
    u = _axes(p, everybody)[0]
    order = np.argsort((p * u[:, None]).sum(axis=2), axis=1, kind="stable")
    count = np.where(_fits(np.take_along_axis(p, order[..., None], axis=1), everybody), n, 0)
    least = max(3, int(np.ceil(MIN_CROWD_SHARE * n - 1e-9)))
    rest = np.flatnonzero(count == 0) if n >= least else np.zeros(0, np.int64)
    if len(rest):
        crowd, some, long, residual = _from_seeds(p[rest], least)
        ranked = np.lexsort((residual, -long, crowd))
        ranked = ranked[np.flatnonzero(np.diff(crowd[ranked], prepend=-1))]
        order[rest[crowd[ranked]]], count[rest[crowd[ranked]]] = some[ranked], long[ranked]
    return order, count


def _axes(p: Array, count: Ints) -> tuple[Array, Array, Array]:
    """Unit vector (M, 2) along the line that fits each set best, from the first towards the last; the middles (M, 2);
    the root of the sum of squares of distances from the line (M,)."""
    within = np.arange(p.shape[1]) < count[:, None]
    middle = np.where(within[..., None], p, 0.0).sum(axis=1) / count[:, None]
    arm = np.where(within[..., None], p - middle[:, None], 0.0)
    xx, yy, xy = ((arm[..., a] * arm[..., b]).sum(axis=1) for a, b in ((0, 0), (1, 1), (0, 1)))
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)
    u = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    whole = p[np.arange(len(p)), count - 1] - p[:, 0]
    u = np.where(((u * whole).sum(axis=1) >= 0)[:, None], u, -u)
    least = (xx + yy) / 2 - np.hypot((xx - yy) / 2, xy)
    return u, middle, np.sqrt(np.maximum(least, 0.0))


def _fits(p: Array, count: Ints) -> Bools:
    """Which sets (M,) are chains."""
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
    length = np.hypot(step[..., 0], step[..., 1])
    return np.asarray((step[:, :-1] * step[:, 1:]).sum(axis=2) >= MIN_TURN_COSINE * length[:, :-1] * length[:, 1:])


def _from_seeds(p: Array, least: int) -> tuple[Ints, Ints, Ints, Array]:
    """Shapes of `least` or more people along the lines through two who stand next to each other, in crowds (C, n, 2):
    crowd (M,), order (M, n), length (M,), distance from the line (M,)."""
    i, j = np.triu_indices(p.shape[1], 1)
    crowd, seed = np.nonzero(_steps_fit(np.stack([np.zeros((len(p), len(i))), _lengths(p, i, j)], axis=1))[:, 0])
    i, j, places = i[seed], j[seed], p[crowd]
    rows = np.arange(len(crowd))
    u = places[rows, j] - places[rows, i]
    u /= np.hypot(*u.T)[:, None]
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
    step = p[:, j] - p[:, i]
    return np.hypot(step[..., 0], step[..., 1])


def _longest(links: Bools) -> tuple[Ints, Ints]:
    """First place and number of places (M,) of the longest run that is linked throughout, of links (M, n - 1)."""
    start, count, run = np.zeros(len(links), np.int64), np.ones(len(links), np.int64), np.ones(len(links), np.int64)
    for k in range(links.shape[1]):
        run = np.where(links[:, k], run + 1, 1)
        start, count = np.where(run > count, k + 2 - run, start), np.maximum(run, count)
    return start, count
