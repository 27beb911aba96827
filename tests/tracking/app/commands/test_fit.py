"""`flockscope fit` as a user calls it, and `--sensor` and `--grouping` with what it wrote."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from scenarios import load, sensor_settings
from sim.store.camera_files import camera_document
from sim.store.tables import json_document
from sim.store.track_files import write_tracks
from tests.boxed_people import CAMERA, boxed, place
from tests.refusals import answer, refused
from tracking.app.cli import run
from tracking.grouping.belief import Belief, default_belief
from tracking.recordings.source import open_source
from tracking.running.explained_people import explained_people


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A generated sequence: a recording with gt and det like any other."""
    out = tmp_path_factory.mktemp("fit") / "data"
    words = ["generate", "street", "--seeds", "30000", "--streams", "none", "--set", "duration=12.0", "--out", str(out)]
    assert run(words) == 0
    return out


@pytest.mark.slow
def test_fit_generate_and_track_with_it(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    profile = tmp_path / "mine.toml"
    output = answer(capsys, "fit", "sensor", made, made, "--out", profile)
    assert output["measured"]["missed"] == pytest.approx(output["drawn"]["missed"], abs=0.05)
    assert load("merge", set=sensor_settings(profile)).sensor.detect_prob == output["sensor"]["detect_prob"]
    out = tmp_path / "data"
    words = ["generate", "merge", "--seeds", "0", "--streams", "none", "--sensor", profile, "--out", out]
    answer(capsys, *words, "--set", "sensor.clutter_rate=0.0")
    stored = load(out / "flockscope-train" / "merge-s00000" / "scenario.toml").sensor
    assert stored.box_noise is not None
    assert stored.clutter_rate == 0.0
    line = ["track", "blob", made, "--sensor", profile, "--out", tmp_path / "t"]
    answer(capsys, *line, "--detections", "truth")
    assert "--sensor" in refused(capsys, *line, "--detections", "file")


def test_a_belief_is_fitted_and_used(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("one.toml", "two.toml")]
    words = ("fit", "grouping", "side-by-side", "pass-by", "--seeds", "30000:30002", "--out")
    first, _ = (answer(capsys, *words, file) for file in files)
    assert files[0].read_text() == files[1].read_text(), "a fit gives the same file again"
    assert first["fitted"]["F1"] > 0.95
    assert first["fitted"]["pairs"] > 10
    answer(capsys, "track", "blob", made, "--detections", "truth", "--grouping", files[0], "--out", tmp_path / "t")
    assert "--fps" in refused(capsys, *words[:-1], "--fps", "5", "--out", tmp_path / "x.toml")
    (run_file,) = (tmp_path / "t").rglob("run.json")
    assert json.loads(run_file.read_text())["grouping"]["grouping"] == "belief"


def answers_by_truth(source: Path, folder: Path, kinds: tuple[str, ...] = ("not", "together")) -> Path:
    """Answers to the questions of a page about a recording, as its labels have it, saved as the page does."""
    page = folder / "page.html"
    assert run(["view", str(source), "--out", str(page)]) == 0
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page.read_text(), re.DOTALL)[0])
    (sequence,) = open_source(source)
    columns = (getattr(sequence.truth, name).tolist() for name in ("frame", "id", "group"))
    group = {(f, p): g for f, p, g in zip(*columns, strict=True)}
    said = []
    for q in data["pairs"]["truth"]["questions"]:
        mates = group[q["first"], q["a"]] == group[q["first"], q["b"]] >= 0
        span = {"from": (q["first"] - 1) / data["fps"], "to": (q["last"] - 1) / data["fps"]}
        said.append({"a": q["a"], "b": q["b"], **span, "answer": kinds[mates]})
    head = {"format": 1, "kind": "pair labels", "recording": data["name"], "frames": data["length"]}
    file = folder / "answers.json"
    file.write_text(json.dumps({**head, "people": data["pairs"]["truth"]["people"], "answers": said}))
    return file


