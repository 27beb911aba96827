"""TrackEval reads generated datasets and our tracks as they are, and has the same scores; real recordings likewise."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.reference_trackeval import trackeval_files
from tests.refusals import answer
from tracking.app.cli import run
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks
from tracking.scoring import evaluate

pytestmark = pytest.mark.filterwarnings("ignore")


@pytest.mark.slow
def test_a_generated_dataset(tmp_path: Path, capsys) -> None:
    assert run(["generate", "merge", "clutter", "--seeds", "5:7", "--out", str(tmp_path / "data")]) == 0
    data = tmp_path / "data" / "flockscope-train"
    assert run(["track", "blob", str(data), "--out", str(tmp_path / "tracks")]) == 0
    texts = tmp_path / "trackers" / "flockscope-train" / "blob" / "data"
    texts.mkdir(parents=True)
    lengths = {}
    for folder in sorted(path for path in data.iterdir() if path.is_dir()):
        shutil.copy(tmp_path / "tracks" / folder.name / "tracks.mot.txt", texts / f"{folder.name}.txt")
        lengths[folder.name] = open_source(folder)[0].length
    expected = trackeval_files(tmp_path / "data", tmp_path / "trackers", "blob", BENCHMARK="flockscope")
    assert expected.keys() == lengths.keys()
    scored = answer(capsys, "score", data, tmp_path / "tracks", "--similarity", "boxes")
    exact = {row["name"]: row for row in scored["sequences"]}
    for name, scores in expected.items():
        text, told = data / name / "gt" / "gt.txt", texts / f"{name}.txt"
        ours = evaluate(open_source(text, fps=10)[0].truth, read_tracks(told, fps=10, length=lengths[name]))
        for key, value in scores.items():
            assert ours[key] == pytest.approx(value, abs=1e-6), (name, key)
        # Text has boxes to 0.01 px, the tables beside it exactly: a pair next to a threshold may fall to either side.
        assert exact[name]["HOTA"] == pytest.approx(scores["HOTA"], abs=1e-3), name
