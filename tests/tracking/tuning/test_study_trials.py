"""One trial after another: what it is worth, what is no trial at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from tests.tuning_toys import TOY, toy_plan, write_scenes
from tracking.episodes.episode import Episode, sources
from tracking.episodes.parallel_episodes import EpisodeTask, play_task
from tracking.episodes.tuned_tracker import tuned_tracker
from tracking.tuning.study import SETTINGS, SearchStudy, open_study, run_trials


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
            yield Episode(source.name, source.seed, value, {"HOTA": value, "GOSPA": 1 - value}, 10, 1.0)


def played(tmp_path, game=None, **more):
    made = toy_plan(tmp_path, **{"seeds": range(12), "trials": 12, "only": ["skip"], **more})
    told = []
    with open_study(made, None, "x") as study:
        run_trials(study, game or Game(), lambda *now: told.append(now))
        return study.records(), told


def test_every_trial_plays_every_scene(tmp_path):
    game = Game()
    trials, _ = played(tmp_path, game)
    assert game.played == 12 * 12
    assert all(t.values[0] == pytest.approx(0.5 + 0.04 * 46 / 12 - 0.02 * t.params["skip"]) for t in trials)


def test_parameters_that_cannot_be_played_are_a_trial_without_value(tmp_path):
    trials, _ = played(tmp_path, Game(refused=1))
    refused = [t for t in trials if t.params["skip"] == 1]
    assert refused
    assert all(t.values == () and "expected another" in t.error for t in refused)
    assert len(trials) == 12


def test_a_search_waits_for_its_defaults(tmp_path):
    """Another process may play them still, while others have played as many trials as wanted here."""
    wanted = {"seeds": range(12), "only": ["skip"]}
    with open_study(toy_plan(tmp_path, trials=4, **wanted), None, "x") as study:
        study.ask()
        for value in (0.1, 0.2, 0.3):
            study.tell(study.ask(), [value])
        own = SearchStudy(toy_plan(tmp_path, trials=3, **wanted), study.optuna, study.locks)
        run_trials(own, Game(), lambda *now: None)
        assert own.left_out() == [""] * 12
        assert own.records()[0].params == own.plan.defaults


def test_a_study_of_a_version_that_knew_more_is_refused(tmp_path):
    """It may have stopped trials early, whose values are estimates."""
    made = toy_plan(tmp_path)
    with open_study(made, tmp_path / "j", "x") as study:
        study.optuna.set_user_attr(SETTINGS, {**made.identity(), "prune": 0.1})
    with pytest.raises(InputError, match=r"prune 0\.1, not None"), open_study(made, tmp_path / "j", "x"):
        pass


UNPLAYABLE = [
    (Game(refused=0), {}, "expected another"),
    (Game(), {"objective": "queue_F1"}, "queue_F1 unknown in every training scene"),
]


@pytest.mark.parametrize(("game", "more", "words"), UNPLAYABLE)
def test_a_search_without_any_value_is_an_error(tmp_path, game, more, words):
    with pytest.raises(InputError, match=words):
        played(tmp_path, game, **more)


def test_a_worker_whose_tracker_is_another_one_ends_it_all(tmp_path: Path) -> None:
    """An answer would be taken for one about the parameters."""
    (source,) = sources(write_scenes(tmp_path)[0], (1,))
    same = tuned_tracker(TOY)
    assert play_task(EpisodeTask(same, source, {}, "file", every_score=False)).frames == 20
    with pytest.raises(WorkError, match=r"another .*toy_tracker.py:Toy than when the command began"):
        play_task(EpisodeTask(replace(same, code="another"), source, {}, "file", every_score=False))


def test_trackers_that_draw_do_so_by_the_source(tmp_path: Path) -> None:
    """Else all episodes would be tuned to one and the same luck."""
    text = Path(TOY.rpartition(":")[0]).read_text()
    lucky = text.replace("self.fps = context.fps", "self.fps, self.config = context.fps, ToyConfig(skip=seed % 5)")
    assert lucky != text
    (tmp_path / "lucky.py").write_text(lucky)
    name = f"{tmp_path / 'lucky.py'}:Toy"
    for source in sources(write_scenes(tmp_path)[0], (5, 9)):
        own, fixed = (
            play_task(EpisodeTask(tuned_tracker(name), source, {}, "file", every_score=True)),
            play_task(EpisodeTask(tuned_tracker(TOY), source, {"skip": source.seed % 5}, "file", every_score=True)),
        )
        assert own.scores == fixed.scores


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
