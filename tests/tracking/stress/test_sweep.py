"""Sweeps over an axis: breaking points that are known by construction, placing of values, the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from tracking.episodes.parallel_episodes import EpisodeTask
from tracking.episodes.sources import Source
from tracking.episodes.tuned_tracker import TunedTracker
from tracking.stress.axes import AXES, parse_axes, parse_axis
from tracking.stress.breaking_points import NEVER, breaking_point, crossing, frontier, shares
from tracking.stress.scene_player import Outcome, Store, Tasks
from tracking.stress.sweep import Plan, Sweep

WAY = np.linspace(0, 1, 9)


def scenes(truth: float, count: int, seed: int) -> np.ndarray:
    """Scores (P, 9) of scenes whose mean curve is 1 up to 0.2 and falls to 0.5 at `truth`."""
    rng = np.random.default_rng(seed)
    mean = np.interp(WAY, [0, 0.2, truth, 1], [1, 1, 0.5, 0.3])
    return mean * (1 + 0.1 * rng.standard_normal((count, 1))) + 0.05 * rng.standard_normal((count, len(WAY)))


@pytest.mark.parametrize(
    ("height", "where"),
    [([1.0, 0.5, -0.5], 0.75), ([1.0, 0.5, 0.2], NEVER), ([0.0, 1, 1], 0.0), ([1.0, np.nan, -1], 0.5)],
)
def test_crossing(height: list[float], where: float) -> None:
    assert crossing(np.array([0.0, 0.5, 1.0]), np.array(height)) == pytest.approx(where)


def test_intervals_hold_the_breaking_point() -> None:
    inside = 0
    for seed in range(100):
        point = breaking_point(WAY, scenes(0.625, 24, seed), 0.5)
        inside += point.low <= 0.625 <= point.high
    assert inside >= 90


def test_intervals_of_four_scenes_hold_the_breaking_point() -> None:
    """Each scene breaks at a place of its own."""
    way, inside = np.linspace(0, 1, 65), 0
    for seed in range(100):
        places = np.random.default_rng(seed).normal(0.5, 0.06, 4)
        scores = np.stack([np.interp(way, [place - 0.2, place + 0.2], [1, 0]) for place in places])
        point = breaking_point(way, scores, 0.5)
        inside += point.low <= 0.5 <= point.high
    assert inside >= 90


def test_one_scene_gives_no_interval() -> None:
    point = breaking_point(WAY, scenes(0.66, 1, 0), 0.5)
    assert (point.low, point.high) == (0, NEVER)
    assert 0 < point.at < 1


def test_no_break() -> None:
    point = breaking_point(WAY, np.ones((8, 9)), 0.5)
    assert point.at == point.low == point.high == NEVER
    assert breaking_point(WAY, np.zeros((8, 9)), 0.5).at == NEVER


def test_shares_of_one_oracle_for_all_are_scores() -> None:
    """With an oracle of 1 everywhere both measures are one, with the same interval."""
    scores = scenes(0.625, 12, 0)
    by_score, by_share = (breaking_point(WAY, scores, 0.5, best) for best in (None, np.ones_like(scores)))
    assert by_score == by_share
    assert shares(scores, np.ones_like(scores))[0] == pytest.approx(scores.mean(axis=0))


def detected(way: np.ndarray, slope: float, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Scores (P, V) of a tracker that loses `slope` of the oracle's score on the way from easy to hard, and the oracle,
    which loses half of its own. A scene is as hard for both."""
    hard = 1 + 0.2 * np.random.default_rng(seed).standard_normal((count, 1))
    oracle = 0.9 * (1 - 0.5 * way) * hard
    return oracle * 0.8 * (1 - slope * way), oracle


