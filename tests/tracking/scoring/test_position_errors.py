"""Errors of places, velocities and extents: by hand, GOSPA by all assignments, extents by scipy's matrix roots."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from sim.types import Truth
from tracking.scoring.frame_weights import unweighted
from tracking.scoring.people import ComparedSides, PersonRows
from tracking.scoring.position_errors import PARTS, gospa_of, gospa_parts, weighted_positions
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import Pairs, point_pairs


def rows(*counts: int) -> FrameRows:
    return FrameRows(np.repeat(np.arange(1, len(counts) + 1), counts), np.arange(sum(counts)))


def errors(true_vel: np.ndarray | None, est_vel: np.ndarray | None) -> dict[str, float]:
    """Three people of one frame; the second track is mapped to nobody, the third 0.5 m off like the first, the fourth
    at an unknown place."""
    true_pos = np.array([[0.0, 0.0], [5.0, 5.0], [9.0, 9.0]])
    est_pos = np.array([[5.0, 5.5], [80.0, 80.0], [0.3, 0.4], [np.nan, 0.0]])
    true = PersonRows(rows(3), np.full(3, -1), true_pos, true_vel, None)
    est = PersonRows(rows(4), np.full(4, -1), est_pos, est_vel, None)
    truth = Truth("", 1.0, 1, 1.0, true.rows.frame, true.rows.id, true.group, true_pos, true_vel, None, np.ones(3))
    inside = np.array([False, True])
    sides = ComparedSides(truth, (), inside, inside, true, est, np.array([1, -1, 0, 2]), "ground")
    return unweighted(weighted_positions(sides), 2)


def test_only_mapped_people_at_known_places_count() -> None:
    found = errors(None, None)
    assert found["RMSE_pos"] == pytest.approx(0.5)
    assert np.isnan(found["RMSE_vel"])
    found = errors(np.zeros((3, 2)), np.array([[0, 1], [9, 9], [0, 2.0], [np.nan, 0]]))
    assert found["RMSE_vel"] == pytest.approx(np.sqrt((1 + 4) / 2))


def one_frame(x: np.ndarray, y: np.ndarray, cutoff: float) -> Pairs:
    return point_pairs(rows(len(x)), rows(len(y)), np.reshape(x, (-1, 2)), np.reshape(y, (-1, 2)), cutoff)


def gospa(pairs: Pairs, cutoff: float, frames: int, power: float = 2.0) -> dict[str, float]:
    means = zip(PARTS, gospa_parts(pairs, cutoff, power).sum(axis=0)[:, None] / frames, strict=True)
    return {key: float(v[0]) for key, v in gospa_of(dict(means), power).items()}


def by_all_assignments(x: np.ndarray, y: np.ndarray, cutoff: float, power: float) -> float:
    """The definition; a pair further apart than the cut-off costs what leaving both alone does."""
    if len(x) > len(y):
        x, y = y, x
    d = np.minimum(np.linalg.norm(x[:, None] - y[None], axis=2), cutoff) ** power
    whole = min(sum(d[i, j] for i, j in enumerate(order)) for order in permutations(range(len(y)), len(x)))
    return (whole + cutoff**power / 2 * (len(y) - len(x))) ** (1 / power)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_gospa_is_equal_to_the_best_of_all_assignments_and_a_metric(seed: int, power: float) -> None:
    r = np.random.default_rng(seed)
    sets = [r.uniform(0, 3, (r.integers(0, 6), 2)) for _ in range(3)]

    def distance(a: int, b: int) -> float:
        found = gospa(one_frame(sets[a], sets[b], 1.5), 1.5, frames=1, power=power)
        assert found["GOSPA"] == pytest.approx(by_all_assignments(sets[a], sets[b], 1.5, power), abs=1e-9)
        return found["GOSPA"]

    assert distance(0, 0) == pytest.approx(0.0, abs=1e-7)
    assert distance(0, 1) == pytest.approx(distance(1, 0))
    assert distance(0, 2) <= distance(0, 1) + distance(1, 2) + 1e-9
