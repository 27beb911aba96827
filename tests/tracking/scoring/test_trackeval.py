"""TrackEval reads generated datasets and our tracks as they are, and has the same scores; real recordings likewise."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from sim.io.source import open_source
from sim.io.store.track_files import read_tracks
from tests.reference_trackeval import CLEAR, HOTA, IDENTITY, KEYS
from tracking.app.cli import run
from tracking.scoring import evaluate

pytestmark = pytest.mark.filterwarnings("ignore")
QUIET = {"PRINT_CONFIG": False}


def theirs(gt: Path, trackers: Path, sequences: dict[str, int], **config) -> dict[str, dict[str, float]]:
    """What TrackEval makes of the folders, by sequence."""
    trackeval = pytest.importorskip("trackeval", reason="trackeval is installed by `make test`")
    found = {}
    dataset = trackeval.datasets.MotChallenge2DBox(
        {"GT_FOLDER": str(gt), "TRACKERS_FOLDER": str(trackers), "BENCHMARK": "flockscope", **config, **QUIET}
    )
    assert set(dataset.seq_list) == set(sequences)
    metrics = trackeval.metrics
    families = (
        (metrics.HOTA(), HOTA),
        (metrics.CLEAR({"THRESHOLD": 0.5, **QUIET}), CLEAR),
        (metrics.Identity({"THRESHOLD": 0.5, **QUIET}), IDENTITY),
    )
    for name in dataset.seq_list:
        data = dataset.get_preprocessed_seq_data(dataset.get_raw_seq_data("blob", name), "pedestrian")
        assert data["num_timesteps"] == sequences[name]
        answers = {key: metric.eval_sequence(data)[KEYS.get(key, key)] for metric, keys in families for key in keys}
        found[name] = {key: float(np.mean(value)) for key, value in answers.items()}
    return found


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
    expected = theirs(tmp_path / "data", tmp_path / "trackers", lengths)
    capsys.readouterr()
    assert run(["score", str(data), str(tmp_path / "tracks"), "--similarity", "boxes", "--json"]) == 0
    exact = {row["name"]: row for row in json.loads(capsys.readouterr().out)["sequences"]}
    for name, scores in expected.items():
        text, told = data / name / "gt" / "gt.txt", texts / f"{name}.txt"
        ours = evaluate(open_source(text, fps=10)[0].truth, read_tracks(told, fps=10, length=lengths[name]))
        for key, value in scores.items():
            assert ours[key] == pytest.approx(value, abs=1e-6), (name, key)
        # Text has boxes to 0.01 px, the tables beside it exactly: a pair next to a threshold may fall to either side.
        assert exact[name]["HOTA"] == pytest.approx(scores["HOTA"], abs=1e-3), name
