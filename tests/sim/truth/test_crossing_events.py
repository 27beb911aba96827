from itertools import pairwise

import numpy as np

from sim.truth.crossing_events import net_crossings


def cut(a, b):
    """Signed crossings of two polylines, segment by segment: +1 where b passes from the left of a to its right."""

    def left(p, q, r):
        return (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])

    total = 0
    for p, q in pairwise(a):
        for r, s in pairwise(b):
            if left(p, q, r) * left(p, q, s) < 0 and left(r, s, p) * left(r, s, q) < 0:
                total += 1 if left(p, q, r) > 0 else -1
    return total


def test_net_crossings_are_those_of_the_segments():
    """Random walks of different lengths, with holes, that cross each other many times and from both sides."""
    r = np.random.default_rng(0)
    a, b, encounter, expected = [], [], [], []
    for k in range(300):
        n = int(r.integers(2, 20))
        paths = r.uniform(-2, 2, (2, 1, 2)) + np.cumsum(r.normal(0, 1, (2, n, 2)), axis=1)
        holes = r.random((2, n)) < 0.1
        holes[:, 0] = False
        expected.append(cut(*(path[~hole] for path, hole in zip(paths, holes, strict=True))))
        paths[holes] = np.nan
        a.append(paths[0])
        b.append(paths[1])
        encounter += [k] * n
    found = net_crossings(np.concatenate(a), np.concatenate(b), np.array(encounter), 300)
    assert found.tolist() == expected
    assert {-1, 0, 1} <= set(expected)
    assert sum(e == 0 for e in expected) < 270
    round_twice = np.linspace(0.3, 4 * np.pi + 0.3, 40)
    spiral, ray = np.stack([np.cos(round_twice), np.sin(round_twice)], axis=1), np.linspace([0, 0], [3, 0.01], 40)
    assert net_crossings(ray, spiral, np.zeros(40, np.int64), 1)[0] == cut(ray, spiral) == -2
    assert net_crossings(ray, 1.1 * spiral[::-1], np.zeros(40, np.int64), 1)[0] == cut(ray, 1.1 * spiral[::-1]) == 2