def test_both_measures_of_a_known_law() -> None:
    """By share 1 - slope x = 0.8; by score (1 - x / 2) (1 - slope x) = 0.8."""
    way = np.linspace(0, 1, 401)
    scores, oracle = detected(way, 0.4, 12)
    by_share, by_score = (breaking_point(way, scores, 0.8, best) for best in (oracle, None))
    assert by_share.at == pytest.approx(0.2 / 0.4)
    assert by_score.at == pytest.approx((0.9 - np.sqrt(0.9**2 - 4 * 0.2 * 0.2)) / 0.4, abs=1e-4)
    assert breaking_point(way, oracle, 0.8).at == pytest.approx(0.2 / 0.5)
    assert by_share.high - by_share.low < 0.01, "scenes that are hard for tracker and oracle alike do not count"


def test_two_trackers_that_the_score_does_not_tell_apart() -> None:
    """Equal to 80 % of the easy score, within 0.001 of detection; the detector's loss is all but the whole of it."""
    way = np.linspace(0, 1, 101)
    oracle = 1 - 0.55 * way
    share = [np.interp(way, [0, 0.3, 0.75, 1], [1, 0.966, end, end - 0.2]) for end in (0.8, 0.72)]
    jitter = 1 + 0.1 * np.random.default_rng(1).standard_normal((12, 1))
    both = np.tile(oracle, (12, 1)) * jitter
    first, second = (both * one for one in share)
    by_score = [breaking_point(way, one, 0.8).at for one in (first, second)]
    by_share = [breaking_point(way, one, 0.8, both) for one in (first, second)]
    assert by_score[0] == pytest.approx(by_score[1], abs=0.002)
    assert by_share[0].at == pytest.approx(0.75)
    assert by_share[1].at == pytest.approx(0.3 + 0.45 * (0.966 - 0.8) / (0.966 - 0.72), abs=1e-3)
    assert by_share[1].high < by_share[0].low


def test_intervals_of_shares_hold_the_breaking_point() -> None:
    inside = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        scores, oracle = detected(way := np.linspace(0, 1, 65), 0.4, 8, seed)
        scores = scores * (1 + 0.05 * rng.standard_normal((8, 1))) + 0.03 * rng.standard_normal(scores.shape)
        point = breaking_point(way, scores, 0.8, oracle)
        inside += point.low <= 0.5 <= point.high
    assert inside >= 185


def test_where_the_oracle_is_zero_or_unknown_there_is_no_share() -> None:
    oracle = np.tile([1.0, 0.5, 0.0, np.nan], (8, 1))
    scores = np.tile([1.0, 0.5, 0.0, 0.0], (8, 1))
    way = np.linspace(0, 1, 4)
    assert np.array_equal(shares(scores, oracle)[0], [1, 1, np.nan, np.nan], equal_nan=True)
    assert breaking_point(way, scores, 0.8, oracle).at == NEVER, "0 of 0 is no break"
    assert breaking_point(way, scores, 0.8).at == pytest.approx(0.4 / 3)
    assert breaking_point(way, scores[:, ::-1], 0.8, oracle[:, ::-1]).at == NEVER


def test_a_scene_without_oracle_counts_on_neither_side() -> None:
    scores, oracle = detected(WAY, 0.4, 8)
    more = np.vstack([scores, np.zeros((1, len(WAY)))]), np.vstack([oracle, np.full((1, len(WAY)), np.nan)])
    assert breaking_point(WAY, more[0], 0.8, more[1]) == breaking_point(WAY, scores, 0.8, oracle)


def test_frontier_of_a_known_law() -> None:
    """The share is 1 - x - y over two axes: 0.8 at x + y = 0.2."""
    x, y = np.meshgrid(np.linspace(0, 0.4, 5), np.linspace(0, 0.4, 5), indexing="ij")
    rng = np.random.default_rng(0)
    oracle = (0.9 - 0.3 * x - 0.5 * y).ravel() * (1 + 0.1 * rng.standard_normal((12, 1)))
    scores = oracle * (1 - x - y).ravel() + 0.005 * rng.standard_normal(oracle.shape)
    found = frontier(np.linspace(0, 1, 5), scores, oracle, 0.8)
    true = 1 - x - y - 0.8
    assert (found.sides[true > 0.05] == 1).all()
    assert (found.sides[true < -0.05] == -1).all()
    assert (found.sides[abs(true) < 1e-9] == 0).all()
    assert found.points[0].at == pytest.approx(0.5, abs=0.03)
    assert found.points[1].low <= 0.25 <= found.points[1].high
    few = frontier(np.linspace(0, 1, 5), scores[:5], oracle[:5], 0.8)
    assert not few.sides.any(), "fewer than 6 scenes decide nothing"


