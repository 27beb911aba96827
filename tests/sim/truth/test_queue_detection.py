import numpy as np
import pytest

from sim.truth.queue_detection import queue_shapes
from tests.reference_queue_shapes import chain


def found(pos):
    """The queue_shapes among places, as lists of rows, each from its smaller end; all stand close to one another."""
    rows = [
        rows[k, : number[k]].tolist()
        for rows, number, *_ in queue_shapes(pos, *np.triu_indices(len(pos), 1))
        for k in range(len(number))
    ]
    return [min(r, r[::-1]) for r in rows]


def standing(seed):
    """Two to eight people: anywhere, in a crooked line, or in a line of which one has wandered off."""
    r = np.random.default_rng(seed)
    n = int(r.integers(2, 9))
    line = np.column_stack([0.8 * np.arange(n) + r.normal(0, 0.15, n), r.normal(0, 0.1 + 0.15 * (seed % 2), n)])
    if seed % 3 == 0:
        line = r.uniform(0, 2.2, (n, 2))
    if seed % 3 == 1:
        line[-1] = r.uniform(0, 3, 2)
    return line[r.permutation(n)]


def test_chains_are_those_tried_line_by_line():
    lengths = []
    for seed in range(300):
        pos = standing(seed)
        expected = chain(pos).tolist()
        assert found(pos) == ([min(expected, expected[::-1])] if expected else []), seed
        lengths.append((len(expected), len(pos)))
    assert {n for n, _ in lengths} >= {0, 2, 3, 4, 5, 6, 7, 8}
    assert sum(0 < n < people for n, people in lengths) > 20, "also queue_shapes that leave somebody out"


def test_many_crowds_at_once_are_each_by_itself():
    places = [standing(seed) + np.array([20.0 * seed, 0]) for seed in range(40)]
    pos, ends = np.concatenate(places), np.cumsum([len(p) for p in places])
    edges = [np.array(np.triu_indices(len(p), 1)) + end - len(p) for p, end in zip(places, ends, strict=True)]
    together = []
    for shapes in queue_shapes(pos, *np.concatenate(edges, axis=1)):
        for rows, n, u, middle in zip(*shapes, strict=True):
            together.append(min(rows[:n].tolist(), rows[:n].tolist()[::-1]))
            assert middle == pytest.approx(pos[rows[:n]].mean(axis=0))
            assert (pos[rows[n - 1]] - pos[rows[0]]) @ u > 0
            assert np.hypot(*u) == pytest.approx(1)
    alone = [[k + int(end) - len(p) for k in row] for p, end in zip(places, ends, strict=True) for row in found(p)]
    assert sorted(together) == sorted(alone)


def test_who_stands_next_to_nobody_is_in_no_chain():
    none = np.zeros(0, np.int64)
    assert list(queue_shapes(np.zeros((3, 2)), none, none)) == []
    assert list(queue_shapes(np.zeros((0, 2)), none, none)) == []
