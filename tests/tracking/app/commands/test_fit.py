"""`flockscope fit` as a user calls it, and `--sensor` and `--grouping` with what it wrote."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios import load, sensor_settings
from tests.refusals import answer, refused
from tracking.app.cli import run


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
    assert output["measured"]["missed"] == pytest.approx(output["drawn"]["missed"], abs=0.05)
    assert load("merge", set=sensor_settings(profile)).sensor.detect_prob == output["sensor"]["detect_prob"]
    out = tmp_path / "data"
    words = ["generate", "merge", "--seeds", "0", "--streams", "none", "--sensor", profile, "--out", out]
    answer(capsys, *words, "--set", "sensor.clutter_rate=0.0")
    stored = load(out / "flockscope-train" / "merge-s00000" / "scenario.toml").sensor
    assert stored.box_noise is not None
    assert stored.clutter_rate == 0.0
    line = ["track", "blob", made, "--sensor", profile, "--out", tmp_path / "t"]
    answer(capsys, *line, "--detections", "truth")
    assert "--sensor" in refused(capsys, *line, "--detections", "file")


def test_a_belief_is_fitted_and_used(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("one.toml", "two.toml")]
    words = ("fit", "grouping", "side-by-side", "pass-by", "--seeds", "30000:30002", "--out")
    first, _ = (answer(capsys, *words, file) for file in files)
    assert files[0].read_text() == files[1].read_text(), "a fit gives the same file again"
    assert first["fitted"]["F1"] > 0.95
    assert first["fitted"]["pairs"] > 10
    answer(capsys, "track", "blob", made, "--detections", "truth", "--grouping", files[0], "--out", tmp_path / "t")
    (run_file,) = (tmp_path / "t").rglob("run.json")
    assert json.loads(run_file.read_text())["grouping"]["grouping"] == "belief"
