"""A recording of its own frames: all of them once are itself; some of them are what they would be alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.hand_made import Scene, event, tracks, truth
from tracking.scoring import evaluate
from tracking.scoring.block_resampling import TIMELESS, resampled_scorer
from tracking.scoring.catalogue import ALL, CATALOGUE

TWO = {1: (0.0, 0.0), 2: (1.0, 0.0)}
PAIR = {1: ((1, 2), None)}
TRUE = [Scene(TWO, PAIR)] * 6
MISSED = [Scene(TWO, PAIR if k < 4 else {}) for k in range(5)]  # the last frame is not answered at all


def test_all_frames_once_are_the_recording() -> None:
    true = truth(TRUE, [event("merge", 3, (1, 2))])
    whole = evaluate(true, tracks(MISSED))
    found = dict(zip(CATALOGUE, resampled_scorer(true, tracks(MISSED), None, "hull")(np.arange(6)), strict=True))
    for score, timeless in zip(ALL, TIMELESS.tolist(), strict=True):
        expected = whole[score.key] if timeless else float("nan")
        assert found[score.key] == pytest.approx(expected, nan_ok=True), score.key
    assert found["HOTA"] < 1
    assert np.isnan([found["merge_F1"], found["group_F1_core"]]).all()


def test_frames_may_come_twice_and_count_twice() -> None:
    # Of the frames 1, 5, 5 and 6 the group is told in the first: 1 of 4; two people are missed in the last: FN 2.
    found = dict(
        zip(CATALOGUE, resampled_scorer(truth(TRUE), tracks(MISSED), None, "hull")(np.array([0, 4, 4, 5])), strict=True)
    )
    assert found["group_1-FN"] == 0.25
    assert (found["TP"], found["FN"]) == (6, 2)


def test_groups_that_are_derived_are_derived_before() -> None:
    long = [Scene(TWO, PAIR)] * 60
    bare = [t.replace(group=np.full(2, -1), groups=None) for t in tracks(long)]
    found = dict(
        zip(CATALOGUE, resampled_scorer(truth(long), bare, None, "members")(np.arange(59, 49, -1)), strict=True)
    )
    assert found["pairwise_F1"] == 1  # ten frames are too short to become a group in


def test_labels_go_with_their_frames() -> None:
    known = truth(TRUE, labelled=np.arange(6) < 4)
    draw = resampled_scorer(known, tracks(MISSED), None, "hull")
    assert dict(zip(CATALOGUE, draw(np.array([3, 4])), strict=True))["group_TP"] == 1
    assert np.isnan(dict(zip(CATALOGUE, draw(np.array([4, 5])), strict=True))["group_TP"])
