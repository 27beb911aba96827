"""`tune --adaptive` on a toy: a policy is kept only if it surely helps, and what it cannot do is said at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from scenarios.errors import InputError
from tests.processes import TOY
from tests.tuning_toys import toy_plan, tune_arguments, write_scenes
from tracking.app.cli import run
from tracking.config import Config
from tracking.parameter_space import Space
from tracking.running.policy import Policy, read_policy
from tracking.tuning import adaptive
from tracking.tuning.adaptive_search import adapted
from tracking.tuning.search import tune


def quiet(text: str) -> None:
    pass


def test_where_nothing_changes_the_constant_stays(tmp_path: Path) -> None:
    found = tune(**tune_arguments(tmp_path, objective=(), adaptive=6, trials=8), out=tmp_path / "toy.toml")
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
    found = adapted(plan, plan.base, plan.training, 6, quiet)
    assert found.policy is not None
    assert [c.scenes for c in found.comparisons] == ["validation", "one.toml", "two.toml"]
    assert all(c.verdict == "better" for c in found.comparisons)
    (tmp_path / "p.toml").write_text(found.policy.to_toml())
    again = read_policy(type(plan.base), tmp_path / "p.toml")
    assert again is not None
    assert again.as_dict()["weights"] == {"reach": {"bias": 0.5}}


def test_what_cannot_be_adapted_is_said_before_anything_is_played(tmp_path: Path) -> None:
    for more, words in (({"objective": "HOTA"}, "objective"), ({"objective": (), "adaptive": 3}, "6")):
        with pytest.raises(InputError, match=words):
            tune(**tune_arguments(tmp_path, **{"adaptive": 6, **more}))


def test_the_command_has_the_option(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, _ = write_scenes(tmp_path)
    few = ["--seeds", "0:2", "--validation", "10000:10002", "--test", "20000:20001", "--check", "none"]
    words = ["tune", TOY, "--suite", one, "--trials", "2", "--adaptive", "6", *few, "--out", str(tmp_path / "t.toml")]
    assert run(words) == 0
    assert "the constant stays" in capsys.readouterr().out
