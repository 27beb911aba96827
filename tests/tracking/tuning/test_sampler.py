"""Where a trial starts: mostly from the best one, never from a bad one."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import optuna
import pytest
from optuna.trial import TrialState, create_trial

from tests.tuning_toys import toy_plan
from tracking.tuning.sampler import distribution, propose


def parents(plan, values: list[tuple[float, ...]], count: int = 150) -> Counter[int]:
    """How often a trial started from each of the trials with these values; -1: from the defaults.

    Trial k has a reach of 1 + k / 2 m. Most new trials move it, so that their start is not known."""
    study = optuna.create_study(directions=["maximize" if goal.higher else "minimize" for goal in plan.goals])
    ranges = {p.name: distribution(p) for p in plan.space}
    for k, own in enumerate(values):
        params = {**plan.defaults, "reach": 1 + k / 2}
        study.add_trial(create_trial(values=own, params=params, distributions=ranges))
    for number in range(count):
        propose(plan, study, number)
    found = [t.system_attrs["fixed_params"] for t in study.get_trials(states=(TrialState.WAITING,))]
    assert len(found) == count
    given = [plan.defaults["reach"], *(1 + k / 2 for k in range(len(values)))]
    return Counter(given.index(p["reach"]) - 1 for p in found if p["reach"] in given)


@pytest.mark.parametrize(("objective", "sign"), [("HOTA", 1), ("GOSPA", -1)])
def test_trials_start_from_the_best_three_and_mostly_from_the_first(tmp_path: Path, objective: str, sign: int) -> None:
    plan = toy_plan(tmp_path, objective=objective)
    values = [(sign * value,) for value in (0.3, 0.7, 0.1, 0.2, 0.5, 0.6)]
    found = parents(plan, values)
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
