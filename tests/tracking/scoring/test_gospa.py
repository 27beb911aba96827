"""GOSPA: worked out by hand, by trying all assignments, and as the metric that it is."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from tracking.scoring.candidate_pairs import Pairs, point_pairs
from tracking.scoring.gospa import gospa, gospa_parts
from tracking.scoring.rows import FrameRows


def rows(*counts: int) -> FrameRows:
    return FrameRows(np.repeat(np.arange(1, len(counts) + 1), counts), np.arange(sum(counts)))


def one_frame(x: np.ndarray, y: np.ndarray, cutoff: float) -> Pairs:
    return point_pairs(rows(len(x)), rows(len(y)), np.reshape(x, (-1, 2)), np.reshape(y, (-1, 2)), cutoff)


def test_worked_out_by_hand() -> None:
    """c = 2, p = 2. One 0.6 m off, one 3 m off (a miss and a false one), in two frames of which the other is empty."""
    pairs = one_frame(np.array([[0.0, 0], [10, 0]]), np.array([[0.6, 0], [13, 0]]), 2.0)
    assert gospa_parts(pairs, 2.0) == pytest.approx(np.array([[0, 0, 0], [0.36, 2, 2]]))
    found = gospa(pairs, 2.0, frames=2)
    assert found["GOSPA"] == pytest.approx(np.sqrt(4.36 / 2))
    assert found["GOSPA_localisation"] == pytest.approx(np.sqrt(0.18))
    assert found["GOSPA_missed"] == found["GOSPA_false"] == pytest.approx(1.0)


def test_power_one_adds_distances() -> None:
    pairs = one_frame(np.array([[0.0, 0], [10, 0]]), np.array([[0.6, 0]]), 2.0)
    assert gospa(pairs, 2.0, frames=1, power=1.0)["GOSPA"] == pytest.approx(0.6 + 1.0)


def test_nobody() -> None:
    nobody = np.zeros((0, 2))
    assert gospa(one_frame(nobody, nobody, 2.0), 2.0, frames=3)["GOSPA"] == 0.0
    assert np.isnan(gospa(one_frame(nobody, nobody, 2.0), 2.0, frames=0)["GOSPA"])
    assert gospa(one_frame(np.zeros((3, 2)), nobody, 2.0), 2.0, frames=1)["GOSPA_missed"] == pytest.approx(np.sqrt(6))


def by_all_assignments(x: np.ndarray, y: np.ndarray, cutoff: float, power: float) -> float:
    """The definition; a pair further apart than the cut-off costs what leaving both alone does."""
    if len(x) > len(y):
        x, y = y, x
    d = np.minimum(np.linalg.norm(x[:, None] - y[None], axis=2), cutoff) ** power
    whole = min(sum(d[i, j] for i, j in enumerate(order)) for order in permutations(range(len(y)), len(x)))
    return (whole + cutoff**power / 2 * (len(y) - len(x))) ** (1 / power)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_equal_to_the_best_of_all_assignments_and_a_metric(seed: int, power: float) -> None:
    r = np.random.default_rng(seed)
    sets = [r.uniform(0, 3, (r.integers(0, 6), 2)) for _ in range(3)]

    def distance(a: int, b: int) -> float:
        found = gospa(one_frame(sets[a], sets[b], 1.5), 1.5, frames=1, power=power)
        assert found["GOSPA"] == pytest.approx(by_all_assignments(sets[a], sets[b], 1.5, power), abs=1e-9)
        return found["GOSPA"]

    assert distance(0, 0) == pytest.approx(0.0, abs=1e-7)
    assert distance(0, 1) == pytest.approx(distance(1, 0))
    assert distance(0, 2) <= distance(0, 1) + distance(1, 2) + 1e-9


def test_frames_are_apart() -> None:
    pairs = point_pairs(rows(1, 1), rows(0, 2), np.zeros((2, 2)), np.array([[0.5, 0], [0.2, 0]]), 2.0)
    assert gospa_parts(pairs, 2.0) == pytest.approx(np.array([[0, 0, 0], [0, 2, 0], [0.04, 0, 2]]))
