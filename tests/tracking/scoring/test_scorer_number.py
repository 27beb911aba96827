"""The scores of fixed tracks are those that are stored with the number of the scorer.

After a wanted change, raise SCORER and store the scores anew: python tests/tracking/scoring/test_scorer_number.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tracking.scoring import score_arrays
from tracking.scoring.catalogue import SCORER

FILE = Path(__file__).with_name("scorer.json")


def scores() -> dict[str, float | None]:
    """Six people who walk in groups that merge and split; two of them are tracked under changing ids, and late."""
    frame, id = (a.ravel() for a in np.meshgrid(np.arange(1, 101), np.arange(6), indexing="ij"))
    apart = np.where((frame > 30) & (frame < 70), 0.0, np.minimum(abs(frame - 50) - 20, 15) * 0.3)
    pos = np.stack([frame * 0.12, (id % 3) * 0.8 + np.where(id < 3, 0.0, 2.4 + apart)], axis=1)
    group = np.where((frame > 31) & (frame < 69), 0, np.where(id < 3, 0, 1))
    truth = {"frame": frame, "id": id, "pos": pos, "group": group}
    seen = (frame + 7 * id) % 11 > 0
    wave = np.stack([np.sin(frame * 0.7 + id), np.cos(frame * 0.9 - id)], axis=1) * 0.2
    late = np.where((frame > 40) & (frame < 78), 0, np.where(id < 3, 0, 1))
    tracks = {"frame": frame, "id": np.where((id < 2) & (frame > 55), id + 10, id), "pos": pos + wave, "group": late}
    found = score_arrays(truth, {name: column[seen] for name, column in tracks.items()}, fps=10)
    return {key: None if value != value else float(value) for key, value in found.items()}


def test_equal_tracks_have_equal_scores_under_one_number() -> None:
    stored = json.loads(FILE.read_text())
    assert stored["scorer"] == SCORER
    found = scores()
    assert {key for key, value in stored["scores"].items() if value is None} == {
        k for k, v in found.items() if v is None
    }
    known = {key: value for key, value in found.items() if value is not None}
    assert known == pytest.approx({key: stored["scores"][key] for key in known}, abs=1e-9), "raise SCORER"


if __name__ == "__main__":
    FILE.write_text(json.dumps({"scorer": SCORER, "scores": scores()}, indent=1) + "\n")
