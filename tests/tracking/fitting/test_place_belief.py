"""The belief of a place: nothing without answers that disagree, more with more of them, never for slips alone."""

from __future__ import annotations

import numpy as np
import pytest

from tests.near_pairs import evidence_of
from tracking.fitting import place_belief
from tracking.fitting.place_belief import PLACE, Answered, adapt, changed, expected_threshold, features, fit_theta
from tracking.grouping.belief import default_belief
from tracking.grouping.explained_pairs import quantity_of


def answered(pairs, together, count=20):
    """Answers to the first pairs: of each all its rows."""
    rows = np.flatnonzero(pairs.pair < count)
    question = pairs.pair[rows]
    return Answered(rows, question, together(pairs)[rows])


def test_answers_of_the_other_kind_move_all_probabilities():
    pairs = evidence_of(0, people=40)
    low, high = (adapt([(pairs, answered(pairs, lambda p, x=x: np.full(len(p.pair), x)))]) for x in (False, True))
    assert low.theta[0] < -0.2 < 0.2 < high.theta[0]
    assert high.right[1] > high.right[0]
    assert high.count == 20


def test_theta_is_where_the_slope_is_zero():
    r = np.random.default_rng(0)
    x, log_odds, question = r.normal(0, 1, (60, 3)), r.normal(0, 2, 60), np.arange(60) // 3
    together = (r.random(20) < 0.5)[question]
    theta = fit_theta(x, log_odds, together, question)

    def loss(theta):
        right = 1 / (1 + np.exp(-np.where(together, 1, -1) * (log_odds + x @ theta)))
        return -np.log(0.05 + 0.9 * right).sum() / 3 + (theta**2 / place_belief.SPREAD**2).sum() / 2

    for k in range(3):
        step = 1e-3 * np.eye(3)[k]
        assert loss(theta) < min(loss(theta + step), loss(theta - step))


def test_a_slip_about_a_sure_pair_changes_little():
    x, question = np.tile([1.0, 0.0, 0.0], (20, 1)), np.arange(20)
    log_odds = np.where(np.arange(20) < 10, 8.0, -8.0)
    right = log_odds > 0
    slip = right.copy()
    slip[0] = False
    assert np.abs(fit_theta(x, log_odds, right, question)).max() < 0.05
    assert np.abs(fit_theta(x, log_odds, slip, question)).max() < 0.1


def test_theta_changes_the_tables_of_now_alone():
    pairs, theta = evidence_of(1), np.array([0.5, -0.2, 0.3])
    belief = changed(pairs.belief, theta)
    expected = pairs.log_odds + features(pairs) @ theta
    for table, before in zip(belief.tables, pairs.belief.tables, strict=True):
        np.testing.assert_array_equal(table.log_odds[1], before.log_odds[1])
        factor = 0.8 if quantity_of(table.name) in PLACE else 1.3
        np.testing.assert_allclose(table.log_odds[0], factor * before.log_odds[0])
    bias, default = belief.bias, default_belief().bias
    np.testing.assert_allclose(bias, [default[0] + 0.5, default[1]])
    place = np.isin(pairs.quantities, PLACE)
    whole = bias[0] + pairs.terms @ np.where(place, 0.8, 1.3)
    np.testing.assert_allclose(whole, expected, atol=1e-4)


@pytest.mark.parametrize("shares", [[0.9] * 50, [0.1, 0.3, 0.6, 0.95] * 20, [0.95] * 20 + [0.4] * 40])
def test_the_threshold_is_best_for_the_expected_f1(shares):
    p = np.array(shares)
    found = expected_threshold(np.log(p / (1 - p)))

    def f1(t):
        return 2 * p[p >= t].sum() / ((p >= t).sum() + p.sum())

    assert f1(found) == pytest.approx(max(f1(t) for t in np.linspace(0, 0.99, 100)))


def test_recordings_count_together():
    """Two halves of the answers in two files give what one file gives."""
    pairs = evidence_of(0, people=40)
    whole = answered(pairs, lambda p: p.pair % 3 == 0)
    first = whole.question < 10
    halves = [
        Answered(whole.row[x], whole.question[x] - 10 * k, whole.together[x]) for k, x in ((0, first), (1, ~first))
    ]
    one, two = adapt([(pairs, whole)]), adapt([(pairs, half) for half in halves])
    np.testing.assert_allclose(one.theta, two.theta)
    assert one.belief.toml_text() == two.belief.toml_text()
