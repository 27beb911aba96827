"""The existence probability of a track: limits, Bayes' rule, frame rates, scores."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.filters import existence
from tracking.filters.existence import ScoreCalibration

NONE = np.zeros(0, np.int64)


def states(*rows):
    """(3, N) from rows shown, hidden, false."""
    return np.array(rows, float).T


def test_many_short_steps_are_one_long_step():
    short, long = existence.transition(0.04, 0.5), existence.transition(0.4, 0.5)
    assert np.allclose(np.linalg.matrix_power(short, 10), long, atol=1e-12)
    assert np.allclose(long[:, :2].sum(0), np.exp(-0.4 / existence.LIFETIME))


def test_a_measurement_is_weighed_by_bayes_rule():
    made, p, g, ratio = states([0.3, 0.2, 0.4]), np.array([0.6]), np.array([5.0]), np.array([2.0])
    existence.update(made, np.array([0]), p, g, ratio)
    weights = np.array([0.3 * (0.4 + 0.6 * 5 * 2), 0.2, 0.4 * (0.4 + 0.6 * 5), 0.1])
    assert made[:, 0] == pytest.approx((weights / weights.sum())[:3])


def test_a_miss_lowers_existence_by_as_much_as_the_person_could_be_seen():
    made = states([0.8, 0.1, 0.0], [0.8, 0.1, 0.0], [0.8, 0.1, 0.0])
    existence.update(made, NONE, np.array([0.0, 0.45, 0.9]), np.zeros(0), np.zeros(0))
    left = made[:2].sum(0)
    assert left[0] == pytest.approx(0.9)
    assert left[0] > left[1] > left[2]


def test_two_sensors_are_weighed_by_bayes_rule():
    """The states are enumerated: seen by the picture or not, by the detector or not, in the background, false, lasting
    false, gone."""
    p, g, ratio, shown, lasting, standing = 0.6, 5.0, 2.0, 0.7, 0.3, 0.4
    measured, false, missed = 1 - p + p * g * ratio, 1 - p + p * g, 1 - p
    for rows, likely, unlikely in (([0], measured, false), ([], missed, missed)):
        made, detector, lasts = states([0.3, 0.2, 0.4]), np.array([shown]), np.array([lasting])
        still = np.array([standing])
        k = len(rows)
        values = np.array([p]), np.full(k, g), np.full(k, ratio)
        existence.update_by_detector(made, detector, lasts, still, np.array(rows, int), *values)
        seen, unseen = shown * likely, 1 - shown
        walking = 0.2 * (1 - standing)
        weights = [0.3 * seen, 0.3 * unseen, walking * seen, walking * unseen, 0.2 * standing * likely, 0.4 * unlikely]
        weights = np.array([*weights, 0.1 * lasting * unlikely, 0.1 * (1 - lasting)])
        weights /= weights.sum()
        assert made[:, 0] == pytest.approx([weights[:2].sum(), weights[2:5].sum(), weights[5]])
        assert detector[0] == pytest.approx((weights[0] + weights[2]) / weights[:4].sum())
        assert still[0] == pytest.approx(weights[4] / weights[2:5].sum())
        assert lasts[0] == pytest.approx(weights[6] / weights[6:].sum())


def test_a_person_is_shown_for_a_share_of_the_time():
    short = existence.transition(0.1, 0.5)[:2, :2] * np.exp(0.1 / existence.LIFETIME)
    share = np.array([existence.shown_share(0.5), 1 - existence.shown_share(0.5)])
    assert short @ share == pytest.approx(share)


def test_equal_scores_tell_nothing():
    scores = ScoreCalibration()
    assert scores.ratios(np.ones(3)).tolist() == [1.0, 1.0, 1.0]
    scores.add(np.ones(100), np.linspace(0, 1, 100))
    assert scores.ratios(np.array([1.0])) == pytest.approx(1.0)


def test_scores_of_people_are_learned_and_then_kept():
    scores, r = ScoreCalibration(), np.random.default_rng(0)
    person = r.random(existence.LEARNED) < 0.5
    scores.add(r.normal(np.where(person, 30.0, 10.0), 5.0), person.astype(float))
    low, high = scores.ratios(np.array([5.0, 35.0]))
    assert low < 0.1
    assert high > 10
    scores.add(np.full(500, 5.0), np.ones(500))
    assert scores.ratios(np.array([5.0]))[0] == low
