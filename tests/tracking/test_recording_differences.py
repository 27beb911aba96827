"""Differences of two runs of one recording: sign, value, and which part of the recording they come from."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.group_pda.recordings import paired_on_recording, with_intervals
from sim.types import Tracks
from tests.hand_made import Scene, tracks, truth
from tracking.scoring import evaluate

KEYS = ("group_F1", "MOTA", "IDSW")
FRAMES = 400
PAIR = Scene({1: (0.0, 0.0), 2: (1.0, 0.0)}, {1: ((1, 2), None)})
TRUTH = truth([PAIR] * FRAMES)


def run_that_misses(every: int) -> list[Tracks]:
    """Tracks that miss the people and their group in every frame whose number is divisible by `every`."""
    return tracks([Scene({}) if k % every == 0 else PAIR for k in range(1, FRAMES + 1)])


def test_difference_is_today_minus_before() -> None:
    before, today = run_that_misses(3), run_that_misses(7)
    found = paired_on_recording(TRUTH, before, today, KEYS)
    old, new = (evaluate(TRUTH, run) for run in (before, today))
    assert [f[0] for f in found] == pytest.approx([new[key] - old[key] for key in KEYS], abs=1e-12)
    assert found[1][0] > 0.15
    assert all(low < difference < high for difference, low, high in found[:2])
    assert found[1][1] > 0, "regular misses leave no doubt"


def test_difference_is_surer_than_the_scores_where_both_runs_miss_the_same_frames() -> None:
    before = tracks([Scene({}) if k % 100 < 40 or k % 5 == 0 else PAIR for k in range(1, FRAMES + 1)])
    today = tracks([Scene({}) if k % 100 < 40 else PAIR for k in range(1, FRAMES + 1)])
    ((_, low, high),) = paired_on_recording(TRUTH, before, today, ["MOTA"])
    ((_, least, most),) = with_intervals(TRUTH, today, ["MOTA"])
    assert 0 < low < high
    assert high - low < 0.7 * (most - least)


def test_equal_runs_differ_by_nothing_and_have_no_interval() -> None:
    run = run_that_misses(3)
    found = np.array(paired_on_recording(TRUTH, run, run, KEYS))
    assert found[:, 0].tolist() == [0.0] * len(KEYS)
    assert np.isnan(found[:, 1:]).all()
