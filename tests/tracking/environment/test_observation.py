"""The observation: known values on hand-made frames, bounds, and that nothing of the truth is in it."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest

from sim.types import Detections, Frame, Tracks
from tracking.environment import observation
from tracking.environment.observation import NAMES, STATISTICS, Observer

FPS = 10.0


def tracks(index, places, vel=(1.0, 0.0), ids=None, plane="ground", group=None, **more):
    pos = np.array(places, float).reshape(-1, 2)
    n = len(pos)
    id = np.arange(n) if ids is None else np.array(ids)
    cov = np.tile(np.diag([0.04, 0.04, 1.0, 1.0]), (n, 1, 1))
    label = np.full(n, -1) if group is None else np.array(group)
    return Tracks(index, (index - 1) / FPS, plane, "person", id, label, pos, np.tile(vel, (n, 1)) * 1.0, cov, **more)


def frame(index, places=(), plane="ground", score=None, image=None):
    pos = np.array(places, float).reshape(-1, 2)
    score = np.ones(len(pos)) if score is None else np.array(score, float)
    return Frame(index, (index - 1) / FPS, image, detections=Detections(index, 0.0, plane, pos, None, None, score))


def looked(pairs, px_per_m=float("nan"), observer=None):
    """Values before squashing, by name."""
    observer = observer or Observer(FPS)
    for one, answer in pairs:
        observer.add(one, answer)
    seen = dict(zip(NAMES, observer.statistics(px_per_m).tolist(), strict=True))
    halves = {s.name: s.half for s in STATISTICS}
    return {k: v if halves[k] is None else halves[k] * v / (1 - v) for k, v in seen.items()}


def walk(k, n=2):
    """n people 2 m apart who walk at 1 m/s along x."""
    return [[0.1 * k, 2.0 * i] for i in range(n)]


def test_two_people_who_are_seen_as_expected():
    seen = looked([(frame(k, walk(k)), tracks(k, walk(k))) for k in range(1, 6)])
    assert seen["time"] == pytest.approx(0.5)
    assert seen["tracks"] == seen["detections"] == pytest.approx(2)
    assert seen["births"] == pytest.approx(2 / 0.5)
    assert seen["deaths"] == 0
    assert seen["age"] == pytest.approx(0.4)
    assert seen["speed"] == pytest.approx(1)
    assert seen["crowding"] == pytest.approx(2)
    assert seen["gate"] == pytest.approx(0.2)
    assert seen["seen"] == seen["score"] == 1
    assert seen["surplus"] == 0.5
    nothing = ("speed_spread", "acceleration", "correction", "innovation", "residual", "missed", "density", "flicker")
    assert [seen[name] for name in nothing] == pytest.approx([0] * len(nothing), abs=1e-6)
    assert seen["orphans"] == 0


def test_what_is_off_is_measured():
    """Detections 0.3 m beside where tracks were expected, answers half-way; one too many, one missed."""
    told = [tracks(1, [[0, 0], [0, 5]]), tracks(2, [[0.1, 0.15], [0.1, 5.0]])]
    given = [frame(1, [[0, 0], [0, 5]]), frame(2, [[0.1, 0.3], [9.0, 9.0]], score=[0.9, 0.3])]
    observer = Observer(FPS)
    looked([(given[0], told[0])], observer=observer)
    seen = looked([(given[1], told[1])], observer=observer)
    assert seen["innovation"] == pytest.approx(0.3, rel=1e-5)
    assert seen["innovation_sigma"] == pytest.approx(0.09 / 0.04 / 2, rel=1e-5)
    assert seen["residual"] == pytest.approx(0.15, rel=1e-5)
    assert seen["correction"] == pytest.approx(0.075, rel=1e-5)  # median of 0.15 and 0
    assert seen["correction_sigma"] == pytest.approx(0.0225 / 0.04 / 4, rel=1e-5)
    assert (seen["orphans"], seen["missed"]) == (0.5, 0.5)
    assert seen["score"] == pytest.approx(0.6)
    assert seen["weak"] == 0.5
    assert seen["births"] == seen["deaths"] == 0


def test_in_the_image_lengths_are_metres_and_unknown_without_a_scale():
    places = [[100, 100], [300, 100]]
    pairs = [(frame(k, places, "image"), tracks(k, places, (100, 0), plane="image")) for k in (1, 2)]
    seen, blind = looked(pairs, 50.0), looked(pairs)
    assert seen["speed"] == pytest.approx(2)
    assert seen["crowding"] == pytest.approx(4)
    assert seen["innovation"] == pytest.approx(0.2)
    assert blind["speed"] == blind["crowding"] == blind["innovation"] == 0
    assert blind["tracks"] == blind["detections"] == pytest.approx(2)


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


def test_it_knows_nothing_of_the_truth():
    for name in ("observation", "observation_window"):
        source = Path(observation.__file__).with_name(f"{name}.py").read_text(encoding="utf-8")
        words = {node.attr for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Attribute)}
        imported = {a.name for n in ast.walk(ast.parse(source)) if isinstance(n, ast.ImportFrom) for a in n.names}
        modules = {n.module for n in ast.walk(ast.parse(source)) if isinstance(n, ast.ImportFrom)}
        assert not (words | imported) & {"truth", "Truth", "FrameTruth", "load_truth"}
        assert not any(
            "scoring" in m
            or m.startswith(("sim.truth.label", "tracking.environment.episode_cache", "tracking.environment.episodes"))
            for m in modules
        )
