"""`flockscope score TRUTH TRACKS TRACKS…`: the ranking is that of `tracking.compare`, in any order of the runs."""

from __future__ import annotations

from pathlib import Path

import pytest

import tracking
from tests.processes import FAKE
from tests.refusals import answer
from tests.short_scene import write_short_scene
from tracking import track
from tracking.app.cli import run
from tracking.recordings.source import open_source


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Four short scenes, two runs, and the tracks of one of them as texts."""
    folder = tmp_path_factory.mktemp("ranking")
    write_short_scene(folder, "0:4")
    for name, options in (("good", []), ("bad", ["--set", "tracker.gate=0.6"])):
        assert run(["track", "blob", str(folder / "data"), *options, "--out", str(folder / name)]) == 0
    (folder / "texts").mkdir()
    for tracks in (folder / "good").iterdir():
        if tracks.is_dir():
            (folder / "texts" / f"{tracks.name}.txt").write_text((tracks / "tracks.txt").read_text())
    return folder


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_ranking_is_that_of_compare(made: Path, capsys) -> None:
    runs = [str(made / "good"), str(made / "bad"), FAKE]
    found = answer(capsys, "score", made / "data", *runs, "--by", "HOTA")
    assert answer(capsys, "score", made / "data", *runs[::-1], "--by", "HOTA")["ranking"] == found["ranking"]
    sequences = open_source(made / "data")
    config = {"good": {}, "bad": {"gate": 0.6}}
    mine = {name: [track("blob", s, params=p) for s in sequences] for name, p in config.items()}
    mine["Nearest"] = [track(FAKE, s, detections="file") for s in sequences]
    expected = tracking.compare(sequences, mine).to_arrow("HOTA").to_pylist()
    for row, other in zip(found["ranking"], expected, strict=True):
        assert [row[key] for key in ("run", "first", "last")] == [other[key] for key in ("run", "first", "last")]
        assert row["mean"] == pytest.approx(other["mean"], abs=1e-9)
    assert [r["run"] for r in found["ranking"][:2]] == ["oracle from boxes (file)", "oracle from points (file)"]
    assert found["similarity"] == "ground"
    assert len(found["differences"]) == 3
