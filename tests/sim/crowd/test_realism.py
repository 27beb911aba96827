"""People walk as the literature says they do; the figures are those of benchmarks/realism.py, on other seeds."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks import realism

pytestmark = pytest.mark.slow

SEEDS = range(1000, 1010)


@cache
def walk(size: int) -> realism.GroupWalk:
    return realism.walk_alone(size, SEEDS)


def test_free_speed_alone() -> None:
    # N(1.34, 0.26): the mean of 40 is within 0.1 of it in 98 of 100 cases
    speed = realism.free_speeds(range(1000, 1002))
    assert len(speed) == 40
    assert speed.mean() == pytest.approx(1.34, abs=0.1)
    assert speed.std() == pytest.approx(0.26, abs=0.08)


def test_groups_are_slower_by_the_member() -> None:
    # Moussaid et al. 2010: 0.04 to 0.08 m/s per member; measured on the same free speeds, so that the draw cancels out
    seeds = range(1000, 1030)
    means = [realism.walk_alone(n, seeds).speed.mean() for n in (2, 6)]
    free = [np.mean([_drawn(n, seed) for seed in seeds]) for n in (2, 6)]
    slower = [f - m for f, m in zip(free, means, strict=True)]
    assert 0.04 <= (slower[1] - slower[0]) / 4 <= 0.08


def _drawn(size: int, seed: int) -> float:
    """Mean free speed of the people of realism.walk_alone."""
    return float(realism.alone_motion(size, seed).free_speed.mean())


@pytest.mark.parametrize("size", [2, 3, 4, 5])
def test_neighbours_are_an_arm_apart(size: int) -> None:
    low, middle, high = np.quantile(realism.neighbours(walk(size)), (0.1, 0.5, 0.9))
    assert 0.6 <= middle <= 0.9
    assert low > 0.45
    assert high < 1.1


def test_pairs_walk_abreast() -> None:
    # medians of seq_hotel and zara01 are 76 and 75 degrees, their 10 % quantiles 56 and 50 (benchmarks.realism middle)
    angle = realism.abreast(realism.walk_alone(2, range(1000, 1030)))
    assert 70 < np.median(angle) < 82
    assert np.quantile(angle, 0.1) > 50


@pytest.mark.parametrize("size", [4, 5])
def test_larger_groups_are_two_rows_of_pairs_and_triads(size: int) -> None:
    assert np.mean(realism.rows(walk(size)) == 2) >= 0.8


def test_strangers_seldom_go_through_a_group() -> None:
    # of those who come straight at it; walking on blindly, about two of three would
    passed = np.concatenate([realism.passes_through(n, range(1000, 1012)) for n in (2, 3)])
    assert passed.mean() < 0.25


def test_the_street_is_like_seq_hotel(shared_data: Path) -> None:
    real = realism.recording_statistics(str(shared_data / "biwi" / "seq_hotel"))
    speed, closest, acceleration = realism.distances(realism.scenario_statistics("street", range(1000, 1040)), real)
    assert speed <= 0.15
    assert closest <= 0.15
    assert 0.75 <= acceleration <= 1.25
