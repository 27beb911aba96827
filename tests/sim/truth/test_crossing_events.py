from itertools import pairwise

import numpy as np

from sim.geometry.polygons import footprint_hull, polygon_gap
from sim.truth.crossing_events import encounters, members_by_frame, net_crossings


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


def test_encounters_are_the_frames_in_which_hulls_are_near():
    """Against the gap of each two hulls, frame by frame; two groups and one who is alone wander about."""
    r = np.random.default_rng(1)
    way = np.cumsum(r.normal(0, 0.4, (200, 4, 2)), axis=0) + r.uniform(0, 8, (4, 2))
    pos = np.abs(way % 8 - 4)[:, [0, 0, 1, 1, 2, 3, 3]] + r.uniform(-0.6, 0.6, (7, 2))
    group = np.tile([4, 4, 2, 2, -1, 9, 9], (200, 1))
    group[80:90, 3] = -1  # group 2 is one alone, hence none
    met = encounters(pos, members_by_frame(group), fps=10.0)
    for names in ((2, 4), (2, 9), (4, 9)):
        near = []
        for t in range(200):
            sides = [pos[t, group[t] == g] for g in names]
            hulls = [footprint_hull(side) for side in sides]
            near.append(min(len(side) for side in sides) > 1 and polygon_gap(*hulls) <= 1.0)
        frames = np.flatnonzero(near)
        cuts = np.flatnonzero(np.diff(frames) > 5) + 1  # half a second is bridged
        expected = [(int(some[0]), int(some[-1])) for some in np.split(frames, cuts) if len(some)]
        mine = (met.a == names[0]) & (met.b == names[1])
        assert list(zip(met.first[mine].tolist(), met.last[mine].tolist(), strict=True)) == expected
    assert len(met) > 3
    assert (np.diff(met.first) >= 0).all()
