"""Minimising: oracles whose smallest scene is known by construction, and one small scene end to end."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import pytest

from scenarios.errors import InputError, OrderError, WorkError
from scenarios.loading.resolve import load
from scenarios.loading.toml_files import dump
from scenarios.schema.groups import group_names
from scenarios.schema.scenario import Scenario
from scenarios.schema.values import bounds
from tests.processes import FAKE
from tests.refusals import answer, refused
from tracking.app.cli import run
from tracking.app.commands.minimize import _of_run
from tracking.app.tracker_setup import TrackerSetup
from tracking.errors import groups
from tracking.errors.people import PersonKind
from tracking.scoring.catalogue import ALL, Score
from tracking.stress.failures import Judgement, parse_failure, play_episode
from tracking.stress.minimize import STAGES, Minimizer
from tracking.stress.reductions import beginning, difficulties, people, pinned, script, without

FAILURE = parse_failure("HOTA<0.5")
Oracle = Callable[[Scenario, int], bool]


def search(fails: Oracle, seen: list[tuple[Scenario, int, int]] | None = None, **changes) -> Minimizer:
    """A search whose episodes fail as the oracle says; nothing is simulated."""

    def play(scenario: Scenario, seed: int, repeat: int) -> Judgement:
        if seen is not None:
            seen.append((scenario, seed, repeat))
        return Judgement({"HOTA": 0.4 if fails(scenario, seed) else 0.9}, people=1)

    return Minimizer(**{"play": play, "failure": FAILURE, "seed": 3, "confirm": 5, **changes})


def minimised(fails: Oracle, scenario: Scenario | None = None, **changes) -> Minimizer:
    """The search after its run, of HARD if no scenario is given."""
    made = search(fails, **changes)
    made.run(HARD if scenario is None else scenario)
    return made


def names(scenario: Scenario) -> list[str]:
    return [name for group in scenario.group for name in group_names(group)]


def needs(scenario: Scenario, seed: int) -> bool:
    """Fails with two groups, one of them of two people, clutter, misses, a pillar and 7 seconds; with nothing less."""
    sizes = {name: bounds(group.size)[1] for group in scenario.group for name in group_names(group)}
    people = sizes.get("north-1", 0) >= 1 and sizes.get("stop-4", 0) >= 2
    hard = scenario.sensor.clutter_rate > 0 and len(scenario.world.pillars) >= 1
    return people and hard and scenario.duration >= 7 and scenario.sensor.detect_prob < 1


HARD = load(
    "crowd",
    set=(
        "duration=40", "world.pillars=[[9, 9, 0.3], [5, 5, 0.4]]", "sensor.clutter_rate=2", "light.drift=0.2",
        "group.stop.size=3", "camera.tilt_deg=50",
    ),
)  # fmt: skip


def test_the_smallest_scene_is_found_and_no_single_piece_can_be_removed() -> None:
    seen: list[tuple[Scenario, int, int]] = []
    made = minimised(needs, seen=seen)
    small = made.smallest
    assert names(small) == ["stop-4", "north-1"]
    assert [group.size for group in small.group] == [2, 1]
    assert 7 <= small.duration < 8
    assert len(small.world.pillars) == 1
    assert [piece.path for piece in difficulties(small)] == [("sensor", "detect_prob"), ("sensor", "clutter_rate")]
    assert made.complete
    for stage in STAGES:
        for piece in stage(small):
            left = without(small, [piece])
            assert left in (None, small) or not needs(left, 3), piece.path
    assert len({(dump(scenario), seed) for scenario, seed, _ in seen}) == len(seen) == made.played < 400


def test_orders_go_with_their_groups() -> None:
    scenario = load("mixed")
    fixed = pinned(scenario, 3)
    assert fixed is not None
    small = without(fixed, [piece for piece in script(fixed) if piece.path == ("group", 0)])
    assert small is not None
    assert [event.id for event in small.event] == ["q1"]
    made = minimised(lambda s, seed: any(event.type == "split" for event in s.event), scenario)
    assert names(made.smallest) == ["a", "b"]
    assert [event.id for event in made.smallest.event] == ["m1", "s1"]  # without m1 there is no ab


def test_the_drawn_groups_stay_where_they_are() -> None:
    from sim.crowd.navigation import scene_of
    from sim.crowd.population import draw_population

    for name in ("crowd", "party", "street", "queue"):
        scenario = load(name)
        fixed = pinned(scenario, 5)
        assert fixed is not None
        before, after = (draw_population(s, scene_of(s.world), 5, 0) for s in (scenario, fixed))
        assert [(g.name, len(g.members)) for g in before] == [(g.name, len(g.members)) for g in after]
        for old, new in zip(before, after, strict=True):
            assert max(*abs(old.start - new.start), *abs(old.goal - new.goal)) < 0.011
            assert (old.enter, old.speed) == pytest.approx((new.enter, new.speed), abs=0.006)


def test_a_drawn_group_keeps_its_sub_groups() -> None:
    pair = "{ id = 'pair', size = { choice = [2, 3] }, formation = 'none', repeat = 6 }"
    group = f"group.class={{ start = [4, 5], goal = [14, 5], groups = [{{ id = 'teacher', size = 1 }}, {pair}] }}"
    fixed = pinned(load("cross", [group]), 5)
    assert fixed is not None
    made = fixed.group[-1]
    assert [part.id for part in made.groups] == ["teacher", *(f"pair-{k}" for k in range(1, 7))]
    assert {(part.size in (2, 3), part.formation) for part in made.groups[1:]} == {(True, "none")}
    small = without(fixed, people(fixed))
    assert small is not None
    assert [part.size for part in small.group[-1].groups] == [1] * 7


def test_a_later_beginning_moves_everything_by_a_second() -> None:
    fixed = pinned(load("street"), 2)
    assert fixed is not None
    later = without(fixed, beginning(fixed)[:1])
    assert later is not None
    assert later.duration == fixed.duration - 1
    for old, new in zip(fixed.group, later.group, strict=True):
        if old.enter > 1:
            assert (new.enter, new.start) == (pytest.approx(old.enter - 1), old.start)
        elif old.enter <= 0:
            moved = ((new.start[0] - old.start[0]) ** 2 + (new.start[1] - old.start[1]) ** 2) ** 0.5
            assert moved == pytest.approx(old.speed, abs=0.02)


def test_a_step_that_fails_with_the_own_seed_alone_is_not_taken() -> None:
    def fails(scenario: Scenario, seed: int) -> bool:
        return seed == 3 or "north-1" in names(scenario)

    assert names(minimised(fails).smallest) == ["north-1"]
    assert names(minimised(fails, confirm=0).smallest) != ["north-1"]


def test_one_confirming_seed_of_five_may_differ() -> None:
    made = minimised(lambda scenario, seed: seed != 5)
    assert len(made.smallest.group) == 1
    assert made.smallest.duration <= 1


def test_fresh_seeds_that_do_not_fail_send_the_search_back() -> None:
    def fails(scenario: Scenario, seed: int) -> bool:
        return seed <= 8 or "north-1" in names(scenario)  # the confirming seeds are 4 to 8

    made = minimised(fails)
    assert names(made.smallest) == ["north-1"]
    assert made.guard == list(range(4, 14))
    assert made.fresh_seeds() == list(range(14, 19))


@pytest.mark.parametrize("budget", [1, 9, 40])
def test_a_budget_ends_with_the_smallest_scene_so_far(budget: int) -> None:
    made = minimised(needs, episodes=budget)
    assert made.played == budget
    assert not made.complete
    assert needs(made.smallest, 3)


def test_a_copy_of_a_suite_becomes_a_scene_of_its_own() -> None:
    seen: list[tuple[Scenario, int, int]] = []
    made = search(needs, seen)
    made.run(HARD, repeat=2)
    assert [repeat for _, _, repeat in seen] == [2] + [0] * (len(seen) - 1)
    assert made.trail[0] == pinned(HARD, 3, 2)
    alone = search(needs, play=lambda scenario, seed, repeat: Judgement({"HOTA": 0.4 if repeat else 0.9}))
    with pytest.raises(WorkError, match="copy 2 of an entry"):
        alone.run(HARD, repeat=2)


def test_an_order_that_does_not_come_true_is_no_failure() -> None:
    error = OrderError(got="no merge", expected="a merge", remedy="")

    def play(scenario: Scenario, seed: int, repeat: int) -> Judgement:
        return Judgement({"HOTA": 0.1}, problem=None if scenario.duration > 30 else error)

    assert 30 < minimised(needs, play=play).smallest.duration <= 31


def test_a_scene_without_the_failure_is_refused_with_its_score() -> None:
    with pytest.raises(WorkError, match=r"crowd, seed 3.*HOTA = 0.9.*expected a scene with HOTA<0.5"):
        search(lambda scenario, seed: False).run(HARD)


WRONG_CONDITIONS = [
    ("HOTA", "choose one of switch"), ("HOTTA<0.7", "did you mean HOTA"), ("HOTA=0.7", "SCORE<NUMBER"),
    ("HOTA<0..7", "correct the number"), ("hota<0.7", "mean HOTA"),
    ("swich", "mean switch"), ("switch:hiden", "mean hidden"), ("switch:", "a cause"),
    ("HOTA<2", "true of a perfect tracker.*HOTA<0.7"), ("HOTA<=1", "a perfect"), ("HOTA>=0", "a perfect"),
    ("HOTA>0.5", "a perfect"), ("HOTA<0", "true of no tracker"), ("HOTA<-1", "no tracker"), ("HOTA>1", "no tracker"),
    ("IDSW>=0", "a perfect tracker.*IDSW>2"), ("IDSW<3", "a perfect"), ("IDSW<-1", "no tracker"),
    ("TP<50", "a perfect tracker.*HOTA<0.7"), ("PT<2", "a perfect"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "got"), WRONG_CONDITIONS)
def test_wrong_conditions(text: str, got: str) -> None:
    with pytest.raises(InputError, match=got):
        parse_failure(text)


@pytest.mark.parametrize(
    "score", [s for s in ALL if s.better != "neither" and math.isfinite(s.high)], ids=lambda s: s.key
)
def test_the_remedy_for_a_condition_that_cannot_fail_works(score: Score) -> None:
    with pytest.raises(InputError) as caught:
        parse_failure(f"{score.key}<={score.high:g}")
    assert parse_failure(caught.value.remedy.removeprefix("write ")).score == score.key


def test_conditions() -> None:
    outcome = Judgement({"IDSW": 3.0, "HOTA": 0.6}, frozenset({("switch", "hidden")}))
    true = ["IDSW>=3", "IDSW > 2", "HOTA<=0.6", "HOTA < 0.7", "switch", "switch:hidden"]
    false = ["IDSW>3", "HOTA<0.5", "MOTA<0.5", "switch:near"]
    assert [text for text in (*true, *false, "late split") if parse_failure(text).holds(outcome)] == true

    assert all(parse_failure(kind).kind == kind for kind in (*get_args(PersonKind), *groups.KINDS))


SCENE = """
schema = 1
duration = 6.0
warmup = 1.0
camera = { fps = 5 }
sensor = { detect_prob = 0.7 }
world = { pillars = [[2, 9, 0.3]] }
group = [
  { id = "a", size = 2, start = [4, 4], goal = [12, 4] },
  { id = "b", size = 1, start = [12, 7], goal = [4, 7] },
]
"""


def test_end_to_end(tmp_path, monkeypatch, capsys) -> None:
    def warning(*given):
        warnings.warn("odd groups", stacklevel=1)
        return tracked(*given)

    tracked = TrackerSetup.run
    monkeypatch.setattr(TrackerSetup, "run", warning)
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(SCENE)
    line = ["minimize", "scene.toml", "--tracker", "blob", "--seed", "6", "--confirm", "0", "--while"]
    assert run([*line, "fragment", "--out", "small.toml"]) == 0
    printed = capsys.readouterr()
    assert re.search(r"3 people → [12], 6 s → 2, 1 pillars → 0", printed.out)
    assert "odd groups" not in printed.err
    monkeypatch.undo()
    monkeypatch.chdir(tmp_path)
    small = load("small.toml")
    assert len(small.group) == 1
    assert ("sensor", "detect_prob") in [piece.path for piece in difficulties(small)[:2]]
    assert "</html>" in Path("small.html").read_text()
    command, *lines = Path("small.toml").read_text().splitlines()
    assert {"size = 1", "size = 2"} & {*lines}
    assert run(command.removeprefix("# flockscope ").split()) == 0
    assert run(["track", "blob", "small-data", "--out", "small-tracks"]) == 0
    (sequence,) = answer(capsys, "errors", "small-data", "small-tracks")["sequences"]
    assert "fragment" in {error["kind"] for error in sequence["errors"]}
    assert "got HOTA = 0." in refused(capsys, *line, "HOTA<0.01", "--out", "other.toml", code=1)
    assert run([*line, "fragment", "--out", "scene.toml"]) == 2
    assert Path("scene.toml").read_text() == SCENE


@pytest.mark.parametrize("groups", [True, False])
def test_a_score_counts_only_where_the_oracle_has_it(tmp_path: Path, groups: bool) -> None:
    (tmp_path / "scene.toml").write_text(SCENE if groups else SCENE.replace("size = 2", "size = 1"))
    failure = parse_failure("pairwise_F1<1")
    setup = TrackerSetup(FAKE.replace("Nearest", "OneGroup"), detections="truth")
    outcome = play_episode(setup.run, (), failure, load(str(tmp_path / "scene.toml")), 4)
    assert outcome.problem is None
    assert failure.holds(outcome) == groups
    assert "HOTA" in outcome.scores


@pytest.mark.parametrize("seconds", [2, 3])
def test_an_error_that_the_start_explains_does_not_count(tmp_path: Path, seconds: int) -> None:
    """A group is missed until the end, after 2 s."""
    (tmp_path / "scene.toml").write_text(SCENE)
    scene, failure = load(str(tmp_path / "scene.toml"), set=(f"duration={seconds}",)), parse_failure("missed group")
    assert failure.holds(play_episode(TrackerSetup(FAKE).run, (), failure, scene, 4)) == (seconds == 3)


def test_a_run_is_minimised_with_its_tracker_and_inputs(tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.toml").write_text(SCENE)
    assert run(["generate", "scene.toml", "--seeds", "4", "--streams", "none", "--out", "data"]) == 0
    sequence = "data/flockscope-train/scene-s00004"
    given = "--detections truth --set sensor.detect_prob=0.6 --set coast_time=1.0 --seed 2"
    assert run(f"track blob {sequence} --out tracks {given}".split()) == 0
    line = ["--while", "fragment", "--confirm", "0", "--episodes", "3", "--out", "small.toml"]
    found = answer(capsys, "minimize", "tracks", *line)
    assert found["tracker"] == "blob"
    setup = _of_run(Path("tracks"))[1]
    assert (setup.detections, setup.seed, setup.sensor) == ("truth", 2, {"detect_prob": 0.6})
    assert setup.config is not None
    assert setup.config.as_dict()["coast_time"] == 1.0
    Path("elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    assert "recordings cannot be made smaller" in refused(capsys, "minimize", "../tracks", *line)


@pytest.mark.parametrize("condition", ["crash", "IDSW>=1"])
def test_a_tracker_that_raises_fails_if_that_is_the_condition(condition: str) -> None:
    setup, failure = TrackerSetup(FAKE.replace("Nearest", "Crashes")), parse_failure(condition)
    scene = load("merge", set=("duration=4", "camera.fps=4", "event=[]"))
    outcome = play_episode(setup.run, (), failure, scene, 0)
    assert (outcome.problem is None) == failure.holds(outcome) == (condition == "crash")
