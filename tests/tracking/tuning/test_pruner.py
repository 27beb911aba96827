"""Giving up: the signed-rank test beside scipy's and beside every way the signs could fall."""

from __future__ import annotations

from itertools import product

import numpy as np
import optuna
import pytest
from scipy.stats import rankdata, wilcoxon

from tracking.tuning.sampler import SignedRankPruner, signed_rank_p_value


@pytest.mark.parametrize("seed", range(8))
def test_without_ties_it_is_scipys(seed):
    r = np.random.default_rng(seed)
    gains = r.normal(-0.3, 1.0, 3 + seed)
    assert signed_rank_p_value(gains) == pytest.approx(wilcoxon(gains, alternative="less", method="exact").pvalue)


@pytest.mark.parametrize("seed", range(8))
def test_with_ties_and_zeros_it_counts_all_signs(seed):
    d = np.random.default_rng(seed).integers(-2, 3, 8).astype(float)
    ranks = rankdata(np.abs(d))
    free = ranks[d != 0]
    sums = [np.dot(signs, free) for signs in product((0, 1), repeat=len(free))]
    assert signed_rank_p_value(d) == pytest.approx(np.mean(np.array(sums) <= ranks[d > 0].sum() + 1e-9))


def test_limits():
    assert signed_rank_p_value([0.0] * 5) == 1.0
    assert signed_rank_p_value([-1.0] * 4) == 1 / 16
    assert signed_rank_p_value([1.0] * 4) == 1.0
    assert signed_rank_p_value([-1.0] * 200) < 1e-50


def test_only_what_both_played_counts():
    """The best trial wins where both were; where it was not played, nothing is known."""
    study = optuna.create_study(direction="maximize", pruner=SignedRankPruner(0.1))
    first = study.ask()
    for k in range(6):
        first.report(0.5, k)
    assert not first.should_prune()
    study.tell(first, 0.5)
    second = study.ask()
    for k in range(10, 20):
        second.report(0.1, k)
    assert not second.should_prune()
    for k in range(3):
        second.report(0.4, k)
    assert not second.should_prune()
    second.report(0.4, 3)
    assert second.should_prune()
