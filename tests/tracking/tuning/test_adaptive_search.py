"""`tune --adaptive` on a toy: a policy is kept only if it surely helps, and what it cannot do is said at once."""

from __future__ import annotations

from pathlib import Path

import optuna
import pytest

from scenarios.errors import InputError, WorkError
from sim.types import Array
from tests.processes import TOY
from tests.tuning_toys import toy_plan, tune_arguments, write_scenes
from tracking.app.cli import run
from tracking.config import Config
from tracking.environment.env import TuningEnv
from tracking.parameter_space import Space
from tracking.running.policy import Policy, read_policy
from tracking.tuning import adaptive, adaptive_search
from tracking.tuning.adaptive import Played
from tracking.tuning.adaptive_search import Adapted, adapted
from tracking.tuning.candidates import HeldOutEvaluator
from tracking.tuning.episode_player import episode_player
from tracking.tuning.search import tune
from tracking.tuning.search_plan import SearchPlan


def adapted_toy(plan: SearchPlan) -> tuple[Adapted, int]:
    """What 6 configs give on the toy, and how many episodes of the constant were played for it."""
    given = plan.tracker, plan.detections, 1, None, plan.options.similarity
    with episode_player(*given) as play:
        evaluator = HeldOutEvaluator(plan, play, optuna.create_study())
        found = adapted(plan, plan.base, plan.training, 6, evaluator)
    return found, sum(len(stored) for stored in evaluator.study.user_attrs.values())


def test_where_nothing_changes_the_constant_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive, "FITS", adaptive.FITS[:1])
    found = tune(**tune_arguments(tmp_path, objective=(), adaptive=6, check=None), out=tmp_path / "toy.toml")
    assert found.adapted is not None
    assert found.adapted.policy is None
    assert found.adapted.line.startswith("the constant stays: ")
    assert found.adapted.line in (tmp_path / "toy.toml").read_text()
    assert not (tmp_path / "toy.policy.toml").exists()


def test_a_policy_that_surely_helps_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The defaults of the toy are bad: a policy that only lengthens its reach helps in every scene."""
    monkeypatch.setattr(adaptive, "FITS", ((1e-4, 0.2, 0.5),))

    def longer(base: Config, space: Space, *_: object) -> Policy:
        return Policy(base, 2.0, 2.0, {p.name: {"bias": 0.5} if p.name == "reach" else {} for p in space})

    monkeypatch.setattr(adaptive, "fitted_policy", longer)
    plan = toy_plan(tmp_path, objective=(), adaptive=6)
    found, played = adapted_toy(plan)
    assert found.policy is not None
    assert played == 18, "what the search has played of the constant is stored with it"
    assert [c.scenes for c in found.comparisons] == ["validation", "one.toml", "two.toml"]
    assert all(c.verdict == "better" for c in found.comparisons)
    (tmp_path / "p.toml").write_text(found.policy.to_toml())
    again = read_policy(type(plan.base), tmp_path / "p.toml")
    assert again is not None
    assert again.as_dict()["weights"] == {"reach": {"bias": 0.5}}


def test_configs_with_which_the_tracker_fails_are_left_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    real = adaptive_search.play_policy

    def picky(env: TuningEnv, policy: Policy, offset: Array | None = None) -> Played:
        if offset is not None and offset[0]:
            raise WorkError(file="toy", got="a reach that it dislikes", expected="others", remedy="none")
        return real(env, policy, offset)

    monkeypatch.setattr(adaptive_search, "play_policy", picky)
    found, _ = adapted_toy(toy_plan(tmp_path, objective=(), adaptive=6))
    assert found.line.startswith(("the constant stays: ", "the policy is kept"))

    def failing(*_: object) -> Played:
        raise WorkError(file="toy", got="all", expected="none", remedy="none")

    monkeypatch.setattr(adaptive_search, "play_policy", failing)
    found, _ = adapted_toy(toy_plan(tmp_path, objective=(), adaptive=6))
    assert found.line == "the constant stays: no policy is better in training"


def test_what_cannot_be_adapted_is_said_before_anything_is_played(tmp_path: Path) -> None:
    for more, words in (
        ({"objective": "HOTA"}, "got a search for HOTA; expected one for objective alone"),
        ({"objective": ("objective", "HOTA")}, "got a search for objective, HOTA"),
        ({"objective": (), "adaptive": 3}, "6"),
    ):
        with pytest.raises(InputError, match=words):
            tune(**tune_arguments(tmp_path, **{"adaptive": 6, **more}))


def test_with_few_validation_scenes_no_policy_is_searched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(adaptive_search, "searched_policy", None)
    found, played = adapted_toy(toy_plan(tmp_path, objective=(), adaptive=6, validation=range(10_000, 10_005)))
    expected = "with 5 validation scenes, fewer than 6, no gain is sure; give more --validation seeds"
    assert found == Adapted(None, (), f"the constant stays: {expected}")
    assert not played


def test_the_command_has_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, _ = write_scenes(tmp_path)
    few = ["--seeds", "0:2", "--validation", "10000:10002", "--test", "20000:20001", "--check", "none"]
    words = ["tune", TOY, "--suite", one, "--trials", "2", "--adaptive", "6", *few, "--out", str(tmp_path / "t.toml")]
    assert run(words) == 0
    assert "the constant stays" in capsys.readouterr().out
