"""The study: parameters in their own units, what is tried by seed alone, a journal that survives anything."""

from __future__ import annotations

import math
import os
import subprocess
import sys

import pytest
from optuna.distributions import CategoricalDistribution, FloatDistribution, IntDistribution
from optuna.trial import TrialState

from scenarios.errors import InputError
from sim.hashing import runtime
from tests.processes import ROOT
from tests.tuning_toys import toy_plan
from tracking.grouping.link_rule import LinkRule
from tracking.papers.blob.config import BlobConfig
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.tuning.sampler import distribution
from tracking.tuning.study import FINISHED, StudyLocks, open_study


def test_distributions_are_the_declarations(tmp_path):
    space = {p.name: distribution(p) for p in toy_plan(tmp_path).space}
    assert space == {
        "reach": FloatDistribution(0.05, 5.0, log=True),
        "skip": IntDistribution(0, 4),
        "colour": CategoricalDistribution(("red", "green")),
        "forbidden": FloatDistribution(0.0, 1.0),
    }


@pytest.mark.parametrize("kind", [BlobConfig, GroupPdaConfig, LinkRule])
def test_every_default_can_be_tried(kind):
    """And both ends, unless the config refuses them together with the other defaults."""
    for p in kind.space():
        made = distribution(p)
        assert made._contains(made.to_internal_repr(getattr(kind(), p.name))), p.name
        if p.scale == "log":
            assert p.low > 0
        if p.scale != "categorical":
            assert math.isfinite(p.low)
            assert math.isfinite(p.high)


def tried(folder, count: int, **more) -> list[dict]:
    with open_study(toy_plan(folder, trials=count, **more), None, "x") as study:
        while (asked := study.ask()) is not None:
            possible = asked.params["forbidden"] <= 0.5
            study.tell(asked, [asked.params["reach"] - asked.params["skip"]] if possible else None)
        return [t.params for t in study.finished()]


def test_what_is_tried_follows_from_the_seed(tmp_path):
    assert tried(tmp_path, 14) == tried(tmp_path, 14)
    assert tried(tmp_path, 14)[1:] != tried(tmp_path, 14, seed=5)[1:]


def test_a_trial_moves_few_parameters_of_the_best(tmp_path):
    """The defaults, then three changes on the mean."""
    with open_study(toy_plan(tmp_path, tracker="blob", trials=24), None, "x") as study:
        while (asked := study.ask()) is not None:
            study.tell(asked, [0.5 if asked.number == 0 else 0.4])
        first, *others = (t.params for t in study.finished())
    moved = [sum(params[name] != first[name] for name in params) for params in others]
    assert min(moved) >= 1
    assert 2 <= sum(moved) / len(moved) <= 7


def test_a_trial_that_failed_does_not_end_the_climb(tmp_path):
    with open_study(toy_plan(tmp_path, tracker="blob", trials=6), None, "x") as study:
        study.tell(study.ask(), [0.5])
        study.optuna.tell(study.ask().number, state=TrialState.FAIL)
        first, second = study.trials()[0], study.ask()
        assert sum(first.params[name] != value for name, value in second.params.items()) < len(first.params) / 2


@pytest.mark.parametrize("goals", ["HOTA", ("HOTA", "GOSPA")])
def test_killed_between_two_parameters(tmp_path, goals):
    made = toy_plan(tmp_path, trials=12, objective=goals)

    def trials(path):
        with open_study(made, path, "x") as study:
            while (asked := study.ask()) is not None:
                study.tell(asked, [asked.params["reach"], asked.params["skip"]][: len(made.goals)])
            return study.records()

    whole = trials(tmp_path / "whole")
    lines = (tmp_path / "whole").read_bytes().splitlines(keepends=True)
    (tmp_path / "cut").write_bytes(b"".join(lines[:-3]))
    assert trials(tmp_path / "cut") == whole


def test_killed_between_two_lines(tmp_path):
    """However much of the journal was written: the study opens, and ends with as many trials as are wanted."""
    made = toy_plan(tmp_path, trials=2)
    with open_study(made, tmp_path / "whole", "x") as study:
        while (asked := study.ask()) is not None:
            study.tell(asked, [0.5])
    text = (tmp_path / "whole").read_bytes()
    for k in range(0, len(text), 397):
        path = tmp_path / f"cut-{k}"
        path.write_bytes(text[:k])
        with open_study(made, path, "x") as study:
            while (asked := study.ask()) is not None:
                study.tell(asked, [0.5])
            told = study.records()
            assert len(told) == 2, k
            assert told[0].params == made.defaults
            assert sum(t.state in FINISHED for t in study.trials()) == 2


@pytest.mark.parametrize("content", [b"tracker = 'blob'", b'{"seed": 1}', b"\x00\x01"])
def test_another_file_is_left_as_it_is(tmp_path, content):
    path = tmp_path / "precious"
    path.write_bytes(content)
    with pytest.raises(InputError, match="no journal") as caught, open_study(toy_plan(tmp_path), path, "x"):
        pass
    assert "--storage" in str(caught.value)
    assert path.read_bytes() == content


def test_a_lock_lives_as_long_as_its_process(tmp_path):
    path = tmp_path / "locks"
    hold = (
        "import sys; from pathlib import Path; from tracking.tuning.study import StudyLocks\n"
        "locks = StudyLocks(Path(sys.argv[1])); locks.take_trial(7); print('held', flush=True); sys.stdin.read()"
    )
    other = subprocess.Popen(
        [sys.executable, "-c", hold, str(path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert other.stdout.readline() == "held\n"
    locks = StudyLocks(path)
    assert not locks.take_trial(7)
    assert locks.take_trial(8)
    other.kill()
    other.communicate()
    assert locks.take_trial(7)
    locks.close()


@pytest.mark.parametrize("what", ["sources", "numpy"])
def test_a_study_is_of_one_version(tmp_path, monkeypatch, what):
    made = toy_plan(tmp_path)
    with open_study(made, tmp_path / "j", "x") as study:
        study.tell(study.ask(), [0.1])
    other = {**runtime(), what: "another"}
    monkeypatch.setattr("tracking.tuning.search_plan.runtime", lambda: other)
    with pytest.raises(InputError, match="another search: versions differ"), open_study(made, tmp_path / "j", "x"):
        pass
