"""`flockscope fit` as a user calls it, and `--sensor` and `--grouping` with what it wrote."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios import load, sensor_settings
from tracking.app.cli import run


def answer(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, object]:
    capsys.readouterr()
    code = run([*map(str, words), "--json"])
    return {"code": code, **json.loads(capsys.readouterr().out)}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A generated sequence: a recording with gt and det like any other."""
    out = tmp_path_factory.mktemp("fit") / "data"
    words = ["generate", "street", "--seeds", "30000", "--streams", "none", "--set", "duration=12.0", "--out", str(out)]
    assert run(words) == 0
    return out


@pytest.mark.slow
def test_fit_generate_and_track_with_it(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    profile = tmp_path / "mine.toml"
    output = answer(capsys, "fit", "sensor", made, made, "--out", profile)
    assert output["code"] == 0
    assert output["measured"]["missed"] == pytest.approx(output["drawn"]["missed"], abs=0.05)  # type: ignore[index]
    assert load("merge", set=sensor_settings(profile)).sensor.detect_prob == output["sensor"]["detect_prob"]  # type: ignore[index]
    out = tmp_path / "data"
    words = ["generate", "merge", "--seeds", "0", "--streams", "none", "--sensor", profile, "--out", out]
    assert answer(capsys, *words, "--set", "sensor.clutter_rate=0.0")["code"] == 0
    stored = load(out / "flockscope-train" / "merge-s00000" / "scenario.toml").sensor
    assert stored.box_noise is not None
    assert stored.clutter_rate == 0.0
    tracked = answer(
        capsys, "track", "blob", made, "--detections", "truth", "--sensor", profile, "--out", tmp_path / "t"
    )
    assert tracked["code"] == 0
    refused = answer(
        capsys, "track", "blob", made, "--detections", "file", "--sensor", profile, "--out", tmp_path / "t"
    )
    assert refused["code"] == 2
    assert "--sensor" in refused["error"]["place"]  # type: ignore[index]


@pytest.mark.parametrize(
    ("words", "place", "got"),
    [
        (["fit", "sensor", "DATA", "--out", "x.txt"], "--out", "x.txt"),
        (["fit", "sensor", "NOWHERE", "--out", "x.toml"], "", "nothing there"),
        (["fit", "grouping", "merge", "--seeds", "x", "--out", "x.toml"], "--seeds", "x"),
        (["generate", "merge", "--seeds", "0", "--sensor", "none.toml", "--out", "o"], "", "no such file"),
    ],
)
def test_wrong_input_is_one_line(
    made: Path, words: list[str], place: str, got: str, capsys: pytest.CaptureFixture[str],
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    output = answer(capsys, *[str(made) if word == "DATA" else word for word in words])
    assert output["code"] == 2
    assert place in output["error"]["place"]  # type: ignore[index]
    assert got in output["error"]["got"]  # type: ignore[index]


def test_a_belief_is_fitted_and_used(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("one.toml", "two.toml")]
    words = ("fit", "grouping", "side-by-side", "pass-by", "--seeds", "30000:30002", "--check", "10000", "--out")
    first, second = (answer(capsys, *words, file) for file in files)
    assert first["code"] == second["code"] == 0
    assert files[0].read_text() == files[1].read_text(), "a fit gives the same file again"
    assert first["fitted"]["F1"] > 0.95  # type: ignore[index]
    assert first["fitted"]["pairs"] > 10  # type: ignore[index]
    tracked = answer(
        capsys, "track", "blob", made, "--detections", "truth", "--grouping", files[0], "--out", tmp_path / "t"
    )
    assert tracked["code"] == 0
    (run_file,) = (tmp_path / "t").rglob("run.json")
    assert json.loads(run_file.read_text())["grouping"]["grouping"] == "belief"
