"""`flockscope score TRUTH TRACKS TRACKS…`: the ranking is that of `tracking.compare`, in any order of the runs."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace

import pytest

import tracking
from tests.processes import FAKE
from tests.refusals import answer
from tests.short_scene import write_short_scene
from tracking import track
from tracking.app.cli import run
from tracking.app.score_ranking import ranked_runs, ranking_result
from tracking.comparison import ComparedSequence
from tracking.recordings.source import open_source
from tracking.scoring.catalogue import CATALOGUE
from tracking.scoring.evaluation import Scores


def printed(**differing: tuple[float, float]) -> str:
    """The ranking of two runs with different inputs, whose scores are 0.5 but for those that differ."""
    scores = []
    for values in zip(*differing.values(), strict=True):
        by_key = {**dict.fromkeys(CATALOGUE, 0.5), **dict(zip(differing, values, strict=True))}
        scores.append(Scores(by_key, "ground", "ground", "hull", 3, 3, 1))
    inputs = ["boxes (file)", "points (file)"]
    found = ComparedSequence(scores, inputs, inputs, [None, None], dict.fromkeys(inputs, scores[0]))
    return ranking_result(ranked_runs(["a", "b"], [SimpleNamespace(name="scene", fps=10.0)], [found], None)).text


def test_what_a_ranking_needs_to_be_read_stands_below_it() -> None:
    text = printed(HOTA=(0.6, 0.4))
    assert "\nobjective: mean of HOTA and group_F1" in text
    assert "fills no gaps, so trackers that do may score more" in text
    assert "give all the same input" in text
    assert "without true events" not in text


def test_no_events_and_false_ones_are_told_apart() -> None:
    words = "event_F1 without true events: – reported none either, 0 only false ones"
    assert words in printed(event_F1=(math.nan, 0.0))
    assert "without true events" not in printed(event_F1=(math.nan, math.nan))


def test_core_scores_stand_only_where_they_differ() -> None:
    text = printed(group_MOTA=(0.6, 0.4), group_MOTA_core=(0.7, 0.4), group_F1=(0.6, 0.4), group_F1_core=(0.6, 0.4))
    assert "group_MOTA_core" in text
    assert "group_F1_core" not in text
    assert "core scores equal to the strict ones are left out" in text


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
