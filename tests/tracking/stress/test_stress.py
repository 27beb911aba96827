"""Sweeps over an axis: breaking points that are known by construction, placing of values, the store."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load
from tracking.environment.episode_cache import Source
from tracking.stress.axes import AXES, NEVER, breaking_point, crossing, parse_axes, parse_axis
from tracking.stress.scene_player import Outcome, Store, Tasks
from tracking.stress.sweep import Plan, Sweep
from tracking.tuning.parallel_episodes import EpisodeTask
from tracking.tuning.tuned_tracker import TunedTracker

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
    assert parse_axis("sensor.clutter_rate=0.0:4.0").settings(2.5) == ["sensor.clutter_rate=2.5"]


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
    sweep(tmp_path, [], start=2, episodes=10).run()
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
    assert made.breaks().keys() == {"t"}


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
