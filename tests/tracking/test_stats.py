"""Intervals: known answers, and how often they cover the truth."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.stats import block_length, bootstrap, draw_blocks, moving_blocks, paired, wilson


def test_bootstrap_of_what_does_not_vary() -> None:
    mean, low, high = bootstrap(np.tile([0.25, -3.0], (5, 1)))
    assert mean.tolist() == low.tolist() == high.tolist() == [0.25, -3.0]


def test_bootstrap_of_two_is_between_them() -> None:
    """A mean of two is low, middle or high with probabilities 1/4, 1/2, 1/4."""
    assert [v.tolist() for v in bootstrap(np.array([[0.0], [1.0]]))] == [[0.5], [0.0], [1.0]]


def test_bootstrap_leaves_out_what_is_not_known() -> None:
    values = np.array([[1.0, np.nan, np.nan], [1.0, 2.0, np.nan], [1.0, np.nan, np.nan], [np.nan, np.nan, np.nan]])
    mean, low, high = bootstrap(values)
    assert mean[:2].tolist() == [1.0, 2.0]
    assert (low[0], high[0]) == (1.0, 1.0)
    assert np.isnan([low[1], high[1], mean[2], low[2], high[2]]).all(), "one sequence says nothing of others"
    assert np.isnan(bootstrap(np.zeros((0, 2)))).all()


def test_bootstrap_is_as_wide_as_the_standard_error() -> None:
    values = np.random.default_rng(3).normal(size=(400, 1))
    mean, low, high = bootstrap(values, draws=8000)
    assert mean == pytest.approx(values.mean(axis=0))
    assert (high - low)[0] == pytest.approx(2 * 1.96 * values.std() / 20, rel=0.05)
    assert np.array_equal(bootstrap(values), bootstrap(values))


def test_differences_are_paired() -> None:
    """Two trackers that differ by 0.1 on sequences that differ by far more."""
    r = np.random.default_rng(0)
    first = r.uniform(0, 1, (30, 1))
    second = first + 0.1 + r.normal(0, 0.01, first.shape)
    first[4], second[7] = np.nan, np.nan
    mean, low, high = paired(first, second)
    assert 0.09 < low[0] < mean[0] < high[0] < 0.11
    assert bootstrap(second)[1][0] < bootstrap(first)[2][0], "unpaired, the intervals overlap"


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [(8, 10, 0.4902, 0.9433), (0, 10, 0.0, 0.2775), (10, 10, 0.7225, 1.0), (50, 100, 0.4038, 0.5962)],
)
def test_wilson_as_in_tables(hits: int, count: int, low: float, high: float) -> None:
    assert wilson(hits, count) == pytest.approx((hits / count, low, high), abs=5e-5)


def test_wilson_of_nothing() -> None:
    share, low, high = wilson(0, 0)
    assert np.isnan(share)
    assert (low, high) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("frames", "fps", "expected"), [(1000, 10, 50), (100, 10, 10), (71, 25, 25), (10, 25, 10), (7, 0.3, 1)]
)
def test_a_block_is_a_second_or_a_twentieth(frames: int, fps: float, expected: int) -> None:
    assert block_length(frames, fps) == expected


def test_blocks_are_neighbours() -> None:
    r = np.random.default_rng(0)
    drawn = np.array([draw_blocks(23, 5, r) for _ in range(2000)])
    assert drawn.shape == (2000, 23)
    inside = np.arange(1, 23) % 5 > 0
    assert (np.diff(drawn)[:, inside] == 1).all()
    assert set(drawn[:, 0].tolist()) == set(range(19))
    assert set(drawn.ravel().tolist()) == set(range(23))


def test_moving_blocks_of_a_whole_recording_in_one_block() -> None:
    assert [v.tolist() for v in moving_blocks(lambda f: np.array([f.mean()]), 4, 25.0, draws=20)] == [[1.5]] * 3


def test_moving_blocks_leave_out_what_is_not_known() -> None:
    def score(frames: np.ndarray) -> np.ndarray:
        return np.array([np.nan, frames.mean() if (frames == 0).any() else np.nan, 1.0])

    value, low, high = moving_blocks(score, 100, 10.0, draws=100)
    assert np.isnan([value[0], low[0], high[0]]).all()
    assert low[1] < value[1] < high[1]
    assert (low[2], high[2]) == (1.0, 1.0)
    assert np.isnan(moving_blocks(lambda f: np.array([np.nan]), 0, 10.0)[1]).all()


def test_moving_blocks_cover_where_frames_resemble_their_neighbours() -> None:
    """60 means of 1000 values with correlation 0.9^lag: blocks of 50 cover 0 in most, single frames do not."""
    r = np.random.default_rng(0)
    covered = {50: 0, 1: 0}
    for _ in range(60):
        x = np.zeros(1000)
        for t, noise in enumerate(r.normal(size=1000)):
            x[t] = 0.9 * x[t - 1] + noise
        for block in covered:
            q = np.random.default_rng(1)
            means = [x[draw_blocks(1000, block, q)].mean() for _ in range(200)]
            covered[block] += np.quantile(means, 0.025) < 0 < np.quantile(means, 0.975)
    assert covered[50] >= 48
    assert covered[1] <= 40
