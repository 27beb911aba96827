"""`flockscope export csv` and `export parquet`: of runs and sequences, one or several, and what is refused."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from tests.refusals import answer
from tests.short_scene import write_short_scene
from tracking.app.cli import run
from tracking.recordings.source import open_source
from tracking.recordings.track_texts import read_tracks


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sequences of two people, and the groups that `group` finds in each."""
    folder = tmp_path_factory.mktemp("tables")
    write_short_scene(folder, "20000:20002")
    assert run(["group", str(folder / "data"), "--out", str(folder / "runs")]) == 0
    return folder


def table(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text().splitlines()))


def test_a_run_agrees_with_its_tables(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stored = made / "runs" / "scene-s20000"
    (told,) = answer(capsys, "export", "csv", stored, "--out", tmp_path)["tables"]
    tracks = read_tracks(stored)
    people = [(t.index, int(i), int(g)) for t in tracks for i, g in zip(t.id, t.group, strict=True)]
    assert [(int(r["frame"]), int(r["id"]), int(r["group"])) for r in table(tmp_path / "people.csv")] == people
    assert told["rows"]["people"] == len(people) > 0
    assert told["rows"]["events"] == len(table(tmp_path / "events.csv")) == sum(len(t.events) for t in tracks)
    assert {int(r["id"]) for r in table(tmp_path / "groups.csv")} == {int(g) for t in tracks for g in t.groups.id}


def test_several_have_a_folder_each(made: Path, tmp_path: Path) -> None:
    for source in ("runs", "data"):
        assert run(["export", "parquet", str(made / source), "--out", str(tmp_path / source)]) == 0
        assert {p.name for p in (tmp_path / source).iterdir()} == {"scene-s20000", "scene-s20001"}
    (first, _) = open_source(made / "data")
    labels = pq.read_table(tmp_path / "data" / "scene-s20000" / "people.parquet")
    assert labels["x_m"].to_pylist() == first.truth.pos[:, 0].tolist()
    assert json.loads(labels.schema.metadata[b"flockscope"])["fps"] == first.fps
