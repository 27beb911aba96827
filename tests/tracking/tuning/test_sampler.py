"""Giving up: the signed-rank test beside scipy's and every way the signs could fall. Where a trial starts: mostly from
the best one of those that were played whole, never from a bad one."""

from __future__ import annotations

from collections import Counter
from itertools import product
from pathlib import Path

import numpy as np
import optuna
import pytest
from optuna.trial import TrialState, create_trial
from scipy.stats import rankdata, wilcoxon

from tests.tuning_toys import toy_plan
from tracking.tuning.sampler import PRUNED, distribution, propose, should_prune, signed_rank_p_value


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


def parents(plan, values: list[tuple[float, ...]], pruned: int = -1, count: int = 150) -> Counter[int]:
    """How often a trial started from each of the trials with these values; -1: from the defaults.

    Trial k has a reach of 1 + k / 2 m. Most new trials move it, so that their start is not known."""
    study = optuna.create_study(directions=["maximize" if goal.higher else "minimize" for goal in plan.goals])
    ranges = {p.name: distribution(p) for p in plan.space}
    for k, own in enumerate(values):
        attributes = {PRUNED: 4} if k == pruned else {}
        params = {**plan.defaults, "reach": 1 + k / 2}
        study.add_trial(create_trial(values=own, params=params, distributions=ranges, user_attrs=attributes))
    for number in range(count):
        propose(plan, study, number)
    found = [t.system_attrs["fixed_params"] for t in study.get_trials(states=(TrialState.WAITING,))]
    assert len(found) == count
    given = [plan.defaults["reach"], *(1 + k / 2 for k in range(len(values)))]
    return Counter(given.index(p["reach"]) - 1 for p in found if p["reach"] in given)


@pytest.mark.parametrize(("objective", "sign"), [("HOTA", 1), ("GOSPA", -1)])
def test_trials_start_from_the_best_three_and_mostly_from_the_first(tmp_path: Path, objective: str, sign: int) -> None:
    """The best one of all was stopped early: its value is an estimate."""
    plan = toy_plan(tmp_path, objective=objective)
    values = [(sign * value,) for value in (0.3, 0.7, 0.1, 0.9, 0.5, 0.6)]
    found = parents(plan, values, pruned=3)
    assert {*found} == {1, 5, 4}
    assert found[1] > found[5]
    assert found[1] > found[4]


def test_the_first_trials_start_from_the_defaults(tmp_path: Path) -> None:
    plan = toy_plan(tmp_path)
    assert {*parents(plan, [])} == {-1}
    assert {*parents(plan, [(0.5,)])} == {0}


def test_of_several_goals_all_trials_that_no_other_one_beats_are_starts(tmp_path: Path) -> None:
    found = parents(toy_plan(tmp_path, objective=("HOTA", "GOSPA")), [(0.9, 5.0), (0.5, 1.0), (0.4, 2.0), (0.1, 0.5)])
    assert {*found} == {0, 1, 3}
