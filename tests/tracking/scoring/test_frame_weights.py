"""Scores under weights of the frames: weights of 1 are the recording; nothing is made by joining frames."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.loading.resolve import load
from sim.sequence import simulate
from tests.groups_as_wholes import wholes
from tests.hand_made import Scene, event, tracks, truth
from tracking import track
from tracking.scoring import evaluate
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scorer
from tracking.scoring.frame_weights import FrameScores

TWO = {1: (0.0, 0.0), 2: (1.0, 0.0)}
PAIR = {1: ((1, 2), None)}


def scored(true, answers, weights, group_match="hull", frames=None) -> dict[str, float]:
    (compared,) = Scorer(true).compare([answers], frames=frames)
    (row,) = compared.weighted_scores(group_match)(np.array([weights], float))
    return dict(zip(CATALOGUE, row.tolist(), strict=True))


@cache
def simulated():
    sequence = simulate(load("mixed", ["camera.fps=5"]), 1, streams=())
    people = track("blob", sequence, detections="truth", sensor={"detect_prob": 0.8, "clutter_rate": 1.0})
    return sequence.truth, {"people": people, "wholes": wholes(sequence, "ground")}


@pytest.mark.parametrize("who", ["people", "wholes"])
@pytest.mark.parametrize("by", ["hull", "members"])
@pytest.mark.parametrize("frames", [None, range(30, 120)])
def test_weights_of_one_are_the_recording(who: str, by: str, frames: range | None) -> None:
    true, answers = simulated()
    expected = evaluate(true, answers[who], group_match=by, frames=frames)
    found = scored(true, answers[who], np.ones(true.length), group_match=by, frames=frames)
    assert expected["group_F1"] > 0.2
    assert sum(v == v for v in expected.values()) > 60
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, abs=1e-12, rel=1e-12, nan_ok=True), key


FOUND, MISSED = Scene(TWO, PAIR), Scene({1: (0.1, 0.0)})
FALSE = Scene({**TWO, 9: (30.0, 0.0)}, {1: ((1, 2), None), 7: ((1, 9), (20.0, 20.0, 22.0, 22.0))})


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 3), min_size=12, max_size=12).filter(lambda w: sum(w[:6]) > 0))
def test_frames_of_weight_n_count_n_times(weight: list[int]) -> None:
    """Joins make nothing here: the same people stand in every frame, and what goes wrong is at the end."""
    answers = [FOUND] * 6 + [FALSE] * 4 + [MISSED] * 2
    order = np.repeat(np.arange(12), weight)
    expected = evaluate(truth([FOUND] * len(order), None), tracks([answers[k] for k in order]))
    found = scored(truth([FOUND] * 12, None), tracks(answers), weight)
    fixed = {"MT", "PT", "ML"}  # shares of the whole recording decide, and people count by the mean weight
    for key in CATALOGUE.keys() - fixed:
        assert found[key] == pytest.approx(expected[key], abs=1e-12, nan_ok=True), key


def test_no_weight_where_a_score_is_defined_makes_it_unknown() -> None:
    true = truth([FOUND] * 20, [event("merge", 10, (1, 2))])
    weights = np.ones(20)
    weights[9] = 0
    assert np.isnan(scored(true, tracks([FOUND] * 20), weights)["merge_F1"])
    nothing = scored(true, tracks([FOUND] * 20), np.zeros(20))
    assert np.isnan([nothing["group_F1"], nothing["GOSPA"], nothing["RMSE_pos"]]).all()
    assert nothing["HOTA"] == 0


def test_a_stated_total_stands_at_weights_of_one_and_changes_with_them() -> None:
    scores = FrameScores(3)
    values = scores.column(np.array([1, 2, 2]), np.array([0.1, 0.2, 0.3]))
    scores.add("plain", values)
    scores.add_ratio("ratio", values, np.ones(3))
    scores.add("exact", values, 0.6)
    found = scores(np.array([[1.0, 1.0, 1.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]]))
    assert found["exact"][0] == 0.6 != 0.1 + 0.2 + 0.3
    assert np.stack([found["plain"], found["exact"]]) == pytest.approx(np.array([[0.6, 0.2, 0.25]] * 2))
    assert found["ratio"] == pytest.approx([0.2, 0.2 / 3, 0.5])
