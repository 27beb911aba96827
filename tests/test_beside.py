"""The speed beside the commit that last closed an issue: what counts as slower, and that no path is."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import beside


def ratios(speed: float, noise: float, seed: int) -> list[float]:
    return [*(speed * np.exp(np.random.default_rng(seed).normal(0.0, noise, beside.ROUNDS)))]


def test_noise_alone_is_hardly_ever_slower_and_a_fifth_nearly_always_is() -> None:
    alarms = [beside.is_slower(ratios(1.0, 0.15, seed)) for seed in range(1000)]
    assert np.mean(alarms) < 0.005  # a path fails only if it is slower twice
    assert np.mean([beside.is_slower(ratios(1.2, 0.05, seed)) for seed in range(1000)]) > 0.99
    assert not beside.is_slower([1.0, *[1.3] * 4, *[1.0] * 6])


def test_the_interval_leaves_out_one_ratio_of_eleven_on_each_side() -> None:
    assert beside.ends([float(k) for k in range(11)]) == (1.0, 5.0, 9.0)
    assert beside.ends([3.0, 1.0, 2.0]) == (1.0, 2.0, 3.0)


@pytest.mark.slow
def test_no_path_is_slower_than_at_the_commit_that_last_closed_an_issue() -> None:
    if not beside.is_known(beside.base()):
        pytest.skip(f"this is no clone with the commit {beside.base()}")
    assert beside.slower_paths(beside.base(), beside.ROUNDS, [*beside.PATHS]) == []
