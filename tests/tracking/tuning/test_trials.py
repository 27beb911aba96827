"""One trial after another: when one is given up, what it is then worth, what is no trial at all."""

from __future__ import annotations

import pytest

from scenarios.errors import InputError, WorkError
from tests.tuning_toys import toy_plan
from tracking.environment.episodes import Episode
from tracking.tuning.study import open_study, run_trials


class Game:
    """Plays by a formula: scenes differ much, and skipping people costs a little in each. `played`: how many."""

    def __init__(self, refused: int = 99, dies: int = -1) -> None:
        self.refused, self.dies, self.played = refused, dies, 0

    def __call__(self, sources, values, every):
        for source in sources:
            if values["skip"] == self.refused:
                yield InputError(place="skip", got=values["skip"], expected="another", remedy="none")
                return
            if self.played == self.dies:
                raise WorkError(got="a worker that died", expected="workers that finish", remedy="run again")
            self.played += 1
            value = 0.5 + 0.04 * (source.seed % 10) - 0.02 * values["skip"]
            yield Episode(source.name, source.seed, value, {"HOTA": value, "GOSPA": 1 - value}, 10, 1.0, 0.0)


def played(tmp_path, game=None, **more):
    made = toy_plan(tmp_path, **{"seeds": range(12), "trials": 12, "only": ["skip"], **more})
    told = []
    with open_study(made, None, "x") as study:
        run_trials(study, game or Game(), lambda *now: told.append(now))
        return study.records(), told


@pytest.mark.parametrize(("objective", "better"), [("HOTA", max), ("GOSPA", min)])
def test_a_trial_that_loses_everywhere_is_given_up(tmp_path, objective, better):
    """Four losses in a row are surer than p = 0.1 (1 / 16), three are not; either way up."""
    trials, _ = played(tmp_path, objective=objective)
    losing = [t for t in trials if t.params["skip"] > 0]
    assert losing
    assert {(t.pruned, t.episodes) for t in losing} == {(True, 4)}
    assert {(t.pruned, t.episodes) for t in trials if t.params["skip"] == 0} == {(False, 12)}
    assert better(t.values[0] for t in trials) == trials[0].values[0]


def test_what_was_given_up_is_worth_what_it_lost(tmp_path):
    """0.02 for each one left out, whichever four of the very different scenes it was played on."""
    trials, _ = played(tmp_path)
    for t in trials:
        assert t.values[0] == pytest.approx(trials[0].values[0] - 0.02 * t.params["skip"])


def test_with_p_zero_everything_is_played(tmp_path):
    game = Game()
    trials, _ = played(tmp_path, game, prune=0.0)
    assert not any(t.pruned for t in trials)
    assert game.played == 12 * 12


def test_scenes_come_in_another_order_in_each_trial(tmp_path):
    orders = []

    def game(sources, values, every):
        orders.append([s.seed for s in sources])
        yield from Game()(sources, values, every)

    played(tmp_path, game, trials=4)
    assert len({tuple(order) for order in orders}) == 4
    assert all(sorted(order) == list(range(12)) for order in orders)


def test_parameters_that_cannot_be_played_are_a_trial_without_value(tmp_path):
    trials, _ = played(tmp_path, Game(refused=1))
    refused = [t for t in trials if t.params["skip"] == 1]
    assert refused
    assert all(t.values == () and "expected another" in t.error and not t.pruned for t in refused)
    assert len(trials) == 12


def test_defaults_that_cannot_be_played_are_an_error(tmp_path):
    with pytest.raises(InputError, match="expected another"):
        played(tmp_path, Game(refused=0))


def test_a_score_that_no_scene_has_is_an_error(tmp_path):
    with pytest.raises(InputError, match="queue_F1 unknown in every training scene"):
        played(tmp_path, objective="queue_F1")


def test_several_goals_are_played_to_the_end(tmp_path):
    trials, _ = played(tmp_path, objective=["HOTA", "frames/s"], trials=3)
    assert {t.episodes for t in trials} == {12}
    assert all(t.values[1] == 10.0 for t in trials)


def test_progress_is_told(tmp_path):
    _, told = played(tmp_path, trials=3)
    assert [(done, total) for done, total, _ in told] == [(0, 3), (1, 3), (2, 3), (3, 3)]
    assert "best in training 0.6533" in told[-1][2]


def test_errors_of_who_plays_say_nothing_of_the_parameters(tmp_path):
    """The search ends; going on plays the trial that was interrupted again, and finds what it would have found."""
    made = toy_plan(tmp_path, seeds=range(12), trials=6, only=["skip"])
    with open_study(made, tmp_path / "j", "x") as study, pytest.raises(WorkError, match="a worker that died"):
        run_trials(study, Game(dies=20), lambda *now: None)
    with open_study(made, tmp_path / "j", "x") as study:
        begun = study.trials()
        assert [t.state.name for t in begun][-1] == "RUNNING"
        assert 0 < len(study.records()) < len(begun)
        run_trials(study, Game(), lambda *now: None)
        found = study.records()
    undisturbed, _ = played(tmp_path, trials=6)
    assert found == undisturbed
    assert not any(t.error for t in found)


@pytest.mark.slow
def test_a_trial_that_others_took_as_left_is_theirs(tmp_path):
    """Without a journal nobody knows who is at work: of two processes one may play what the other is at, too."""
    made, url = toy_plan(tmp_path, seeds=range(12), trials=2, only=["skip"]), f"sqlite:///{tmp_path}/s.db"

    def interrupted(sources, values, every):
        for k, answer in enumerate(Game()(sources, values, every)):
            if k == 5 and not others:
                with open_study(made, url, "x") as other:
                    others.append(other.ask(retry_unfinished=True))
                    run_trials(other, Game(), lambda *now: None)
            yield answer

    others = []
    with open_study(made, url, "x") as study:
        run_trials(study, interrupted, lambda *now: None)
        assert len(study.records()) >= 2
        assert not any(t.error for t in study.records())
