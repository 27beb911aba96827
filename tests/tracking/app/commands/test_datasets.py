"""`flockscope replay` as a user calls it: a dataset that all other commands take, and one line for what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tracking.app.cli import run

VIEW = "[camera]\nimage = [160, 120]\nfps = 5\n\n[sensor]\nclutter_rate = 0.0\n\n[light]\nshadow = 0.0\n"


def answer(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, object]:
    capsys.readouterr()
    code = run([*map(str, words), "--json"])
    return {"code": code, **json.loads(capsys.readouterr().out)}


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
    assert made["code"] == 0
    assert made["folder"] == str(out / "flockscope-test")
    assert answer(capsys, "validate", out)["problems"] == []
    tracked = answer(capsys, "track", "blob", out, "--detections", "file", "--out", tmp_path / "t")
    assert tracked["code"] == 0
    scored = answer(capsys, "score", out, tmp_path / "t")
    assert scored["code"] == 0
    assert answer(capsys, "view", made["sequences"][0], "--out", tmp_path / "v.html")["code"] == 0  # type: ignore[index]
    assert answer(capsys, "sheet", made["sequences"][0], "--out", tmp_path / "s.png")["code"] == 0  # type: ignore[index]


@pytest.mark.parametrize(
    ("words", "place", "got"),
    [
        (["--seeds", "0"], "--seeds", "train"), (["--start", "500"], "--start", "500 s"),
        (["--duration", "0"], "--duration", "0"), (["--set", "camera.height=0.4"], "camera.height", "out of view"),
        (["--set", "camra.fps=5"], "camra", "camra"), (["--camera", "none.toml"], "", "no such file"),
        (["--camera", "bad.toml"], "world", "world"), (["--streams", "none", "--images", "png"], "--images", "png"),
        (["--streams", "left,up"], "streams", "up"), (["--sensor", "none.toml"], "", "no such file"),
    ],
)  # fmt: skip
def test_wrong_input_is_one_line(
    walk: Path, words: list[str], place: str, got: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text("[world]\nsize = [3, 3]\n")
    output = answer(capsys, "replay", walk, *words, "--out", tmp_path / "o")
    assert output["code"] == 2
    assert place in output["error"]["place"]  # type: ignore[index]
    assert got in output["error"]["got"]  # type: ignore[index]
    assert not (tmp_path / "o").exists()
