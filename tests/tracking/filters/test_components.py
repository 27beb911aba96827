"""Points that are one group, and cell lists: beside looks at all points and pairs, closed forms, invariance."""

from __future__ import annotations

import numpy as np
import pytest

from tests import reference_components as reference
from tracking.filters.components import Constraint, linked, partition
from tracking.filters.components_kernels import FEW, prefixes

LINK = 1.5
RULE = Constraint(LINK, 9.21, 0.09 * np.eye(2), 3.0)


def random_set(r):
    """Up to 16 points in clumps or all over, with weights; a rule that leaves some of them apart."""
    count = int(r.integers(1, 14))
    centres = r.uniform(0, r.choice([4.0, 8.0, 15.0]), (int(r.integers(1, 6)), 2))
    points = centres[r.integers(len(centres), size=count)] + r.normal(0, r.uniform(0.1, 1.2), (count, 2))
    weights = r.uniform(0.1, 2, count) if r.random() < 0.5 else np.ones(count)
    A = r.normal(0, 0.2, (2, 2))
    prior = A @ A.T + 0.01 * np.eye(2)
    least = float(r.choice([0.0, 1.0, 2.0]))
    rule = Constraint(float(r.uniform(0.8, 2)), float(r.uniform(2, 9.21)), prior, r.uniform(0.1, 3), least)
    return points, weights, rule


def numbers(rule):
    return rule.link, rule.gate, rule.prior_entries, rule.strength, rule.least


def test_every_prefix_of_random_sets() -> None:
    verdicts = []
    for seed in range(100):
        r = np.random.default_rng(seed)
        points, weights, rule = random_set(r)
        start = int(r.integers(0, len(points) + 1))
        found = prefixes(points, weights, start, *numbers(rule))
        assert np.array_equal(found, reference.prefixes(points, weights, start, rule)), seed
        verdicts += found.tolist()
    assert 0.2 < np.mean(verdicts) < 0.8


def test_partitions_of_random_sets() -> None:
    joined = noise = 0
    for seed in range(150):
        points, weights, rule = random_set(np.random.default_rng(seed))
        label, group = linked(points, rule.link), partition(points, weights, rule)
        assert np.array_equal(label, reference.linked(points, rule.link)), seed
        assert np.array_equal(group, reference.partition(points, weights, rule)), seed
        joined += group.max() < label.max()
        noise += group.min() < 0
    assert min(joined, noise) > 15


@pytest.mark.parametrize("seed", range(6))
def test_many_components_are_joined_alike_wherever_they_are(seed: int) -> None:
    r = np.random.default_rng(seed)
    points, weights, rule = r.uniform(0, 25, (90, 2)), np.ones(90), random_set(r)[2]
    here = partition(points, weights, rule)
    assert len({*linked(points, rule.link)}) > FEW
    assert np.array_equal(here, reference.partition(points, weights, rule))
    assert np.array_equal(here, partition(points + np.array([1e4, -1e4]), weights, rule))


def test_nobody_one_and_all_at_the_same_place() -> None:
    none = np.zeros((0, 2))
    assert linked(none, LINK).shape == partition(none, np.zeros(0), RULE).shape == (0,)
    assert prefixes(none, np.zeros(0), 0, *numbers(RULE)).tolist() == [False]
    assert partition(np.ones((1, 2)), np.ones(1), RULE).tolist() == [0]
    assert prefixes(np.ones((1, 2)), np.ones(1), 1, *numbers(RULE)).tolist() == [True]
    assert not partition(np.ones((50, 2)), np.ones(50), RULE).any()
    assert prefixes(np.ones((50, 2)), np.ones(50), 0, *numbers(RULE)).tolist() == [False] + 50 * [True]
