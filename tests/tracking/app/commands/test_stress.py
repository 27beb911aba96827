"""`flockscope stress`: what it prints and stores without axes, with two, and of a search; one run in a folder."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.processes import FAKE
from tests.refusals import answer
from tests.tuning_toys import write_scenes
from tracking.app.cli import run


@pytest.fixture
def scene(tmp_path: Path, monkeypatch) -> str:
    monkeypatch.chdir(tmp_path)
    return Path(write_scenes(tmp_path)[0]).name


def stress(scene: str, *more: str, seeds: str = "0:2") -> int:
    options = ["--suite", scene, "--seeds", seeds, "--start", "2", "--by", "HOTA", "--out", "o"]
    return run(["stress", FAKE, *options, *more])


def test_without_axes_a_row_for_each_scenario(scene: str, capsys) -> None:
    assert stress(scene, "--suite", "two.toml", "--json") == 0
    data = json.loads(capsys.readouterr().out)
    assert data["by_scenario"]["oracle"].keys() == {"one", "two"}
    assert data["by_scenario"][FAKE]["one"]["scenes"] == 2
    assert (data["curves"][FAKE]["scenes"], data["episodes"]) == ([4], 4)
    assert data["matrix"] is data["found"] is None
    assert stress(scene, "--suite", "two.toml") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()[2:5]] == ["one", "two", "all"]
    assert pq.read_table("o/episodes.parquet").column_names[:6] == [
        "tracker", "scenario", "left_out", "failed", "traceback", "seed",
    ]  # fmt: skip


def test_failed_episodes_of_a_tracker_are_one_line(scene: str, capsys) -> None:
    crashing = FAKE.replace("Nearest", "Crashes")
    assert run(["stress", crashing, "--suite", scene, "--seeds", "0:3", "--start", "3", "--out", "o"]) == 0
    assert f"\n{crashing} failed in 3 episodes, the first one, seed 0: " in capsys.readouterr().out


def test_two_axes_make_a_matrix(scene: str, capsys) -> None:
    axes = ("--vary", "detection=1.0:0.6", "--vary", "group.a.size=1:2")
    assert stress(scene, *axes) == 0
    assert "detection  group.a.size 1" in capsys.readouterr().out
    data = json.loads(Path("o/stress.json").read_text())
    assert data["matrix"]["values"] == [[1.0, 0.9, 0.8, 0.7, 0.6], [1.0, 2.0]]
    means, frontier = data["matrix"]["mean"]["oracle"], data["matrix"]["frontier"][FAKE]
    assert [len(row) for row in frontier["sides"]] == [2] * 5
    assert {side for row in frontier["sides"] for side in row} == {"unknown"}, "two seeds decide nothing"
    shares = data["matrix"]["share"][FAKE]
    assert shares[1][1] == pytest.approx(data["matrix"]["mean"][FAKE][1][1] / means[1][1])
    assert [len(row) for row in means] == [2] * 5
    assert [value for row in means for value in row] == data["curves"]["oracle"]["mean"]
    assert means[0][0] > means[4][0]
    ends = re.findall(r"<td>[\d.]+ to ([\d.]+)</td>", Path("o/report.html").read_text())
    assert max(map(float, ends)) == 1.0, "intervals of two seeds end with the range of the score"
    assert pq.read_table("o/episodes.parquet")["group.a.size"].to_pylist().count(2.0) == 2 * 2 * 5


def test_one_axis_is_told_by_both_measures(scene: str, capsys) -> None:
    assert stress(scene, "--vary", "detection=1.0:0.4", "--episodes", "15", seeds="0:8") == 0
    text = capsys.readouterr().out
    data = json.loads(Path("o/stress.json").read_text())
    tracker, oracle = data["curves"][FAKE], data["curves"]["oracle"]
    assert tracker["share"]["mean"] == pytest.approx(
        [a / b for a, b in zip(tracker["mean"], oracle["mean"], strict=True)]
    )
    assert text.index("share of the oracle, HOTA over detection") < text.index("\nHOTA over detection")
    lines = [f"{FAKE}: share of the oracle ", f"{FAKE}: HOTA ", "oracle: HOTA "]
    assert sorted(text.index(f"\n{line}") for line in lines) == [text.index(f"\n{line}") for line in lines]
    rows = pq.read_table("o/episodes.parquet").to_pylist()
    own = [row for row in rows if row["tracker"] == FAKE]
    assert all(row["share"] == pytest.approx(row["HOTA"] / row["oracle"]) for row in own)
    assert all(row["oracle"] == row["HOTA"] for row in rows if row["tracker"] == "oracle")
    page = Path("o/report.html").read_text()
    assert "As a share of the oracle" in page
    assert "oracle: HOTA falls to" in page
    assert max(high for curve in (tracker, oracle) for high in curve["high"] if high is not None) <= 1


def test_a_budget_of_one_round_is_said(scene: str, capsys) -> None:
    assert stress(scene, "--vary", "detection=1.0:0.4", "--episodes", "5", seeds="0:8") == 0
    text = capsys.readouterr().out
    assert "the budget ended in the first round: wide intervals need more --episodes or --minutes" in text
    assert "fewer than 6 scenes: intervals are indicative" in text
    data = json.loads(Path("o/stress.json").read_text())
    assert (data["rounds"], data["budget_ended"]) == (1, True)
    assert "the budget ended in the first round" in Path("o/report.html").read_text()


@pytest.mark.parametrize("axes", ["", "--vary detection --vary clutter"])
def test_few_scenes_are_indicative_with_any_number_of_axes(axes: str, scene: str, capsys) -> None:
    assert stress(scene, *axes.split(), "--episodes", "9", seeds="0:4") == 0
    text = capsys.readouterr().out
    assert "fewer than 6 scenes: intervals are indicative" in text
    assert ("the budget ended in the first round" in text) == bool(axes)


def test_an_axis_of_the_sensor_is_refused_where_pictures_are_tracked(scene: str, capsys) -> None:
    options = ["--detections", "image", "--vary", "detection", "--suite", scene, "--seeds", "0:2", "--out", "o"]
    assert run(["stress", "blob", *options]) == 2
    assert "--detections image does not use [sensor]: leave it out, or vary other keys" in capsys.readouterr().err


def test_a_found_scene_is_generated_by_its_command(scene: str, capsys) -> None:
    axes = ("--vary", "detection", "--vary", "clutter", "--vary", "velocity-difference")
    assert stress(scene, *axes, "--search", "6") == 0
    text = capsys.readouterr().out
    data = json.loads(Path("o/stress.json").read_text())
    worst = data["found"][0]
    assert worst["shortfall"] == worst["oracle"] - worst["score"] > 0
    assert len(worst["values"]) == 3
    assert worst["command"] in text.replace(" \\\n    ", " ")
    assert run([*shlex.split(worst["command"])[1:], "--streams", "none"]) == 0
    seed = str(worst["seed"])
    assert run(["track", FAKE, "worst-1", "--detections", "file", "--seed", seed, "--out", "t"]) == 0
    (folder,) = Path("worst-1").glob("*/one-s*")
    assert answer(capsys, "score", folder, f"t/{folder.name}")["sequences"][0]["HOTA"] == worst["score"]


WRONG_OPTIONS = [
    ("--vary detection --vary clutter --vary noise", "--vary: got 3 axes"),
    ("--vary noise --vary noise", "--vary: got noise twice"),
    ("--vary noise --search 5 --episodes 10", "--episodes: got it beside --search"),
    ("--detections image", "got a tracker that needs"),
    ("--vary detection --set sensor.detect_prob=0.5", "--set sensor.detect_prob: got what --vary varies"),
    ("--vary frame-rate --set scenario.camera.fps=5", "give the ends: --vary frame-rate=EASY:HARD"),
    ("--vary noise --detections truth", "--vary: got noise; expected an axis that changes the scenes"),
    ("--vary sensor.persistence=0:0.9 --detections truth --search 4", "--vary: got sensor.persistence"),
]


@pytest.mark.parametrize(("words", "place"), WRONG_OPTIONS)
def test_wrong_options(words: str, place: str, scene: str, capsys) -> None:
    assert stress(scene, *words.split()) == 2
    assert place in capsys.readouterr().err
    assert not Path("o").exists()