@pytest.mark.parametrize("text", ["nothing", "detection=1", "detection=a:b", "detection=1:1", "sensor.x=1:2:3"])
def test_wrong_axes(text: str) -> None:
    with pytest.raises(InputError, match="--vary"):
        parse_axis(text)


@pytest.mark.parametrize("name", AXES)
def test_every_axis_sets_keys_of_a_scenario(name: str) -> None:
    axis = AXES[name]
    easy, hard = (load("merge", set=axis.settings(value)) for value in (axis.easy, axis.hard))
    assert easy.model_dump() != hard.model_dump()


def test_values_of_an_axis() -> None:
    assert parse_axis("detection=1:0.6").spread(5) == pytest.approx([1, 0.9, 0.8, 0.7, 0.6])
    people = parse_axis("people=1:4")
    assert people.spread(5) == [1, 2, 3, 4]
    assert people.between(1, 2) is None
    assert parse_axis("sensor.clutter_rate=0.0:4.0").settings(2.5) == [("sensor.clutter_rate", 2.5)]


SMALL = ("duration=4", "group.a.size=2")


def sweep_of(
    score: Callable[[Source], float], tmp_path: Path, seen: list[EpisodeTask], oracle: float = 1.0, **given
) -> Sweep:
    """A sweep whose tracker has this score in a scene; it simulates nothing but one scene."""

    def play(scenes: Sequence[Tasks]):
        for tasks in scenes:
            seen.extend(task for task in tasks if isinstance(task, EpisodeTask))
            yield [Outcome({"HOTA": score(t.source) if isinstance(t, EpisodeTask) else oracle}) for t in tasks]

    plan = Plan(by="HOTA", detections="file", **given)
    return Sweep(plan, {"t": TunedTracker("blob", "t", ("points",))}, play, Store(tmp_path / "e.jsonl"))


def sweep(tmp_path: Path, seen: list[EpisodeTask], **changes) -> Sweep:
    """A sweep whose tracker falls from 1 at detection 0.8 to 0.5 at 0.62."""

    def score(source: Source) -> float:
        x = source.entry.scenario.sensor.detect_prob
        noise = 0.1 * np.random.default_rng(source.seed).standard_normal()
        return float(np.interp(x, [0.4, 0.62, 0.8, 1], [0.3, 0.5, 1, 1]) * (1 + noise))

    given = {
        "scenarios": ("cross",), "axes": parse_axes(["detection"]), "seeds": tuple(range(64)), "start": 8,
        "share": 0.5, "settings": SMALL, "episodes": 400, **changes,
    }  # fmt: skip
    return sweep_of(score, tmp_path, seen, **given)


def test_values_are_placed_where_the_curve_breaks(tmp_path: Path) -> None:
    made = sweep(tmp_path, [])
    made.run()
    point = made.breaks()["t"]
    at, low, high = (1 - 0.6 * share for share in (point.at, point.low, point.high))
    assert high <= 0.62 <= low
    assert at == pytest.approx(0.62, abs=0.02)
    near = [value for (value,) in made.values if abs(value - 0.62) < 0.1]
    assert len(near) > len(made.values) / 3
    assert made.played <= 400


