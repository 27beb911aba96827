"""The judgement: paired differences, the front, and what is taken back."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import optuna
import pytest

from scenarios.errors import WorkError
from tests.toy_tracker import ToyConfig
from tests.tuning_toys import toy_plan, tune_arguments
from tracking.episodes.episode import Episode
from tracking.tuning.candidates import Candidate, Goal, HeldOutEvaluator, compare_episodes, pareto_front
from tracking.tuning.search import tune
from tracking.tuning.search_plan import SearchPlan


def episodes(values, key: str = "HOTA") -> list[Episode]:
    return [Episode("x", k, math.nan, {key: v} if v == v else {}, 10, 1.0) for k, v in enumerate(values)]


def test_differences_are_paired():
    """The same gain on scenes that differ much more than it: sure."""
    before = [0.1, 0.5, 0.9, 0.3, 0.7, 0.5]
    found = compare_episodes("s", Goal("HOTA"), episodes(before), episodes([v + 0.01 for v in before]))
    assert (found.before, found.after) == (pytest.approx(0.5), pytest.approx(0.51))
    assert found.low == pytest.approx(0.01)
    assert found.verdict == "better"
    other = compare_episodes("s", Goal("HOTA", False), episodes(before), episodes([v + 0.01 for v in before]))
    assert other.verdict == "worse"


def test_fewer_sequences_than_a_ranking_needs_are_not_sure():
    before = [0.1, 0.5, 0.9, 0.3, 0.7]
    found = compare_episodes("s", Goal("HOTA"), episodes(before), episodes([v + 0.01 for v in before]))
    assert found.low == pytest.approx(0.01)
    assert found.verdict == "no sure difference"


def test_front_of_two_goals():
    """One is best in each, one lies between, one is beaten; of equals the first stays."""
    goals = (Goal("HOTA"), Goal("GOSPA", False))
    points = [(0.9, 5.0), (0.5, 1.0), (0.7, 3.0), (0.6, 4.0), (0.7, 3.0)]
    kept = pareto_front([Candidate(k, ToyConfig(), (), p) for k, p in enumerate(points)], goals)
    assert [c.trial for c in kept] == [0, 2, 1]


@dataclass
class Game:
    """Plays by a formula: what each parameter is worth, and what is refused. `seen`: configs that were played."""

    worth: dict
    refused: dict = field(default_factory=dict)
    seen: list = field(default_factory=list)

    def __call__(self, sources, values, every):
        self.seen.append(dict(values))
        for source in sources:
            if any(values[name] == bad for name, bad in self.refused.items()):
                yield WorkError(got="it", expected="another", remedy="no")
                return
            value = sum(self.worth.get((name, v), 0.0) for name, v in values.items())
            yield Episode(source.name, source.seed, value, {"HOTA": value + 0.01 * (source.seed % 3)}, 10, 1.0)


@pytest.fixture
def made(tmp_path) -> SearchPlan:
    return toy_plan(tmp_path)


def test_what_brings_nothing_is_taken_back(made):
    """`skip` costs, `colour` brings nothing, `reach` brings all."""
    game = Game({("reach", 1.0): 0.5, ("skip", 3): -0.1})
    winner = ToyConfig(reach=1.0, skip=3, colour="green")
    kept, value = HeldOutEvaluator(made, game, optuna.create_study()).simplified(
        winner, 0.4 + 0.01 - 1e-9, ["colour", "skip", "reach", "forbidden"]
    )
    assert kept == ToyConfig(reach=1.0)
    assert value == pytest.approx(0.5 + 0.01 * (1 + 2 + 0 + 1 + 2 + 0) / 6)
    assert len(game.seen) == 3, "what is at its default is not tried"


def test_who_cannot_be_played_on_validation_scenes_is_out(made):
    game = Game({}, refused={"skip": 3})
    candidates = [Candidate(0, ToyConfig(), (0.1,)), Candidate(4, ToyConfig(skip=3), (0.9,))]
    assert [c.trial for c in HeldOutEvaluator(made, game, optuna.create_study()).validated(candidates)] == [0]
    with pytest.raises(WorkError):
        HeldOutEvaluator(made, game, optuna.create_study()).validated(candidates[::-1])


def test_a_winner_that_fails_on_test_scenes_is_told(made):
    game = Game({}, refused={"skip": 3})
    found, notes = HeldOutEvaluator(made, game, optuna.create_study()).compared(ToyConfig(skip=3))
    assert found == []
    assert [note.partition(":")[0] for note in notes] == ["one.toml", "two.toml"]


def test_the_same_command_again_plays_nothing(tmp_path, monkeypatch):
    given = tune_arguments(tmp_path, trials=5)
    first = tune(**given, out=tmp_path / "toy.toml")
    content = (tmp_path / "toy.json").read_bytes()

    def never(*_):
        raise AssertionError("an episode was played")

    monkeypatch.setattr("tracking.tuning.episode_player.stepped", never)
    assert str(tune(**given, out=tmp_path / "toy.toml")) == str(first)
    assert (tmp_path / "toy.json").read_bytes() == content
