"""The benchmark of samplers: what an episode costs is counted once, whoever plays it; what a budget buys; and which
trials Optuna's pruner stops."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import pytest

from benchmarks import samplers
from benchmarks.samplers import METHODS, Cell, Clock, Episodes, Pruner, SpentError, report
from tests.tuning_toys import toy_plan
from tracking.episodes.episode import Episode


class Counted:
    """Plays by a formula, each episode in one second of CPU time. State: seconds, number of episodes."""

    def __init__(self, monkeypatch) -> None:
        self.seconds, self.episodes = 0.0, 0
        monkeypatch.setattr(samplers.time, "process_time", lambda: self.seconds)

    def __call__(self, sources, values, every):
        for source in sources:
            self.seconds, self.episodes = self.seconds + 1, self.episodes + 1
            value = 0.5 + 0.02 * (source.seed % 5) - 0.05 * values["skip"]
            yield Episode(source.name, source.seed, value, {"HOTA": value}, 10, 1.0)


def test_an_episode_is_played_once_and_counted_for_each_search(tmp_path, monkeypatch):
    plan, play = toy_plan(tmp_path), Counted(monkeypatch)
    episodes, source, values = Episodes(play), plan.training[0], plan.base.as_dict()
    for _ in range(2):
        clock = Clock()
        assert episodes.one(source, values, clock).seed == source.seed
        assert clock.now() == 1
    assert play.episodes == 1
    assert episodes.one(source, {**values, "skip": 4}, clock).objective < 0.5
    assert play.episodes == 2
    with pytest.raises(SpentError):
        list(episodes.until(Clock(), 2.5)(plan.training, values, False))


@pytest.mark.parametrize("method", METHODS)
def test_a_budget_buys_as_many_trials_with_every_method(tmp_path, monkeypatch, method):
    """Two training scenes and no stopping: 20 s are 10 trials, of which each better one is what a part has reached."""
    pytest.importorskip("cmaes") if method == "cma-es" else None
    plan, play = toy_plan(tmp_path, seeds=range(2), only=["skip", "reach"], set=["colour=red"]), Counted(monkeypatch)
    cell = Cell(plan, play)
    assert cell.searched("ours", 10, float("inf")).seconds == 20
    found = cell.searched(method, 10**6, 20.0)
    assert found.trials == 10
    assert found.training[0] <= found.training[1] <= found.training[2]
    assert found.training[2] == pytest.approx(0.51)
    assert found.test == (found.defaults,) * 3


def test_a_part_of_the_budget_counts_the_trials_that_ended_in_it(tmp_path, monkeypatch):
    """Each trial is better than those before; of ten trials two end in a quarter of their time, five in half of it."""
    play = Counted(monkeypatch)

    def better(sources, values, every):
        for episode in play(sources, values, every):
            yield replace(episode, scores={"HOTA": play.seconds / 1000})

    cell = Cell(toy_plan(tmp_path, seeds=range(2), only=["reach"]), better)
    begun = play.seconds
    found = cell.searched("ours", 10, float("inf"))
    assert [1000 * value - begun for value in found.training] == pytest.approx([3.5, 9.5, 19.5])
    assert found.test == tuple(sorted(found.test))


LOST = [([-0.1] * 3, False), ([-0.1] * 4, True), ([0.1] * 4, False), ([0.0] * 5, False), ([-0.1] * 5 + [0.0], True)]


@pytest.mark.parametrize(("gains", "stopped"), LOST)
@pytest.mark.parametrize("objective", ["HOTA", "GOSPA"])
def test_optunas_pruner_stops_a_sure_loss(tmp_path, gains, stopped, objective):
    plan = toy_plan(tmp_path, seeds=range(6), objective=objective)
    sign = 1 if objective == "HOTA" else -1
    pruner = Pruner(plan.goals[0])

    def episodes(values):
        return {k: Episode("one", k, 0.0, {objective: value}, 1, 1.0) for k, value in enumerate(values)}

    assert not pruner.stops(episodes([0.5]))
    pruner.ended(episodes([0.5] * 6))
    assert pruner.stops(episodes([0.5 + sign * gain for gain in gains])) == stopped
    pruner.ended(episodes([0.5 - sign * 0.1] * 6))  # worse: the best one stays
    assert pruner.best == dict.fromkeys(range(6), 0.5)


def test_a_stopped_trial_has_no_value_and_costs_less(tmp_path, monkeypatch):
    play = Counted(monkeypatch)
    cell = Cell(toy_plan(tmp_path, seeds=range(6), only=["skip"]), play)
    budget = cell.searched("ours", 30, float("inf")).seconds
    found = cell.searched("ours-wilcoxon", 10**6, budget)
    assert found.trials > 30
    assert found.training[2] == pytest.approx(0.5 + 0.02 * sum(k % 5 for k in range(6)) / 6)


def test_the_tables_pair_searches(capsys):
    ours = [samplers.Searched(30, 60.0, (0.5, 0.5, 0.5), (0.5, 0.5, 0.5 + 0.01 * k), 0.4) for k in range(6)]
    other = [samplers.Searched(60, 60.0, (0.5, 0.5, 0.6), (0.5, 0.5, 0.6 + 0.01 * k), 0.4) for k in range(6)]
    report({("blob", "quick", k, 2, 30): {"ours": ours[k], "tpe": other[k]} for k in range(6)})
    lines = capsys.readouterr().out.splitlines()
    assert "| ours | +0.125 [+0.105, +0.145] * | – | – | – | – | 30 | – |" in lines
    assert lines[-1] == "| blob | 0.125 | 0.225 |"
    even, ahead = "+0.000 [+0.000, +0.000]", "+0.100 [+0.100, +0.100] *"
    more = "+30.000 [+30.000, +30.000] *"
    assert f"| tpe | +0.225 [+0.205, +0.245] * | {even} | {even} | {ahead} | {ahead} | 60 | {more} |" in lines


def test_a_run_goes_on_where_it_ended(tmp_path, monkeypatch):
    play = Counted(monkeypatch)
    monkeypatch.setattr(samplers, "cell_plan", lambda key: toy_plan(tmp_path, seeds=range(2)))
    monkeypatch.setattr(samplers, "episode_player", lambda *given: nullcontext(play))
    key, state = ("toy", "one", 0, 2, 6), tmp_path / "state.json"
    found = samplers.read(state)
    samplers.play_methods(key, ["ours", "tpe"], found, state)
    played = play.episodes
    again = samplers.read(state)
    assert again == {key: {m: replace(o, test=list(o.test), training=list(o.training)) for m, o in found[key].items()}}
    samplers.play_methods(key, ["ours", "tpe"], again, state)
    assert play.episodes == played
    ours = again[key]["ours"]
    samplers.play_methods(key, ["ours", "tpe", "random"], again, state)
    assert again[key]["ours"] is ours
    assert samplers.read(state)[key]["random"].seconds == found[key]["ours"].seconds
