"""Questions: each about another pair and a stretch that it has, unsure ones first, the same every time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.near_pairs import evidence_of
from tracking.fitting import questions
from tracking.fitting.questions import CHECKS, LONGEST, SURE, choose_questions, shown_stretches


def mean_log_odds(pairs, question):
    frame = pairs.step * pairs.size + 1
    here = (pairs.a == question.a) & (pairs.b == question.b) & (frame >= question.first) & (frame <= question.last)
    return pairs.log_odds[here].mean()


@pytest.mark.parametrize("seed", [0, 1])
def test_each_pair_once_and_where_it_has_evidence(seed):
    pairs = evidence_of(seed, people=40)
    found = choose_questions(pairs)
    assert len(found) == len({(q.a, q.b) for q in found}) == 20
    for q in found:
        assert np.isfinite(mean_log_odds(pairs, q))
        assert 1 <= q.first < q.last <= pairs.length
        assert (q.last - q.first + 1) / pairs.fps <= LONGEST
    assert choose_questions(evidence_of(seed, people=40)) == found


def test_most_are_unsure_and_some_are_sure_of_both_kinds():
    pairs = evidence_of(0, people=60, gap=(0.6, 1.6))
    means = np.array([mean_log_odds(pairs, q) for q in choose_questions(pairs)])
    assert (np.abs(means[:2]) < SURE).all()
    assert len(means) == 20
    assert (np.abs(means) < SURE).sum() == 20 - CHECKS
    assert (means >= SURE).sum() == (means <= -SURE).sum() == CHECKS // 2


def test_sure_pairs_of_one_kind_fill_the_places_of_the_other():
    pairs = evidence_of(0, people=60, gap=1.6)
    means = np.array([mean_log_odds(pairs, q) for q in choose_questions(pairs)])
    assert len(means) == 20
    assert (means < SURE).all()


def test_nobody_is_asked_about_twice_before_others():
    pairs = evidence_of(0, people=60, gap=1.6)
    unsure = [q for q in choose_questions(pairs) if abs(mean_log_odds(pairs, q)) < SURE]
    people = [p for q in unsure for p in (q.a, q.b)]
    assert len(people) == len(set(people))


def test_pairs_that_are_not_allowed_and_few_pairs():
    pairs = evidence_of(0, people=40)
    allowed = np.zeros(pairs.pair[-1] + 1, bool)
    allowed[:5] = True
    found = choose_questions(pairs, allowed=allowed)
    few = {tuple(x) for x in np.column_stack([pairs.a, pairs.b])[pairs.pair < 5].tolist()}
    assert {(q.a, q.b) for q in found} == few
    assert choose_questions(evidence_of(0, people=0)) == []


def test_stretches_end_at_long_pauses_and_stay_around_the_nearest_moment(monkeypatch):
    pairs = evidence_of(0, people=2, frames=60)
    gap = pairs.take(np.flatnonzero((pairs.step < 20) | (pairs.step > 26)))
    found = shown_stretches(gap)
    assert gap.step[found.begin[0]] >= 27, "the longer of two stretches"
    values = gap.values.copy()
    values[gap.step == 50, 0] = 0.01
    monkeypatch.setattr(questions, "LONGEST", 4.0)
    found = shown_stretches(replace(gap, values=values))
    assert (gap.step[found.begin], gap.step[found.end - 1]) == (45, 54)
    np.testing.assert_allclose(found.means(gap.step), [49.5])
