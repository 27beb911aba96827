"""`flockscope replay` as a user calls it: a dataset that all other commands take, and one line for what is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.refusals import answer

VIEW = "[camera]\nimage = [160, 120]\nfps = 5\n\n[sensor]\nclutter_rate = 0.0\n\n[light]\nshadow = 0.0\n"


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    lines = [f"{10 * k} {id} {0.5 * k} 0 {id}.0 0 0 0" for k in range(20) for id in (1, 2)]
    (tmp_path / "walk").mkdir()
    (tmp_path / "walk" / "obsmat.txt").write_text("\n".join(lines))
    (tmp_path / "walk" / "groups.txt").write_text("1 2\n")
    (tmp_path / "view.toml").write_text(VIEW)
    return tmp_path / "walk"


def test_replay_track_score_and_look(walk: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    made = answer(capsys, "replay", walk, "--camera", tmp_path / "view.toml", "--duration", "4", "--out", out)
    assert made["folder"] == str(out / "flockscope-test")
    assert answer(capsys, "validate", out)["problems"] == []
    answer(capsys, "track", "blob", out, "--detections", "file", "--out", tmp_path / "t")
    answer(capsys, "score", out, tmp_path / "t")
    answer(capsys, "view", made["sequences"][0], "--out", tmp_path / "v.html")
    answer(capsys, "sheet", made["sequences"][0], "--out", tmp_path / "s.png")
