"""Tracks on distractors are left out of the scores, as by TrackEval's preprocessing of MOTChallenge."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sim.types import Truth
from tests.reference_trackeval import trackeval_files
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks
from tracking.scoring.evaluation import Scorer, Scores, evaluate

pytestmark = pytest.mark.filterwarnings("ignore")
FRAMES = 12


def written(folder: Path, gt: np.ndarray, tracks: np.ndarray, name: str) -> tuple[Path, Path]:
    """A sequence folder with gt/gt.txt, and the text of tracks where TrackEval looks for it."""
    text, told = folder / "gt" / name / "gt" / "gt.txt", folder / "trackers" / "t" / "data" / f"{name}.txt"
    for path, rows in ((text, gt), (told, tracks)):
        path.parent.mkdir(parents=True)
        path.write_text("".join(",".join(f"{v:.10g}" for v in row) + "\n" for row in rows.tolist()))
    (text.parents[1] / "seqinfo.ini").write_text(f"[Sequence]\nname={name}\nframeRate=10\nseqLength={FRAMES}\n")
    return text.parents[1], told


def crowded(seed: int, top: int = 13) -> tuple[np.ndarray, np.ndarray]:
    """Labels of classes 1 … `top`, some with flag 0, that overlap each other, and tracks near most of them."""
    r = np.random.default_rng(seed)
    gt, tracks = [], []
    start, kind = r.uniform(0, 150, (14, 2)), np.where(r.random(14) < 0.5, 1, r.integers(1, top + 1, 14))
    kind[0], kind[1] = 1, min(8, top)
    for frame in range(1, FRAMES + 1):
        for k in np.flatnonzero(r.random(14) < 0.9):
            box = [*(start[k] + 3 * frame + r.normal(0, 1, 2)), 40.0, 100.0]
            gt.append([frame, k + 1, *box, int(k == 0 or r.random() < 0.8), kind[k], 1])
            for n in range(int(r.random() < 0.9) + int(r.random() < 0.2)):
                moved = np.add(box, [*r.normal(0, 8, 2), 0, 0])
                tracks.append([frame, 20 + k + 14 * n, *moved, 0.9, -1, -1, -1])
    return np.array(gt), np.array(tracks)


def ours(source: Path, tracks: Path, classes: str | None = None) -> tuple[Truth, Scores]:
    (sequence,) = open_source(source, person_class=classes)
    truth = sequence.truth
    return truth, evaluate(truth, read_tracks(tracks, fps=10, length=FRAMES))


@pytest.mark.parametrize("name", ["MOT17-99", "MOT20-99"])
@pytest.mark.parametrize("seed", range(4))
def test_equal_to_trackeval(tmp_path: Path, name: str, seed: int) -> None:
    source, tracks = written(tmp_path, *crowded(seed), name)
    config = {"BENCHMARK": name[:5], "SKIP_SPLIT_FOL": True, "SEQ_INFO": {name: FRAMES}, "DO_PREPROC": True}
    (expected,) = trackeval_files(tmp_path / "gt", tmp_path / "trackers", "t", **config).values()
    truth, found = ours(source, tracks)
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, abs=1e-9), key
    weighted = Scorer(truth).compare([read_tracks(tracks, fps=10, length=FRAMES)])[0].weighted_scores("hull")
    assert weighted(np.ones((1, FRAMES)))[0, list(found).index("MOTA")] == pytest.approx(expected["MOTA"], abs=1e-9)


PERSON = [1, 1, 0, 0, 40, 100, 1, 1, 1]
FALSE = [
    ("MOT17-01", [[1, 2, 500, 0, 40, 100, 0, 6, 1]], 1),  # a vehicle without motor
    ("MOT20-01", [[1, 2, 500, 0, 40, 100, 0, 6, 1]], 0),
    ("S", [[1, 2, 500, 0, 40, 100, 1, 7, 1], [1, 3, 900, 0, 9, 9, 1, 40, 1]], 1),  # classes are not MOTChallenge's
]


@pytest.mark.parametrize(("name", "more", "false"), FALSE)
def test_which_classes_are_distractors(tmp_path: Path, name: str, more: list[list[int]], false: int) -> None:
    gt = np.array([PERSON, *more])
    rows = np.c_[gt[:2, :6], np.ones(2), -np.ones((2, 3))]
    files = written(tmp_path, gt, rows, name)
    assert {ours(*files, classes)[1]["FP"] for classes in (None, "0,1")} == {false}


def test_a_person_who_stands_on_a_distractor_keeps_the_track(tmp_path: Path) -> None:
    """The track fits the person better; a second track is matched to the distractor and left out."""
    gt = np.array([[1, 1, 0, 0, 40, 100, 1, 1, 1], [1, 2, 4, 0, 40, 100, 0, 7, 1]])
    one = np.array([[1, 5, 1, 0, 40, 100, 1, -1, -1, -1]])
    two = np.r_[one, [[1, 6, 5, 0, 40, 100, 1, -1, -1, -1]]]
    for name, rows in (("one", one), ("two", two)):
        found = ours(*written(tmp_path / name, gt, rows, "MOT17-01"))[1]
        assert (found["TP"], found["FP"], found["FN"]) == (1, 0, 0), name
