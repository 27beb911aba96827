"""Intervals: known answers, and how often they cover the truth."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.support.tables import wilson
from tracking.stats import block_intervals, block_length, mean_interval, paired


def test_interval_of_what_does_not_vary() -> None:
    mean, low, high = mean_interval(np.tile([0.25, -3.0], (5, 1)))
    assert mean.tolist() == low.tolist() == high.tolist() == [0.25, -3.0]


def test_interval_of_two_numbers_is_students() -> None:
    """12.706 is the quantile for one degree of freedom."""
    mean, low, high = mean_interval(np.array([[0.0], [1.0]]))
    assert mean == 0.5
    assert high - mean == mean - low == pytest.approx(12.706 / 2, abs=1e-3)


def test_interval_leaves_out_what_is_not_known() -> None:
    values = np.array([[1.0, np.nan, np.nan], [1.0, 2.0, np.nan], [1.0, np.inf, np.nan], [np.nan, np.nan, np.nan]])
    mean, low, high = mean_interval(values)
    assert mean[:2].tolist() == [1.0, 2.0]
    assert (low[0], high[0]) == (1.0, 1.0)
    assert np.isnan([low[1], high[1], mean[2], low[2], high[2]]).all(), "one sequence says nothing of others"
    assert np.isnan(mean_interval(np.zeros((0, 2)))).all()


@pytest.mark.parametrize("sequences", [6, 10, 20])
def test_few_sequences_hold_the_truth_as_often_as_said(sequences: int) -> None:
    """Skewed scores; percentiles of a bootstrap held it in 0.83 to 0.87 of draws of 6, so 15 % of stars were false."""
    values = np.random.default_rng(1).beta(8, 2, (sequences, 4000))
    _, low, high = mean_interval(values)
    assert 0.93 < ((low < 0.8) & (high > 0.8)).mean() < 0.965


def test_differences_are_paired() -> None:
    """Two trackers that differ by 0.1 on sequences that differ by far more."""
    r = np.random.default_rng(0)
    first = r.uniform(0, 1, (30, 1))
    second = first + 0.1 + r.normal(0, 0.01, first.shape)
    first[4], second[7] = np.nan, np.nan
    mean, low, high = paired(first, second)
    assert 0.09 < low[0] < mean[0] < high[0] < 0.11
    assert mean_interval(second)[1][0] < mean_interval(first)[2][0], "unpaired, the intervals overlap"


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [(8, 10, 0.4902, 0.9433), (0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (50, 100, 0.4038, 0.5962)],
)
def test_wilson_as_in_tables(hits: int, count: int, low: float, high: float) -> None:
    assert wilson(hits, count) == pytest.approx((hits / count, low, high), abs=5e-5)


BLOCKS = [
    (1000, 10, 1.0, 50), (1000, 10, 60.3, 121), (1000, 10, 900.0, 200), (100, 10, 1.0, 10), (71, 25, 1.0, 25),
    (10, 25, 1.0, 10), (7, 0.3, 1.0, 2), (0, 10, 1.0, 0),
]  # fmt: skip


@pytest.mark.parametrize(("frames", "fps", "likeness", "expected"), BLOCKS)
def test_a_block_is_as_long_as_errors_last(frames: int, fps: float, likeness: float, expected: int) -> None:
    assert block_length(frames, fps, likeness) == expected


def mean_of(x: np.ndarray):
    return lambda weights: (weights @ x / weights.sum(axis=1))[:, None]


def test_intervals_hold_their_score_and_keep_to_its_range() -> None:
    x = (np.random.default_rng(0).random(200) < 0.97).astype(float)

    def scores(weights: np.ndarray) -> np.ndarray:
        share = weights @ x / 200
        return np.column_stack([share, weights @ (1 - x), 1 - 3 * (1 - share), 1 - share + 0.01, share - 1])

    scales = ("share", "count", "below one", "length", "plain")
    whole, low, high = block_intervals(scores, 200, 10.0, 1.0, 500, scales)
    assert (low < whole).all()
    assert (whole < high).all()
    assert low[[0, 1, 3]].min() >= 0
    assert high[[0, 2]].max() < 1
    assert high[0] - whole[0] < whole[0] - low[0]


def test_intervals_hold_the_truth_where_frames_resemble_their_neighbours() -> None:
    """300 means of 600 values with correlation 0.95^lag; errors last for 39 frames, and shorter blocks hold it less."""
    r = np.random.default_rng(0)
    held = {39.0: 0, 1.0: 0}
    for _ in range(300):
        x, now = np.zeros(600), r.normal() / np.sqrt(1 - 0.95**2)
        for t, noise in enumerate(r.normal(size=600)):
            now = 0.95 * now + noise
            x[t] = now
        for likeness in held:
            _, low, high = block_intervals(mean_of(x), 600, 10.0, likeness, 200)
            held[likeness] += bool(low[0] < 0 < high[0])
    assert 0.92 < held[39.0] / 300 < 0.98
    assert held[1.0] < held[39.0]
