"""The matching of whole sequences against scipy on one table per frame: as good, and where asked the very same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment

from tests.matrix_pairs import matrix_pairs
from tracking.scoring.matching import mapped_people, match, match_as_table, solve_rest
from tracking.scoring.rows import FrameRows
from tracking.scoring.similarity import Pairs, point_pairs

EIGHTHS = st.sampled_from([0.0, 0.0, 0.0, 0.125, 0.25, 0.5, 0.5, 0.625, 1.0, 1.0])  # ties, and sums that tie
ANY = st.one_of(EIGHTHS, st.floats(0, 1, allow_subnormal=False))


@st.composite
def tables(draw, numbers=ANY):
    """Up to four frames of up to seven by seven."""
    sizes = draw(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), min_size=1, max_size=4))
    filled = [draw(st.lists(numbers, min_size=n * m, max_size=n * m)) for n, m in sizes]
    return [np.array(values, float).reshape(size) for values, size in zip(filled, sizes, strict=True)]


def pairs_of(given: list[np.ndarray]) -> Pairs:
    return matrix_pairs([np.arange(len(t)) for t in given], [np.arange(t.shape[1]) for t in given], given)


def best_totals(given: list[np.ndarray]) -> list[float]:
    return [float(t[linear_sum_assignment(t, maximize=True)].sum()) for t in given]


def check(given: list[np.ndarray], pairs: Pairs, chosen: np.ndarray) -> None:
    i, j = pairs.i[chosen], pairs.j[chosen]
    assert len(set(i.tolist())) == len(i)
    assert len(set(j.tolist())) == len(j)
    assert (pairs.true.frame[i] == pairs.est.frame[j]).all()
    totals = np.bincount(pairs.frame[chosen], weights=pairs.s[chosen], minlength=len(given))
    assert totals == pytest.approx(np.array(best_totals(given)), abs=1e-12)


@given(tables())
def test_as_good_as_scipy_in_every_frame(given: list[np.ndarray]) -> None:
    pairs = pairs_of(given)
    check(given, pairs, match(pairs.frame, pairs.i, pairs.j, pairs.s))
    check(given, pairs, match_as_table(pairs, pairs.s))


@given(tables(EIGHTHS))
def test_of_equally_good_matchings_the_one_of_scipy(given: list[np.ndarray]) -> None:
    pairs = pairs_of(given)
    chosen = match_as_table(pairs, pairs.s)
    first_i = np.cumsum([0, *(len(t) for t in given)])
    first_j = np.cumsum([0, *(t.shape[1] for t in given)])
    expected = {
        (first_i[k] + a, first_j[k] + b)
        for k, table in enumerate(given)
        for a, b in zip(*linear_sum_assignment(-table), strict=True)
        if table[a, b] > 0
    }
    assert set(zip(pairs.i[chosen].tolist(), pairs.j[chosen].tolist(), strict=True)) == expected


def test_one_metre_is_near_enough_and_more_is_not() -> None:
    rows = FrameRows(np.array([1, 2]), np.array([5, 5]))
    there = np.array([[1.0, 0.0], [1.001, 0.0]])
    assert mapped_people(point_pairs(rows, rows, np.zeros((2, 2)), there, 2.0)).tolist() == [0, -1]
    assert mapped_people(point_pairs(rows, rows, np.zeros((2, 2)), there, 2.0), least=0.6).tolist() == [-1, -1]


@pytest.mark.parametrize("seed", range(6))
def test_mapping_equals_the_assignment_of_each_frame(seed: int) -> None:
    r = np.random.default_rng(seed)
    sizes = r.integers(0, 9, (12, 2))
    similarity = [r.random((n, m)) * (r.random((n, m)) < 0.6) for n, m in sizes]
    pairs = matrix_pairs([np.arange(n) for n, _ in sizes], [np.arange(m) for _, m in sizes], similarity)
    expected: list[int] = []
    for s, first in zip(similarity, np.cumsum(sizes[:, 0]) - sizes[:, 0], strict=True):
        weight = np.where(s >= 0.5, s, 0.0)
        who = np.full(s.shape[1], -1)
        for i, j in zip(*linear_sum_assignment(weight, maximize=True), strict=True):
            if weight[i, j] > 0:
                who[j] = first + i
        expected += who.tolist()
    assert mapped_people(pairs).tolist() == expected


def test_ties_among_few_pairs_are_broken_as_in_the_whole_table() -> None:
    """In some of these frames the small table of the pairs that are left has another best matching first."""
    r = np.random.default_rng(0)
    given = [np.where(r.random((8, 8)) < 0.35, r.integers(1, 9, (8, 8)) / 8, 0.0) for _ in range(300)]
    pairs = pairs_of(given)
    chosen = np.flatnonzero(match_as_table(pairs, pairs.s))
    expected = [
        (8 * k + a, 8 * k + b)
        for k, table in enumerate(given)
        for a, b in zip(*linear_sum_assignment(-table), strict=True)
        if table[a, b] > 0
    ]
    assert list(zip(pairs.i[chosen].tolist(), pairs.j[chosen].tolist(), strict=True)) == expected


@pytest.mark.parametrize(("more", "only"), [(1e-12, False), (0.0, False), (1e-7, True)])
def test_a_matching_is_the_only_best_one_if_it_is_better_by_more_than_rounding(more: float, only: bool) -> None:
    i, j = np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1])
    found = solve_rest(i, j, np.array([0.5 + more, 0.7, 0.4, 0.6]))
    assert (found is not None and found.tolist() == [True, False, False, True]) == only
