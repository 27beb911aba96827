"""The belief of a place: nothing without answers that disagree, more with more of them, never for slips alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.near_pairs import evidence_of, table_of, walking
from tracking.fitting import place_belief
from tracking.fitting.place_belief import (
    PLACE,
    Answered,
    adapt,
    changed,
    features,
    fit_theta,
    log_odds_at,
    shift_at,
)
from tracking.grouping.belief import default_belief
from tracking.grouping.explained_pairs import SHARE, explain, quantity_of


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
    for table, before in zip(belief.tables, pairs.belief.tables, strict=True):
        np.testing.assert_array_equal(table.log_odds[1], before.log_odds[1])
        factor = 0.8 if quantity_of(table.name) in PLACE else 1.3
        np.testing.assert_allclose(table.log_odds[0], factor * before.log_odds[0])
    bias, default = belief.bias, default_belief().bias
    np.testing.assert_allclose(bias, [default[0] + 0.5, default[1]])
    np.testing.assert_array_equal(belief.threshold, default_belief().threshold)


def test_log_odds_of_the_place_are_those_of_the_changed_belief():
    """With the share of mates estimated anew, which few pairs leave near that of the fit."""
    for people, theta in ((12, [0.5, -0.2, 0.3]), (60, [1.0, 0.3, -0.3])):
        table = table_of(walking(1, people=people))
        pairs, theta = explain(table, 2.5, default_belief()), np.array(theta)
        again = explain(table, 2.5, changed(pairs.belief, theta))
        shift = shift_at(pairs, theta)
        np.testing.assert_allclose(shift, again.terms[:, again.quantities.index(SHARE)], atol=0.01)
        np.testing.assert_allclose(log_odds_at(pairs, theta, shift), again.log_odds, atol=0.01)
    assert np.abs(shift - shift_at(pairs, np.zeros(3))).max() > 0.1


def test_the_share_of_mates_is_of_no_theta():
    pairs = evidence_of(1)
    share = pairs.quantities.index(SHARE)
    terms = pairs.terms.copy()
    terms[:, share] += 1
    np.testing.assert_array_equal(features(replace(pairs, terms=terms)), features(pairs))


def test_theta_fits_the_answers_at_the_share_that_follows_from_it():
    pairs = evidence_of(0, people=40)
    answers = answered(pairs, lambda p: np.full(len(p.pair), True))
    theta = adapt([(pairs, answers)]).theta
    at = log_odds_at(pairs, np.zeros(3), shift_at(pairs, theta))[answers.row]
    again = fit_theta(features(pairs)[answers.row], at, answers.together, answers.question)
    np.testing.assert_allclose(again, theta, atol=1e-3)


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
