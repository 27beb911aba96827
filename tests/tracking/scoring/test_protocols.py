"""Files of MOTChallenge and KITTI have TrackEval's scores, in each sequence and pooled; what is left out is counted."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.metrics import BOTH, ROW, file_differences, trackeval_rows, written_dataset
from tests.refusals import answer
from tracking.app.cli import run
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks
from tracking.scoring import evaluate, pooled
from tracking.scoring.evaluation import Scores

pytest.importorskip("trackeval", reason="trackeval is installed by `make test`")


@pytest.mark.parametrize("protocol", BOTH)
def test_equal_to_trackeval(protocol: str) -> None:
    """Random labels with distractors, levels of occlusion and truncation, small boxes and ignored regions."""
    for key, differences in file_differences(protocol, range(1000, 1004)).items():
        assert max(differences) < 1e-12, key


def kitti(folder: Path, tracks: list[tuple]) -> Scores:
    """Scores of tracks (left, top, right, bottom) in a frame with one person, one seated person, and a region."""
    labels = [
        (0, 1, "Pedestrian", 0, 2, 100, 100, 130, 180), (0, 2, "Person", 0, 0, 300, 100, 330, 180),
        (0, 3, "Pedestrian", 0, 3, 500, 100, 530, 180), (0, 4, "Pedestrian", 1, 0, 700, 100, 730, 180),
        (0, -1, "DontCare", -1, -1, 900, 100, 1000, 200),
    ]  # fmt: skip
    results = [(0, 10 + k, "Pedestrian", 0, 0, *box) for k, box in enumerate(tracks)]
    for name, rows in (("gt.txt", labels), ("t.txt", results)):
        (folder / name).write_text("".join(ROW.format(*row) + "\n" for row in rows))
    truth = open_source(folder / "gt.txt")[0].truth
    return evaluate(truth, read_tracks(folder / "t.txt", fps=10, length=1))


# Counted by hand from the rules of KITTI: true positives, false positives, left out.
CASES = {
    "on the person": ([(100, 100, 130, 180)], (1, 0, 0)),
    "on the seated person": ([(300, 100, 330, 180)], (0, 0, 1)),
    "twice on the seated person": ([(300, 100, 330, 180), (301, 100, 331, 180)], (0, 1, 1)),
    "on a hidden person": ([(500, 100, 530, 180)], (0, 0, 1)),
    "on a truncated person": ([(700, 100, 730, 180)], (0, 0, 1)),
    "in the region": ([(910, 100, 940, 180)], (0, 0, 1)),
    "a little more than half in the region": ([(990, 100, 1009, 180)], (0, 0, 1)),
    "half in the region": ([(990, 100, 1010, 180)], (0, 1, 0)),
    "25 px high": ([(600, 100, 610, 125)], (0, 0, 1)),
    "26 px high": ([(600, 100, 610, 126)], (0, 1, 0)),
}


@pytest.mark.parametrize("case", CASES)
def test_rules_of_kitti(tmp_path: Path, case: str) -> None:
    tracks, expected = CASES[case]
    found = kitti(tmp_path, tracks)
    assert (found["TP"], found["FP"], found.left_out) == expected


def test_a_pooled_sequence_weighs_by_its_people(tmp_path: Path) -> None:
    """One person of two is found, exactly: HOTA is sqrt(1/2 x 1), not the mean of 1 and 0."""
    (tmp_path / "a").mkdir(), (tmp_path / "b").mkdir()
    found = pooled([kitti(tmp_path / "a", [(100, 100, 130, 180)]), kitti(tmp_path / "b", [(910, 100, 940, 180)])])
    assert (found["TP"], found["FN"], found["FP"], found["MOTA"], found["DetA"]) == (1, 1, 0, 0.5, 0.5)
    assert found["HOTA"] == pytest.approx(0.5**0.5)
    assert pooled([]) == {}


def test_the_pooled_row_of_a_command(tmp_path: Path, capsys) -> None:
    """One run and several have it in text, JSON and CSV; it has no interval and ranks nobody."""
    written_dataset(tmp_path, "MOTChallenge", 7)
    expected = trackeval_rows(tmp_path, "MOTChallenge", "pedestrian")["pooled"]
    gt, results = tmp_path / "gt", tmp_path / "trackers" / "t" / "data"
    other = tmp_path / "other"
    other.mkdir()
    for path in results.iterdir():
        (other / path.name).write_text(path.read_text())
    table = tmp_path / "scores.csv"
    one = answer(capsys, "score", gt, results, "--csv", table)
    assert one["pooled"]["HOTA"] == pytest.approx(expected["HOTA"], abs=1e-12)
    assert one["pooled"]["FP"] == expected["CLR_FP"]
    assert one["mean"]["HOTA"]["mean"] != pytest.approx(expected["HOTA"], abs=1e-3)
    lines = [line.split(",") for line in table.read_text().splitlines()]
    (row,) = [line for line in lines if line[:2] == ["data", "pooled"]]
    assert float(row[lines[0].index("HOTA")]) == pytest.approx(expected["HOTA"], abs=1e-12)
    assert row[lines[0].index("group_F1")] == ""
    both = answer(capsys, "score", gt, results, other)
    assert [row["pooled"]["IDF1"] for row in both["ranking"] if row["first"]] == pytest.approx([expected["IDF1"]] * 2)
    assert run(["score", str(gt), str(results)]) == 0
    text = capsys.readouterr().out
    assert re.search(rf"^pooled +– +{expected['HOTA']:.3f} ", text, re.MULTILINE)
    assert "as TrackEval's COMBINED, without an interval" in text
    assert run(["score", str(gt), str(results), str(other)]) == 0
    assert f"{expected['HOTA']:.3f}" in capsys.readouterr().out.partition("pooled")[2]


@pytest.mark.parametrize(("case", "hota", "mota"), [("38", 0.907, 0.939)])
def test_a_reported_case(shared_data: Path, capsys, case: str, hota: float, mota: float) -> None:
    folder = shared_data / "cases" / case
    found = answer(capsys, "score", folder / "gt", folder / "res")["pooled"]
    assert (round(found["HOTA"], 3), round(found["MOTA"], 3)) == (hota, mota)


def test_what_is_left_out_is_said(shared_data: Path, capsys) -> None:
    folder = shared_data / "cases" / "31"
    assert run(["score", str(folder / "gt.txt"), str(folder / "tracks.txt")]) == 0
    text = capsys.readouterr().out
    assert "80 tracked boxes are left out by the labels" in text
    found = answer(capsys, "score", folder / "gt.txt", folder / "tracks.txt")["sequences"][0]
    assert (found["HOTA"], found["FP"], found["left_out"]) == (1, 0, 80)
