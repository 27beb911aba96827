"""`flockscope export`: tables of runs and sequences, one or several; training data with counts; what is refused."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from sim.store import sequence_folder
from tests.made_up import make_in_view
from tests.refusals import answer, refused
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


@pytest.mark.parametrize("form", ["coco", "yolo", "kitti", "mots", "webdataset --sample frame"])
def test_kept_and_ignored_people_are_counted(tmp_path: Path, form: str, capsys: pytest.CaptureFixture[str]) -> None:
    live = make_in_view(1, ("left", "ids"))
    sequence_folder.write_sequence(
        tmp_path / "flockscope-train/s", live, scenario="schema = 1\n", seed=1, streams=("left", "ids"), images="png"
    )
    name, *options = form.split()
    found = []
    for share in ("0", "0.2"):
        out = tmp_path / f"out{share}{'.json' if name == 'coco' else ''}"
        words = ["export", name, tmp_path / "flockscope-train", *options, "--min-visibility", share, "--out", out]
        found.append(answer(capsys, *words))
    assert all(each["pictures"] == 12 for each in found)
    assert found[0]["ignored"] == 0 < found[1]["ignored"] < found[0]["kept"]
    assert found[1]["kept"] + found[1]["ignored"] == found[0]["kept"]
    assert run([*map(str, words[:-1]), str(tmp_path / f"text{out.suffix if name == 'coco' else ''}")]) == 0
    line = f"12 pictures; people: kept {found[1]['kept']}, ignored {found[1]['ignored']} with visibility under 0.2"
    assert line in capsys.readouterr().out


@pytest.mark.parametrize("option", ["--seed", "--min-visibility"])
def test_options_of_frames_are_refused_for_sequences(
    made: Path, capsys: pytest.CaptureFixture[str], option: str
) -> None:
    line = refused(capsys, "export", "webdataset", made / "data", "--out", made / "no", option, "1")
    assert f"{option}: got --sample sequence; expected --sample frame" in line
