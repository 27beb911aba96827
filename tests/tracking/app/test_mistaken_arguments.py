"""A newcomer's mistakes: the error says what was given, and what to give."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.short_scene import write_short_scene
from tracking.app.cli import run


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene, a dataset of it with two sequences and without pictures, and a run on it."""
    folder = tmp_path_factory.mktemp("mistakes")
    write_short_scene(folder, "0:2")
    assert run(["track", "blob", str(folder / "data"), "--out", str(folder / "run")]) == 0
    return folder


MISTAKES = {
    "score {0}/data {0}/data": (
        "{0}/data: got a generated dataset, no tracks;", "give the --out of `flockscope track`",
    ),
    "score {0}/data {0}/data/flockscope-train": ("got a generated dataset, no tracks;",),
    "score {0}/data {0}/data/flockscope-train/scene-s00000": ("got a generated dataset, no tracks;",),
    "score {0}/data {0}/run {0}/data": ("got a generated dataset, no tracks;",),
    "score {0}/run {0}/data": ("{0}/run: got tracks, what `flockscope track` wrote;", "swap the arguments"),
    "score {0}/run/scene-s00000 {0}/data": ("scene-s00000: got tracks, what", "swap the arguments"),
    "view {0}/run {0}/data --out {0}/x": ("{0}/run: got tracks, what", "swap the arguments"),
    "score {0}/data {0}/scene.toml": ("{0}/scene.toml: got a .toml file, no tracks;", "made by `flockscope track`"),
    "track blob {0}/data --detections image --out {0}/x": (
        "and scene-s00000 with detections, truth, without pictures; expected a sequence with pictures;",
        "try --detections file",
    ),
    "track blob {0}/data --camera {0}/scene.toml --out {0}/x": (
        "{0}/scene.toml: --camera: got a TOML file; expected a camera.json", "describes a view",
    ),
    "generate crossing --seeds 0": ("flockscope generate: got missing option '--out'; expected --out DIR: ",),
    "track blob": ("flockscope track: got missing argument 'SOURCE'; expected SOURCE: ",),
    "score {0}/data {0}/run {0}/run": ("TRACKS: got", "twice; expected each run once",),
    "score {0}/data {0}/run {0}/run/scene-s00000 --by HOTAA": ("--by: got HOTAA", "such as HOTA"),
    "score {0}/data {0}/run none.py:Mine": ("none.py",),
}  # fmt: skip


@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistaken_argument_is_named(line: str, place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([word.format(place) for word in line.split()]) == 2
    shown = capsys.readouterr().err
    assert shown.count("\n") == 1
    for words in MISTAKES[line]:
        assert words.format(place) in shown, shown