def test_a_belief_is_adapted_by_answers(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (source,) = made.glob("*/street-*")
    file, mine = answers_by_truth(source, tmp_path), tmp_path / "mine.toml"
    found = answer(capsys, "fit", "grouping", "--labels", file, source, "--out", mine)["fitted"]
    assert found["answers"] == len(json.loads(file.read_text())["answers"])
    assert found["agreed"] >= found["agreed before"]
    belief = Belief.from_toml(mine)
    np.testing.assert_allclose(belief.threshold, default_belief().threshold)
    assert belief.bias[0] == pytest.approx(default_belief().bias[0] + found["bias"], abs=6e-4)
    assert run(["fit", "grouping", "--labels", str(file), "--labels", str(file), str(source), "--out", str(mine)]) == 0
    assert "answers, the adapted one with" in capsys.readouterr().out
    assert f"# flockscope fit grouping {source} --labels {file} --labels {file}" in mine.read_text()
    answer(capsys, "group", source, "--grouping", mine, "--out", tmp_path / "run")
    one = answers_by_truth(source, tmp_path, ("don't know", "together"))
    assert run(["fit", "grouping", "--labels", str(one), str(source), "--out", str(mine)]) == 0
    assert "all answers are of one kind" in capsys.readouterr().out


def test_answers_about_boxes_before_a_camera_fit_their_run(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """The page has the camera, a stored run of boxes does not: it is given, or the refusal names it."""
    tracks = boxed(place(2.0, 14.0))
    lines = [f"{t.index},{id},{','.join(map(str, box))},1" for t in tracks for id, box in zip(t.id, t.box, strict=True)]
    (tmp_path / "boxes.txt").write_text("\n".join(lines))
    (tmp_path / "above.json").write_bytes(json_document(camera_document(CAMERA)))
    info = {"tracker": "mine.py:Mine", "plane": "image", "input": "boxes", "sequence": "boxes"}
    write_tracks(tmp_path / "run", tracks, fps=10.0, info=info)
    page, options = tmp_path / "page.html", ["--fps", "10", "--camera", tmp_path / "above.json"]
    answer(capsys, "view", tmp_path / "boxes.txt", tmp_path / "run", *options, "--out", page)
    data = json.loads(re.findall(r'id="data">(.*?)</script>', page.read_text(), re.DOTALL)[0])
    said = [{"a": 1, "b": 2, "from": 0.0, "to": 7.0, "answer": "together"}]
    head = {"format": 1, "kind": "pair labels", "recording": "boxes", "frames": data["length"]}
    file = tmp_path / "answers.json"
    file.write_text(json.dumps({**head, "people": data["pairs"]["tracks"]["people"], "answers": said}))
    line = ["fit", "grouping", "--labels", file, tmp_path / "run", "--out", tmp_path / "mine.toml", *options]
    assert answer(capsys, *line)["fitted"]["answers"] == 1
    assert "--camera" in refused(capsys, *line[:-2])


def test_answers_fit_one_of_two_recordings_of_a_name(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    texts = [tmp_path / folder / "walk.csv" for folder in ("first", "second")]
    for text, apart in zip(texts, (0.7, 0.9), strict=True):
        text.parent.mkdir()
        text.write_text("\n".join(f"{f},{k},{0.13 * f:.2f},{apart * k:.2f}" for f in range(1, 60) for k in (1, 2)))
    people = explained_people(open_source(texts[0], fps=10)[0], None, default_belief()).people
    said = [{"a": 1, "b": 2, "from": 0.0, "to": 4.0, "answer": "together"}]
    head = {"format": 1, "kind": "pair labels", "recording": "walk", "frames": 59}
    file = tmp_path / "answers.json"
    file.write_text(json.dumps({**head, "people": people, "answers": said}))
    line = ["fit", "grouping", "--labels", file, *texts, "--fps", "10", "--out", tmp_path / "mine.toml"]
    assert answer(capsys, *line)["fitted"]["answers"] == 1


def test_wrong_labels_are_refused(made: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    (source,) = made.glob("*/street-*")
    file, out = answers_by_truth(source, tmp_path), tmp_path / "mine.toml"
    (tmp_path / "other.csv").write_text("frame,id,x,y\n" + "".join(f"{f},1,{f},2\n" for f in range(1, 9)))
    line = ["fit", "grouping", "--labels", file, "--out", out]
    assert "--events" in refused(capsys, *line, source, "--events", "cross")
    shown = refused(capsys, *line, tmp_path / "other.csv", "--fps", "5")
    assert f"{file}: people: got other people: of street-s30000" in shown
    assert "those of other, 8 frames" in shown
    assert f"{tmp_path / 'none.json'}" in refused(capsys, *line[:3], tmp_path / "none.json", source, "--out", out)
    assert "street: got" in refused(capsys, *line, "street")
    assert not out.exists()