@pytest.mark.parametrize(
    ("episodes", "stopped", "values"),
    [(60, False, [1, 0.85, 0.7, 0.625, 0.60625, 0.5875, 0.55, 0.4]), (12, True, [1, 0.7, 0.625, 0.5875, 0.55, 0.4])],
)
def test_values_halve_the_distance_in_which_all_scenes_break(episodes, stopped, values, tmp_path: Path) -> None:
    """All break at 0.62. The last distance is below 0.05 of the axis; or the budget has no episodes for a value more,
    of two seeds."""
    made = sweep(tmp_path, [], start=2, episodes=episodes, seeds=(0, 1))
    made.run_scenes = lambda scenes: (
        [Outcome({"HOTA": 0.3 + 0.7 * (t.source.entry.scenario.sensor.detect_prob > 0.62)}) for t in tasks]
        for tasks in scenes
    )
    made.run()
    assert [value for (value,) in made.values] == pytest.approx(values)
    assert (made.seeds, made.stopped, made.played) == (2, stopped, 2 * len(values))


def test_seeds_come_before_values_where_scenes_break_at_different_places(tmp_path: Path) -> None:
    made = sweep(tmp_path, [], start=4, episodes=40)

    def score(source: Source) -> float:
        place = np.random.default_rng(source.seed).normal(0.7, 0.05)
        return float(np.interp(source.entry.scenario.sensor.detect_prob, [place - 0.1, place + 0.1], [0.2, 1]))

    made.run_scenes = lambda scenes: ([Outcome({"HOTA": score(t.source)}) for t in tasks] for tasks in scenes)
    made.run()
    assert (made.seeds, len(made.values)) == (8, 5)


def test_a_sweep_goes_on_where_it_was_killed(tmp_path: Path) -> None:
    whole, first, rest = [], [], []
    complete = sweep(tmp_path / "a.jsonl", whole)
    complete.store = Store(tmp_path / "whole.jsonl")
    complete.run()
    stopped = sweep(tmp_path, first, episodes=40)
    stopped.run()
    with (tmp_path / "e.jsonl").open("a", encoding="utf-8") as file:
        file.write('{"key": "cut off')
    resumed = sweep(tmp_path, rest)
    resumed.run()
    assert len(first) + len(rest) == len(whole)
    assert resumed.rows() == complete.rows()


@pytest.mark.parametrize(("episodes", "seeds"), [(None, 2), (60, 2), (200, 8)])
def test_two_axes_are_a_grid_with_more_seeds_while_there_is_budget(episodes, seeds, tmp_path: Path) -> None:
    axes = parse_axes(["detection=1.0:0.6", "clutter=0.0:4.0"])
    made = sweep(tmp_path, seen := [], axes=axes, start=2, episodes=episodes)
    made.run()
    assert made.values == [(1 - 0.1 * i, float(k)) for i in range(5) for k in range(5)]
    assert (made.seeds, len(seen)) == (seeds, 25 * seeds)
    row = next(row for row in made.rows() if row["tracker"] == "t" and row["values"]["clutter"] == 3)
    assert f"sensor.detect_prob={row['values']['detection']:.10g}" in row["settings"]
    assert "sensor.clutter_rate=3" in row["settings"]


def test_sweeps_in_one_file_share_scenes(tmp_path: Path) -> None:
    sweep(tmp_path, [], start=2, episodes=20).run()
    made = sweep(tmp_path, seen := [], axes=parse_axes(["detection", "noise=1.0:3.0"]), start=2, episodes=None)
    made.run()
    assert len(seen) == 2 * 20
    assert len(made.rows()) == 2 * 2 * 25


def test_the_oracle_is_played_on_every_scene_and_not_counted(tmp_path: Path) -> None:
    made = sweep(tmp_path, [], episodes=40)
    made.run()
    rows = made.rows()
    assert sum(row["tracker"] == "oracle" for row in rows) == sum(row["tracker"] == "t" for row in rows) == made.played
    assert np.array_equal(made.scores("oracle"), np.ones_like(made.scores("t")))
    assert made.share_breaks().keys() == {"t"}


