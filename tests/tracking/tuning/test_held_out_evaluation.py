"""The judgement: paired differences, the front, and what is taken back."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import pytest

from scenarios.errors import WorkError
from tests.toy_tracker import ToyConfig
from tests.tuning_toys import toy_plan, tune_arguments
from tracking.environment.episodes import Episode
from tracking.tuning import tune
from tracking.tuning.comparison import Candidate, Goal, compare_episodes, pareto_front
from tracking.tuning.search import HeldOutEvaluator, stored_in_study
from tracking.tuning.search_plan import SearchPlan
from tracking.tuning.study import open_study


def episodes(values, key: str = "HOTA") -> list[Episode]:
    return [Episode("x", k, math.nan, {key: v} if v == v else {}, 10, 1.0, 0.0) for k, v in enumerate(values)]


def test_differences_are_paired():
    """The same gain on scenes that differ much more than it: sure."""
    before = [0.1, 0.5, 0.9, 0.3, 0.7]
    found = compare_episodes("s", Goal("HOTA"), episodes(before), episodes([v + 0.01 for v in before]))
    assert (found.before, found.after) == (pytest.approx(0.5), pytest.approx(0.51))
    assert found.low == pytest.approx(0.01)
    assert found.verdict == "better"
    other = compare_episodes("s", Goal("HOTA", False), episodes(before), episodes([v + 0.01 for v in before]))
    assert other.verdict == "worse"


def test_a_difference_of_either_sign_is_not_sure():
    found = compare_episodes("s", Goal("HOTA"), episodes([0.5] * 4), episodes([0.4, 0.6, 0.45, 0.6]))
    assert found.verdict == "no sure difference"
    assert found.low < 0 < found.high


def test_pairs_that_are_not_known_are_left_out():
    found = compare_episodes("s", Goal("HOTA"), episodes([0.5, math.nan, 0.5]), episodes([0.6, 0.9, math.nan]))
    assert (found.sequences, found.before, found.after) == (1, 0.5, 0.6)
    assert compare_episodes("s", Goal("HOTA"), episodes([math.nan]), episodes([0.6])) is None


def test_front_of_two_goals():
    """One is best in each, one lies between, one is beaten; of equals the first stays."""
    goals = (Goal("HOTA"), Goal("GOSPA", False))
    points = [(0.9, 5.0), (0.5, 1.0), (0.7, 3.0), (0.6, 4.0), (0.7, 3.0)]
    kept = pareto_front([Candidate(k, ToyConfig(), (), p) for k, p in enumerate(points)], goals)
    assert [c.trial for c in kept] == [0, 2, 1]


def test_a_candidate_without_a_value_is_not_in_the_front():
    goals, nan = (Goal("HOTA"), Goal("GOSPA", False)), math.nan
    points = [(nan, 0.1), (0.9, 5.0), (0.99, nan), (0.5, 6.0), (nan, nan)]
    for order in (points, points[::-1]):
        kept = pareto_front([Candidate(k, ToyConfig(), (), p) for k, p in enumerate(order)], goals)
        assert [c.validation for c in kept] == [(0.9, 5.0)]
    assert pareto_front([Candidate(0, ToyConfig(), (), (nan, 1.0))], goals) == []


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
            yield Episode(source.name, source.seed, value, {"HOTA": value + 0.01 * (source.seed % 3)}, 10, 1.0, 0.0)


@pytest.fixture
def made(tmp_path) -> SearchPlan:
    return toy_plan(tmp_path)


def test_what_brings_nothing_is_taken_back(made):
    """`skip` costs, `colour` brings nothing, `reach` brings all."""
    game = Game({("reach", 1.0): 0.5, ("skip", 3): -0.1})
    winner = ToyConfig(reach=1.0, skip=3, colour="green")
    kept, value = HeldOutEvaluator(made, game).simplified(winner, 0.4 + 0.01, ["colour", "skip", "reach", "forbidden"])
    assert kept == ToyConfig(reach=1.0)
    assert value == pytest.approx(0.5 + 0.01 * (1 + 2 + 0 + 1) / 4)
    assert len(game.seen) == 3, "what is at its default is not tried"


def test_a_default_that_is_refused_beside_the_rest_stays_away(made):
    game = Game({}, refused={"skip": 0})
    kept, value = HeldOutEvaluator(made, game).simplified(ToyConfig(skip=3), 0.2, ["skip"])
    assert (kept, value) == (ToyConfig(skip=3), 0.2)


def test_validation_is_beside_the_defaults(made):
    game = Game({("reach", 1.0): 0.5})
    candidates = [Candidate(0, ToyConfig(), (0.1,)), Candidate(4, ToyConfig(reach=1.0), (0.9,))]
    first, second = HeldOutEvaluator(made, game).validated(candidates)
    assert first.gain.difference == 0.0
    assert second.gain.difference == pytest.approx(0.5)
    assert second.gain.verdict == "better"
    assert second.training == (0.9,)


def test_who_cannot_be_played_on_validation_scenes_is_out(made):
    game = Game({}, refused={"skip": 3})
    candidates = [Candidate(0, ToyConfig(), (0.1,)), Candidate(4, ToyConfig(skip=3), (0.9,))]
    assert [c.trial for c in HeldOutEvaluator(made, game).validated(candidates)] == [0]
    with pytest.raises(WorkError):
        HeldOutEvaluator(made, game).validated(candidates[::-1])


def test_errors_of_who_plays_say_nothing_of_the_parameters(made):
    """They end the judgement; nobody is out, kept or noted for them."""

    def lost(sources, values, every):
        if values["skip"] == 3:
            raise WorkError(got="a lost connection", expected="a scheduler that stays", remedy="run again")
        yield from Game({})(sources, values, every)

    judge, winner = HeldOutEvaluator(made, lost), ToyConfig(skip=3, colour="green")
    for judged in (
        lambda: judge.validated([Candidate(0, ToyConfig(), (0.1,)), Candidate(4, winner, (0.9,))]),
        lambda: judge.simplified(winner, 0.2, ["colour"]),
        lambda: judge.compared(winner),
    ):
        with pytest.raises(WorkError, match="a lost connection"):
            judged()


def test_a_winner_that_fails_on_test_scenes_is_told(made):
    game = Game({}, refused={"skip": 3})
    found, notes = HeldOutEvaluator(made, game).compared(ToyConfig(skip=3))
    assert found == []
    assert [note.partition(":")[0] for note in notes] == ["one.toml", "two.toml"]


class CountingGame:
    """`played`: episodes so far."""

    def __init__(self) -> None:
        self.played = 0

    def __call__(self, sources, values, every):
        for s in sources:
            self.played += 1
            if values.get("skip") == 4:
                yield WorkError(got="it", expected="another", remedy="none")
                return
            scores = {"HOTA": 0.1 + 0.2, "MOTA": 0.5, "objective": 0.5}
            yield Episode(s.name, s.seed, math.nan, scores, 7, 1 / 3, 0.1)


def test_each_set_is_played_once(tmp_path):
    made, game = toy_plan(tmp_path), CountingGame()
    for _ in range(2):
        with open_study(made, tmp_path / "j", "x") as study:
            play = stored_in_study(study, game)
            first = list(play(made.validation, {"skip": 1}, False))
            assert str(list(play(made.validation, {"skip": 1}, False))) == str(first)
            assert [(e.seed, e.frames, e.seconds_tracking) for e in first] == [
                (s.seed, 7, 1 / 3) for s in made.validation
            ]
            assert first[0].scores == {"HOTA": 0.1 + 0.2, "objective": 0.5}, "what is not compared is not kept"
        assert game.played == len(made.validation)
    with open_study(made, tmp_path / "j", "x") as study:
        play = stored_in_study(study, game)
        for sources, values, every in (
            (made.validation, {"skip": 2}, False),
            (made.validation, {"skip": 1}, True),
            (made.training, {"skip": 1}, False),
        ):
            before = game.played
            list(play(sources, values, every))
            assert game.played == before + len(sources)


def test_what_failed_or_was_not_wanted_to_the_end_is_forgotten(tmp_path):
    made, game = toy_plan(tmp_path), CountingGame()
    with open_study(made, None, "x") as study:
        play = stored_in_study(study, game)
        for _ in range(2):
            assert isinstance(next(play(made.validation, {"skip": 4}, False)), WorkError)
            assert isinstance(next(play(made.validation, {"skip": 1}, False)), Episode)
    assert game.played == 4


def test_the_same_command_again_plays_nothing(tmp_path, monkeypatch):
    given = tune_arguments(tmp_path, trials=5)
    first = tune(**given, out=tmp_path / "toy.toml")
    content = (tmp_path / "toy.json").read_bytes()

    def never(*_):
        raise AssertionError("an episode was played")

    monkeypatch.setattr("tracking.tuning.parallel_episodes._attempt", never)
    assert str(tune(**given, out=tmp_path / "toy.toml")) == str(first)
    assert (tmp_path / "toy.json").read_bytes() == content
