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


def stress(scene: str, *more: str) -> int:
    options = ["--suite", scene, "--seeds", "0:2", "--start", "2", "--by", "HOTA", "--out", "o"]
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
    means = data["matrix"]["mean"]["oracle"]
    assert [len(row) for row in means] == [2] * 5
    assert [value for row in means for value in row] == data["curves"]["oracle"]["mean"]
    assert means[0][0] > means[4][0]
    ends = re.findall(r"<td>[\d.]+ to ([\d.]+)</td>", Path("o/report.html").read_text())
    assert max(map(float, ends)) == 1.0, "intervals of two seeds end with the range of the score"
    assert pq.read_table("o/episodes.parquet")["group.a.size"].to_pylist().count(2.0) == 2 * 2 * 5


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
]


@pytest.mark.parametrize(("words", "place"), WRONG_OPTIONS)
def test_wrong_options(words: str, place: str, scene: str, capsys) -> None:
    assert stress(scene, *words.split()) == 2
    assert place in capsys.readouterr().err
    assert not Path("o").exists()