@pytest.mark.parametrize("axes", [["light"], ["detection", "light"]])
def test_an_axis_without_effect_is_refused(axes: list[str], tmp_path: Path) -> None:
    made = sweep(tmp_path, [], axes=parse_axes(axes))
    with pytest.raises(InputError, match="light; expected an axis that changes the scenes"):
        made.run()


def test_a_failed_episode_counts_as_zero_and_one_without_script_not(tmp_path: Path) -> None:
    made = sweep(tmp_path, [], seeds=(0, 1, 2), start=3, axes=())
    outcomes = {0: Outcome({}, failed="it hangs"), 1: Outcome({}, left_out="x"), 2: Outcome({"HOTA": 1.0})}
    made.run_scenes = lambda scenes: ([outcomes[task.source.seed] for task in tasks] for tasks in scenes)
    made.run()
    assert np.array_equal(made.scores("t")[:, 0], [0, np.nan, 1], equal_nan=True)


@pytest.mark.parametrize("line", ["[1, 2]", '{"key": "a"}'])
def test_a_file_of_somebody_else_is_refused_and_kept(line: str, tmp_path: Path) -> None:
    path = tmp_path / "e.jsonl"
    path.write_text(line)
    with pytest.raises(InputError, match=r"e\.jsonl.*expected episodes of"):
        Store(path)
    assert path.read_text() == line


@pytest.mark.parametrize(("episodes", "first"), [(400, (5, 8)), (40, (5, 4)), (16, (3, 2)), (5, (3, 1))])
def test_the_first_round_leaves_a_part_of_the_budget(episodes: int, first: tuple[int, int], tmp_path: Path) -> None:
    made = sweep(tmp_path, [], episodes=episodes)
    rounds = []
    made.run_scenes = (lambda play: lambda tasks: (rounds.append((len(made.values), made.seeds)), play(tasks))[1])(
        made.run_scenes
    )
    made.run()
    assert rounds[0] == first
    assert (made.rounds > 1) == (episodes > 5)
    assert made.played <= episodes


def test_minutes_are_kept_by_the_pace_of_episodes(tmp_path: Path, monkeypatch) -> None:
    """An episode takes 6 s: a budget of 4 minutes has 40."""
    now = [0.0]
    monkeypatch.setattr("tracking.stress.sweep.time.monotonic", lambda: now[0])
    made = sweep(tmp_path, [], episodes=None, minutes=4.0)
    made.began, play = 0.0, made.run_scenes

    def slow(scenes: Sequence[Tasks]):
        for outcome in play(scenes):
            now[0] += 6.0
            yield outcome

    made.run_scenes = slow
    made.run()
    assert 30 <= made.played <= 40
    assert now[0] <= 240
    assert made.rounds > 1


def test_an_interval_that_is_the_distance_of_two_values_is_known_as_such(tmp_path: Path) -> None:
    made = sweep(tmp_path, [], episodes=10)
    made.run()
    coarse = made.share_breaks()["t"]
    assert made.cell(coarse)
    assert made.stopped
    more = sweep(tmp_path, [], episodes=800)
    more.run()
    fine = more.share_breaks()["t"]
    assert not more.cell(fine)
    assert fine.high - fine.low < (coarse.high - coarse.low) / 2


def test_trackers_with_different_inputs_have_an_oracle_each(tmp_path: Path) -> None:
    made = sweep(tmp_path, [], episodes=40)
    made.trackers = {"a": TunedTracker("blob", "a", ("points",)), "b": TunedTracker("blob", "b", ("boxes",))}
    made.run_scenes = lambda scenes: (
        [Outcome({"HOTA": {"points": 1.0, "boxes": 0.5}[t.tracker.needs[0]]}) for t in tasks] for tasks in scenes
    )
    made.run()
    assert made.oracles == {"a": "oracle from points", "b": "oracle from boxes"}
    assert (made.scores("oracle from boxes") == 0.5).all()
    assert {row["oracle"] for row in made.rows() if row["tracker"] == "a"} == {1.0}
