"""Giving up: the signed-rank test beside scipy's and beside every way the signs could fall."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.stats import rankdata, wilcoxon

from tracking.tuning.sampler import should_prune, signed_rank_p_value


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


def test_only_a_sure_loss_on_two_scenes_stops():
    assert not should_prune([-1.0] * 3, 0.1)
    assert should_prune([-1.0] * 4, 0.1)
    assert not should_prune([-1.0] * 4, 0.0)
    assert not should_prune([-1.0], 0.9)
    assert not should_prune([-1.0] * 6 + [9.0], 0.5)
