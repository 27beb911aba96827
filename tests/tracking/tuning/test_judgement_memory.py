"""What was judged is not played twice, and comes back as it was."""

from __future__ import annotations

import math

from scenarios.errors import WorkError
from tests.tuning_toys import wishes
from tracking.environment.episodes import Episode
from tracking.tuning import tune
from tracking.tuning.judgement_memory import remembering
from tracking.tuning.search_plan import plan
from tracking.tuning.study import opened


class Game:
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
    made, game = plan(**wishes(tmp_path)), Game()
    for _ in range(2):
        with opened(made, tmp_path / "j", "x") as study:
            play = remembering(study, game)
            first = list(play(made.validating, {"skip": 1}, False))
            assert str(list(play(made.validating, {"skip": 1}, False))) == str(first)
            assert [(e.seed, e.frames, e.seconds_tracking) for e in first] == [
                (s.seed, 7, 1 / 3) for s in made.validating
            ]
            assert first[0].scores == {"HOTA": 0.1 + 0.2, "objective": 0.5}, "what is not compared is not kept"
        assert game.played == len(made.validating)
    with opened(made, tmp_path / "j", "x") as study:
        play = remembering(study, game)
        for sources, values, every in (
            (made.validating, {"skip": 2}, False),
            (made.validating, {"skip": 1}, True),
            (made.training, {"skip": 1}, False),
        ):
            before = game.played
            list(play(sources, values, every))
            assert game.played == before + len(sources)


def test_what_failed_or_was_not_wanted_to_the_end_is_forgotten(tmp_path):
    made, game = plan(**wishes(tmp_path)), Game()
    with opened(made, None, "x") as study:
        play = remembering(study, game)
        for _ in range(2):
            assert isinstance(next(play(made.validating, {"skip": 4}, False)), WorkError)
            assert isinstance(next(play(made.validating, {"skip": 1}, False)), Episode)
    assert game.played == 4


def test_the_same_command_again_plays_nothing(tmp_path, monkeypatch):
    given = wishes(tmp_path, trials=5)
    first = tune(**given, out=tmp_path / "toy.toml")
    content = (tmp_path / "toy.json").read_bytes()

    def never(*_):
        raise AssertionError("an episode was played")

    monkeypatch.setattr("tracking.tuning.parallel_episodes._attempt", never)
    assert str(tune(**given, out=tmp_path / "toy.toml")) == str(first)
    assert (tmp_path / "toy.json").read_bytes() == content
