import functools
from dataclasses import replace
from itertools import cycle, pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.truth.crossing_events import CrossingFinder, crossings, net_crossings
from sim.truth.merge_split_rules import frames_of
from sim.truth.motion_rows import MotionRows
from sim.truth.queue_detection import QueueFinder, queues

FPS = 10.0
T = np.arange(120)[:, None] / FPS


def crowd(paths):
    pos = np.stack(paths, axis=1)
    return pos, np.gradient(pos, 1 / FPS, axis=0), np.isfinite(pos).all(axis=2)


def queued(paths, group=None):
    """The queues of people on these paths, all alone unless `group` (P,) says otherwise."""
    pos, vel, present = crowd(paths)
    label = np.full(len(paths), -1) if group is None else np.array(group)
    return queues(MotionRows.of_table(pos, vel, present, np.tile(label, (len(pos), 1))), FPS)


def pair(start, path):
    """Two people 0.7 m apart across, on `path` (T, 2) from `start`."""
    return [np.array([start[0], start[1] + y]) + path for y in (-0.35, 0.35)]


def straight(vx, vy=0.0):
    return T * [vx, vy]


def there_and_back(vx, turn):
    return np.minimum(T, 2 * turn - T) * [vx, 0]


def groups(*numbers):
    return np.tile(np.array(numbers), (len(T), 1))


def crossed(paths, group=None):
    group = groups(1, 1, 2, 2) if group is None else group
    rows = MotionRows.of_table(*crowd(paths), group)
    return [(e.start, e.end, e.before, e.after, e.members) for e in crossings(rows, FPS)]


HEAD_ON = pair((0, 5), straight(1)) + pair((10, 5.2), straight(-1))


def test_across_and_back_is_no_cross():
    """A pair steps over the way of the other (y = 5) 3 m ahead of it, at 5.1 s; then back again at 5.9 s, or on."""

    def stepping(*places):
        y = np.interp(T, [2.5, 5.5, 8.5], places)
        return pair((0, 5), straight(1)) + [np.concatenate([8.5 + x + 0 * T, y], axis=1) for x in (-0.35, 0.35)]

    assert crossed(stepping(2.4, 5.4, 2.4)) == []
    assert len(crossed(stepping(2.4, 5.4, 6.9))) == 1


