"""The observation: known values on hand-made frames, bounds, and that nothing of the truth is in it."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Detections, Frame, Groups, Tracks
from tracking.environment.observation import NAMES, STATISTICS, Observer

FPS = 10.0


def tracks(index, places, vel=(1.0, 0.0), ids=None, plane="ground", group=None, **more):
    pos = np.array(places, float).reshape(-1, 2)
    n = len(pos)
    id = np.arange(n) if ids is None else np.array(ids)
    cov = np.tile(np.diag([0.04, 0.04, 1.0, 1.0]), (n, 1, 1))
    label = np.full(n, -1) if group is None else np.array(group)
    return Tracks(index, (index - 1) / FPS, plane, "person", id, label, pos, np.tile(vel, (n, 1)) * 1.0, cov, **more)


def frame(index, places=(), score=None):
    pos = np.array(places, float).reshape(-1, 2)
    score = np.ones(len(pos)) if score is None else np.array(score, float)
    return Frame(index, (index - 1) / FPS, detections=Detections(index, 0.0, "ground", pos, None, None, score))


def looked(pairs, px_per_m=float("nan"), observer=None):
    """Values before squashing, by name."""
    observer = observer or Observer(FPS)
    for one, answer in pairs:
        observer.add(one, answer)
    seen = dict(zip(NAMES, observer.statistics(px_per_m).tolist(), strict=True))
    halves = {s.name: s.half for s in STATISTICS}
    return {k: v if halves[k] is None else halves[k] * v / (1 - v) for k, v in seen.items()}


def walk(k, n=2):
    return [[0.1 * k, 2.0 * i] for i in range(n)]


def test_two_people():
    seen = looked([(frame(k, walk(k), [0.5, 1.0]), tracks(k, walk(k))) for k in range(1, 6)])
    expected = {"time": 0.5, "tracks": 2, "detections": 2, "speed": 1, "score": 0.75}
    assert {key: seen[key] for key in expected} == pytest.approx(expected)


def test_in_the_image_speeds_are_metres_and_unknown_without_a_scale():
    pairs = [(frame(1), tracks(1, [[100, 100], [300, 100]], (100, 0), plane="image"))]
    assert looked(pairs, 50.0)["speed"] == pytest.approx(2)
    assert looked(pairs)["speed"] == 0
    assert looked(pairs)["tracks"] == pytest.approx(2)


def test_groups_that_the_tracker_names():
    grouped = tracks(1, walk(1, 4), group=[3, 3, -1, -1])
    assert looked([(frame(1), grouped)])["grouped"] == 0.5


def test_groups_as_wholes():
    two = np.array([[0.0, 0.0], [9.0, 0.0]])
    size, none = np.array([3.0, 1.0]), (np.zeros(0, np.int64),) * 2
    groups = Groups(np.arange(2), none, two, two * 0, np.tile(np.eye(2), (2, 1, 1)), size, (np.zeros((0, 2)),) * 2)
    seen = looked([(frame(1), tracks(1, two, (0, 0), group=[0, 1], groups=groups).replace(unit="group"))])
    assert seen["grouped"] == 0.5


def test_nothing_at_all():
    observer = Observer(FPS)
    assert not observer.statistics(float("nan")).any()
    seen = looked([(frame(k), tracks(k, [])) for k in (1, 2, 3)])
    assert {k for k, v in seen.items() if v} == {"time"}


def test_bounds_and_kind():
    rng, observer = np.random.default_rng(3), Observer(FPS)
    for k in range(1, 40):
        n, m = rng.integers(0, 6, 2)
        answer = tracks(k, rng.normal(0, 5, (n, 2)), rng.normal(0, 50, 2), ids=rng.choice(20, n, replace=False))
        observer.add(frame(k, rng.normal(0, 5, (m, 2)), score=rng.uniform(0, 1, m)), answer)
        if k % 7 == 0:
            seen = observer.statistics(40.0)
            assert seen.dtype == np.float32
            assert seen.shape == (len(STATISTICS),)
            assert ((seen >= 0) & (seen <= 1)).all()
