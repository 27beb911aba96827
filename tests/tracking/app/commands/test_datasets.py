"""`flockscope replay` as a user calls it: a dataset that all other commands take, and one line for what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.recordings import biwi_walk
from tests.refusals import answer

VIEW = "[camera]\nimage = [160, 120]\nfps = 5\n\n[sensor]\nclutter_rate = 0.0\n\n[light]\nshadow = 0.0\n"


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    (tmp_path / "view.toml").write_text(VIEW)
    return biwi_walk(tmp_path / "walk")


def test_replay_without_the_empty_scene(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    some = ["--camera", tmp_path / "view.toml", "--duration", "1", "--no-background"]
    (made,) = answer(capsys, "replay", walk, *some, "--out", tmp_path / "data")["sequences"]
    assert (Path(made) / "img1").is_dir()
    assert not (Path(made) / "background").exists()


def test_replay_track_score_and_look(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    made = answer(capsys, "replay", walk, "--camera", tmp_path / "view.toml", "--duration", "4", "--out", out)
    assert made["folder"] == str(out / "flockscope-test")
    assert answer(capsys, "validate", out)["problems"] == []
    answer(capsys, "track", "blob", out, "--detections", "file", "--out", tmp_path / "t")
    answer(capsys, "score", out, tmp_path / "t")
    answer(capsys, "view", made["sequences"][0], "--out", tmp_path / "v.html")
    answer(capsys, "sheet", made["sequences"][0], "--out", tmp_path / "s.png")