@pytest.mark.parametrize("angle", range(0, 360, 45))
def test_paths_that_meet_in_a_point_of_both_cross_at_any_angle(angle):
    """Both walk through the very place (5, 5), in different frames: turned about, rounding puts it on either side."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    late = [np.array([5 + x, -2.4]) + straight(0, 1) for x in (-0.35, 0.35)]
    turned = [(p - 5) @ np.array([[c, -s], [s, c]]) for p in pair((0, 5), straight(1)) + late]
    assert len(crossed(turned)) == len(crossed(turned, groups(*[2**51] * 2, *[2**52] * 2))) == 1, "of any ids"


NO_CROSSES = [
    pair((0, 5), there_and_back(0.9, 5.2)) + pair((10, 5.2), there_and_back(-0.9, 5.2)),  # bounce back
    pair((0, 5), straight(1)) + pair((10, 7.0), straight(-1)),  # pass in lanes beside, hulls 0.8 m apart
    pair((0, 5), straight(1)) + pair((1.5, 5), straight(0.5)),  # too slowly through
    pair((0, 5), straight(1)) + pair((10, 9), straight(-1)),  # never near
]


@pytest.mark.parametrize("paths", NO_CROSSES, ids=["bounce", "lanes", "slow", "far"])
def test_not_a_cross(paths):
    assert crossed(paths) == []


def test_cross_needs_equal_memberships_before_and_after():
    late = groups(1, 1, 2, 2)
    late[70:] = 1  # one group 1.2 s after it
    assert crossed(HEAD_ON, late) == []
    later = groups(1, 1, 2, 2)
    later[58 + 21 :] = 1
    assert len(crossed(HEAD_ON, later)) == 1
    early = groups(1, 1, 2, 2)
    early[:30, 3] = -1
    assert crossed(HEAD_ON, early) == []
    joined = [*HEAD_ON, np.array([20.0, 20]) + straight(0)]
    assert len(crossed(joined, groups(1, 1, 2, 2, -1))) == 1
    grown = groups(1, 1, 2, 2, -1)
    grown[65:, 4] = 2
    assert crossed(joined, grown) == []


def test_who_leaves_after_a_cross_has_crossed():
    paths = [p.copy() for p in HEAD_ON]
    paths[0][62:] = paths[1][65:] = np.nan
    assert len(crossed(paths)) == 1
    alone = groups(1, 1, 2, 2)
    alone[62:, 1] = -1
    assert len(crossed(paths, alone)) == 1, "the one who is left is no group, and yet stays who he was"
    stays = [p.copy() for p in HEAD_ON]
    assert crossed(stays, alone) == [], "but where nobody left the scene, the group fell apart"


def waiting(k, arrive=3.0, leave=9.0, spacing=0.8, at=(5.0, 3.0), step=(0.0, 1.2)):
    """The k-th in line: walks up from behind until `arrive`, leaves sideways at `leave`."""
    place = np.array([at[0] + spacing * k, at[1]])
    coming = place + np.maximum(arrive - T, 0) * [1.3, 0]
    return coming + np.maximum(T - leave, 0) * np.array(step)


def test_queue_of_two_or_for_less_than_three_seconds_is_none():
    assert queued([waiting(k) for k in range(2)]) == []
    assert queued([waiting(k, arrive=3, leave=5.9) for k in range(3)]) == []
    assert len(queued([waiting(k, arrive=3, leave=6.3) for k in range(3)])) == 1


def served(people=5, service=2.0, spacing=0.8):
    """The head leaves every `service` seconds; the others then move up at 1 m/s, one place."""
    paths = []
    for k in range(people):
        moved = sum((np.clip(T - service * (n + 1), 0, spacing) for n in range(k)), np.zeros_like(T))
        x = 5 + spacing * k - moved
        paths.append(np.concatenate([x, 3 + 1.3 * np.maximum(T - service * (k + 1), 0)], axis=1))
    return paths


def test_advancing_is_waiting():
    (line,) = queued(served())
    assert line.members == (1, 2, 3, 4, 5)
    assert (line.start, line.end) == (1, pytest.approx(80, abs=2))


@pytest.mark.parametrize("people", [3, 5, 8])
@pytest.mark.parametrize("radius", [0.45, 0.55, 0.8, 1.2])
def test_a_circle_of_people_talking_is_not_a_queue(people, radius):
    rng = np.random.default_rng(people)
    angle = 2 * np.pi * np.arange(people) / people + 0.3
    stand = [np.array([5, 5]) + radius * np.array([np.cos(a), np.sin(a)]) + 0 * T for a in angle]
    sway = [p + 0.05 * np.sin(T * rng.uniform(1, 2) + rng.uniform(0, 6, 2)) for p in stand]
    assert queued(stand) == []
    assert queued(sway) == []


def test_walking_in_file_or_shuffling_abreast_is_not_a_queue():
    assert queued([np.array([0.8 * k, 0]) + straight(1.2) for k in range(4)]) == []
    assert queued([np.array([0.8 * k, 0]) + straight(0, 0.3) for k in range(4)]) == []
    assert len(queued([np.array([0.8 * k, 0]) + straight(0.3, 0) for k in range(4)])) == 1


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
    found, expected = [], []
    for _ in range(300):
        n = int(r.integers(2, 20))
        paths = r.uniform(-2, 2, (2, 1, 2)) + np.cumsum(r.normal(0, 1, (2, n, 2)), axis=1)
        holes = r.random((2, n)) < 0.1
        holes[:, 0] = False
        expected.append(cut(*(path[~hole] for path, hole in zip(paths, holes, strict=True))))
        paths[holes] = np.nan
        found.append(net_crossings(*paths))
    assert found == expected
    assert {-1, 0, 1} <= set(expected)
    assert sum(e == 0 for e in expected) < 270
    round_twice = np.linspace(0.3, 4 * np.pi + 0.3, 40)
    spiral, ray = np.stack([np.cos(round_twice), np.sin(round_twice)], axis=1), np.linspace([0, 0], [3, 0.01], 40)
    assert net_crossings(ray, spiral) == cut(ray, spiral) == -2
    assert net_crossings(ray, 1.1 * spiral[::-1]) == cut(ray, 1.1 * spiral[::-1]) == 2


@functools.cache
def scene(name, seed, fps):
    """Rows (frame from 0, id, position, velocity, group), frames and fps of a simulated scene."""
    truth = simulate(load(name, set=[f"camera.fps={fps}"]), seed, streams=()).truth
    return (truth.frame - 1, truth.id, truth.pos, truth.vel, truth.group), truth.length, truth.fps


def portions(length, sizes):
    """First frame and end of each portion, of as many frames as `sizes` says in turn."""
    low, sizes = 0, cycle(sizes)
    while low < length:
        yield low, (low := min(low + next(sizes), length))


class KnownMotion:
    """The motion of people by id in the frames from `first` to before `end`; all else is not known."""

    def __init__(self, rows, first, end):
        frame = rows[0]
        known = (frame >= first) & (frame < end)
        self.first, self.end = first, end
        self.rows = MotionRows.of(*(x[known] for x in rows), end)

    def window(self, people, first, end):
        assert self.first <= first < end <= self.end
        return self.rows.window(people, first, end)


SIZES = st.lists(st.one_of(st.integers(1, 20), st.integers(10, 300)), min_size=1, max_size=5)
# Name and frames per s: with 20, every other frame is examined for queues.
RATES = (("cross", 5.0), ("queue", 20.0), ("waiting", 5.0), ("mixed", 5.0))
SEEDS = (30_000, 30_001)


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(RATES), st.sampled_from(SEEDS), SIZES, st.integers(20, 90))
def test_crossings_are_the_same_with_any_number_of_frames_at_once(rate, seed, sizes, every):
    """Motion that the finder does not need is forgotten, and the people of groups that are there no more."""
    rows, length, fps = scene(rate[0], seed, rate[1])
    expected = crossings(MotionRows.of(*rows, length), fps)
    finder, found = CrossingFinder(fps), []
    for low, high in portions(length, sizes):
        now = (rows[0] >= low) & (rows[0] < high)
        motion = KnownMotion(rows, finder.first if low else 0, high)
        events = finder.add(*(rows[k][now] for k in (0, 1, 2, 4)), motion, high)
        assert all(low < e.end + frames_of(2.0, fps) <= high for e in events)
        found += events
        if low // every < high // every:
            finder.forget({*rows[4][rows[0] == high - 1].tolist()})
    found += finder.rest(KnownMotion(rows, finder.first, length))
    people = [replace(e, members=tuple(p + 1 for p in e.members)) for e in found]
    assert repr(sorted(people, key=lambda e: (e.start, e.end, e.before))) == repr(expected)


@settings(max_examples=10, deadline=None)
@given(st.sampled_from(RATES), st.sampled_from(SEEDS), SIZES, st.integers(20, 90))
def test_queues_are_the_same_with_any_number_of_frames_at_once(rate, seed, sizes, every):
    rows, length, fps = scene(rate[0], seed, rate[1])
    expected = queues(MotionRows.of(*rows, length), fps)
    finder, found = QueueFinder(fps), []
    for low, high in portions(length, sizes):
        now = (rows[0] >= low) & (rows[0] < high)
        events = finder.add(*(x[now] for x in rows), high)
        known = [e.end + frames_of(3.0, fps) + frames_of(1.5, fps) for e in events]
        assert all(low < k <= high for k in known), "people may advance for 3 s, a line may be lost for 1.5 s"
        found += events
        if low // every < high // every:
            finder.forget(high - round(6 * fps))
    found += finder.rest()
    people = [replace(e, members=tuple(p + 1 for p in e.members)) for e in found]
    assert repr(sorted(people, key=lambda e: (e.start, e.end, e.members))) == repr(expected)


def test_the_scenes_have_crossings_and_queues():
    counts = {}
    for name, rate in RATES:
        made = [(MotionRows.of(*rows, length), fps) for rows, length, fps in (scene(name, k, rate) for k in SEEDS)]
        counts[name] = [sum(len(find(*one)) for one in made) for find in (crossings, queues)]
    assert counts["cross"][0] > 0
    assert counts["waiting"][0] > 0
    assert min(counts[name][1] for name in ("queue", "waiting", "mixed")) > 0
