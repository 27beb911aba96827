"""`flockscope score TRUTH TRACKS TRACKS…`: the ranking is that of `tracking.compare`, in any order of the runs."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

import tracking
from sim.io.source import open_source
from tests.short_scene import write_short_scene
from tracking import track
from tracking.app.cli import run
from tracking.scoring.catalogue import CATALOGUE

FAKE = f"{Path(__file__).resolve().parents[3] / 'fake_tracker.py'}:Nearest"


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Six short scenes, two runs, and the tracks of one of them as texts."""
    folder = tmp_path_factory.mktemp("ranking")
    write_short_scene(folder, "0:6")
    for name, options in (("good", []), ("bad", ["--set", "tracker.gate=0.6"])):
        assert run(["track", "blob", str(folder / "data"), *options, "--out", str(folder / name)]) == 0
    (folder / "texts").mkdir()
    for tracks in (folder / "good").iterdir():
        if tracks.is_dir():
            (folder / "texts" / f"{tracks.name}.txt").write_text((tracks / "tracks.txt").read_text())
    return folder


def ranked(capsys, made: Path, *words: str) -> dict:
    capsys.readouterr()
    assert run(["score", str(made / "data"), *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_ranking_is_that_of_compare(made: Path, capsys) -> None:
    runs = [str(made / "good"), str(made / "bad"), FAKE]
    found = ranked(capsys, made, *runs, "--by", "HOTA")
    assert ranked(capsys, made, *runs[::-1], "--by", "HOTA")["ranking"] == found["ranking"]
    sequences = open_source(made / "data")
    config = {"good": {}, "bad": {"gate": 0.6}}
    mine = {name: [track("blob", s, params=p) for s in sequences] for name, p in config.items()}
    mine["Nearest"] = [track(FAKE, s, detections="file") for s in sequences]
    expected = tracking.compare(sequences, mine).to_arrow("HOTA").to_pylist()
    for row, other in zip(found["ranking"], expected, strict=True):
        assert [row[key] for key in ("run", "first", "last")] == [other[key] for key in ("run", "first", "last")]
        assert row["mean"] == pytest.approx(other["mean"], abs=1e-9)
    assert found["ranking"][0]["run"] == "oracle"
    assert found["similarity"] == "ground"
    assert len(found["differences"]) == 3


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_text_of_the_same_tracks_ties(made: Path, capsys) -> None:
    found = ranked(capsys, made, str(made / "good"), str(made / "texts"), "--by", "HOTA")
    (pair,) = found["differences"]
    assert pair["mean"] == pytest.approx(0, abs=0.01)
    assert [r["detections"] for r in found["ranking"][1:]] in (
        [["file"], ["unknown (no run.json)"]], [["unknown (no run.json)"], ["file"]],
    )  # fmt: skip


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_what_is_shown_and_stored(made: Path, tmp_path: Path, capsys) -> None:
    words = ["score", str(made / "data"), str(made / "good"), str(made / "bad")]
    assert run([*words, "--csv", str(tmp_path / "all.csv")]) == 0
    short = capsys.readouterr().out
    assert short.startswith("ranking by objective, mean of 6 sequences, detections file")
    assert "intervals of differences hold with 95 % for all 1 pair together" in short
    assert "scene-s00003" not in short
    rows = list(csv.DictReader((tmp_path / "all.csv").open()))
    assert len(rows) == 6 * 3
    assert set(CATALOGUE) < set(rows[0])
    assert run([*words, "--all"]) == 0
    assert capsys.readouterr().out.count("scene-s00003") == 3
    for option in (["--blocks", "100"], ["--against", str(made / "bad")], ["--by", "MT"]):
        assert run([*words, *option]) == (0 if option[1] == "MT" else 2)
