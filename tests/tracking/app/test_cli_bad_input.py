"""What users get wrong: one clear line that names file and place, the right exit code, nothing half-written."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tracking.app.cli import run

GROUP = '{ id = "a", size = 2, start = [4, 4], goal = [12, 4] }'
OTHER = '{ id = "b", size = 2, start = [12, 4], goal = [4, 4] }'
WHEN = "when = { time = 1.0 }"
MERGE = f'{{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", {WHEN} }}'
LATE = '{ id = "n", type = "merge", groups = ["a", "b"], into = "cd", when = { after = "m" } }'

# what is wrong: the file's text, and what the line must say.
SCENES = {
    "no TOML": ("schema = = 1", ["line 1"]),
    "no group": ("schema = 1", ["group"]),
    "unknown key": (f"schema = 1\nduraton = 5.0\ngroup = [{GROUP}]", ["duraton", "duration"]),
    "unknown key inside": (f"schema = 1\ncamera = {{ fsp = 5 }}\ngroup = [{GROUP}]", ["camera.fsp", "fps"]),
    "wrong type": (f'schema = 1\nduration = "long"\ngroup = [{GROUP}]', ["duration", "long"]),
    "negative": (f"schema = 1\nduration = -1\ngroup = [{GROUP}]", ["duration", "-1"]),
    "a newer schema": (f"schema = 2\ngroup = [{GROUP}]", ["schema", "2"]),
    "starts in a wall": (
        f"schema = 1\nworld = {{ walls = [[4, 0, 4, 9]] }}\ngroup = [{GROUP}]",
        ["group.a.start", "wall"],
    ),
    "outside the world": (f"schema = 1\nworld = {{ size = [10, 10] }}\ngroup = [{GROUP}]", ["group.a.goal", "12"]),
    "a door in no wall": (
        f"schema = 1\nworld = {{ doors = [{{ at = [4, 4] }}] }}\ngroup = [{GROUP}]",
        ["world.doors.0"],
    ),
    "nobody of that name": (f"schema = 1\ngroup = [{GROUP}]\nevent = [{MERGE}]", ["event.m", "b"]),
    "a group that is no more": (f"schema = 1\ngroup = [{GROUP}, {OTHER}]\nevent = [{MERGE}, {LATE}]", ["event.n"]),
    "a group twice": (f"schema = 1\ngroup = [{GROUP}, {GROUP}]", ["group.a", "second"]),
    "extends nothing": ('extends = "nowhere.toml"', ["nowhere.toml"]),
}

ROWS = "1,1,10,10,20,50,1,1,1\n2,1,11,10,20,50,1,1,1\n3,1,12,10,20,50,1,1,1\n"
MOT = {
    "a word": (ROWS + "4,1,x,10,20,50,1,1,1\n", ["line 4", "x"]),
    "NaN": (ROWS + "4,1,nan,10,20,50,1,1,1\n", ["line 4", "nan"]),
    "no width": (ROWS + "4,1,10,10,0,50,1,1,1\n", ["line 4", "width"]),
    "an id twice in a frame": (ROWS + "3,1,40,10,20,50,1,1,1\n", ["line 4", "once"]),
    "frame 0": ("0,1,10,10,20,50,1,1,1\n" + ROWS, ["line 1", "frame"]),
    "too few columns": (ROWS + "4,1,10\n", ["line 4", "columns"]),
    "half an id": (ROWS + "4,1.5,10,10,20,50,1,1,1\n", ["line 4", "1.5"]),
    "no text": ("\xff\xfe", []),
}


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bad")
    scene = folder / "scene.toml"
    scene.write_text(f"schema = 1\nduration = 2.0\ncamera = {{ fps = 5 }}\ngroup = [{GROUP}]")
    assert run(["generate", str(scene), "--seeds", "40000", "--out", str(folder / "data")]) == 0
    return folder


def refused(line: list[str], capsys, code: int = 2) -> str:
    """The one line on stderr, which --json says too."""
    capsys.readouterr()
    assert run(line) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    (text,) = [row for row in printed.err.splitlines() if not row.startswith("warning: ")]
    assert run([*line, "--json"]) == code
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == ("refused" if code == 2 else "failed")
    assert all(part in text for part in answer["error"].values() if part), (text, answer)
    return text


@pytest.mark.parametrize("name", SCENES)
def test_wrong_scenarios(name, tmp_path, capsys):
    text, words = SCENES[name]
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(text)
    for line in (["scenarios", str(scene)], ["generate", str(scene), "--seeds", "0:3", "--out", str(out)]):
        said = refused(line, capsys)
        assert all(word in said for word in [str(scene), *words]), said
    assert not out.exists()


def test_a_group_that_walks_out_of_view(tmp_path, capsys):
    """Seen only when it is simulated: before anything is written."""
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(f"schema = 1\ncamera = {{ height = 2, position = [4, 1] }}\ngroup = [{GROUP}]")
    said = refused(["generate", str(scene), "--seeds", "0", "--out", str(out)], capsys)
    assert "view" in said
    assert "camera" in said
    assert not [p for p in out.rglob("*") if p.is_file()]


@pytest.mark.parametrize("text", ["duration", "=3", "camera.fsp=3", "group.c.size=2", "tracker.gate=1", "duration=[1"])
def test_wrong_settings_of_a_scenario(text, made, tmp_path, capsys):
    line = ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", str(tmp_path / "out"), "--set", text]
    assert text.partition("=")[0] in refused(line, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["gate", "gaet=0.9", "gate=7", "gate=x", "scenario.duration=3", "sensor.noise_px=3"])
def test_wrong_settings_of_a_tracker(text, made, tmp_path, capsys):
    line = ["track", "blob", str(made / "data"), "--out", str(tmp_path / "out"), "--set", text]
    refused(line, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["sensor.noise=3", "sensor.detect_prob=7", "sensor.box=round"])
def test_wrong_settings_of_a_sensor(text, made, tmp_path, capsys):
    line = ["track", "blob", str(made / "data"), "--out", str(tmp_path / "out"), "--detections", "truth", "--set", text]
    assert text.partition("=")[0] in refused(line, capsys)


@pytest.mark.parametrize("text", ["", "x", "3:", "5:3", "5:5", "-1:3", "1:2:3", "9990:10010", "0.5"])
def test_wrong_seeds(text, made, tmp_path, capsys):
    line = ["generate", str(made / "scene.toml"), f"--seeds={text}", "--out", str(tmp_path / "out")]
    assert "seeds" in refused(line, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", MOT)
def test_wrong_mot_text(name, tmp_path, capsys):
    text, words = MOT[name]
    out, sequence = tmp_path / "out", tmp_path / "seq"
    gt = sequence / "gt" / "gt.txt"
    gt.parent.mkdir(parents=True)
    (sequence / "seqinfo.ini").write_text("[Sequence]\nname=seq\nframeRate=10\nseqLength=5\n")
    tracks = tmp_path / "tracks.txt"
    for path, good in ((gt, tracks), (tracks, gt)):
        path.write_bytes(text.encode("latin-1"))
        good.write_text(ROWS if good == gt else ROWS.replace(",1,1,1\n", ",1\n"))
        said = refused(["score", str(sequence), str(tracks)], capsys)
        assert all(word in said for word in [str(path), *words]), said
    gt.write_bytes(text.encode("latin-1"))
    for line in (
        ["track", "blob", str(sequence), "--detections", "truth", "--out", str(out)],
        ["view", str(sequence), "--out", str(out / "page.html")],
        ["sheet", str(sequence), "--out", str(out / "sheet.png")],
        ["export", "coco", str(sequence), "--out", str(out / "coco.json")],
    ):
        said = refused(line, capsys)
        assert all(word in said for word in [str(gt), *words]), said
    assert not out.exists()


@pytest.mark.parametrize("name", ["tracks.parquet", "groups.parquet", "events.json", "run.json"])
def test_tracks_cut_short(name, made, tmp_path, capsys):
    tracks = tmp_path / "tracks"
    assert run(["track", "blob", str(made / "data"), "--out", str(tracks)]) == 0
    (path,) = tracks.rglob(name)
    path.write_bytes(path.read_bytes()[:-20])
    for line in (["score"], ["view", "--out", str(tmp_path / "page.html")]):
        said = refused([line[0], str(made / "data"), str(tracks), *line[1:]], capsys)
        assert str(path) in said
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize(
    "name", ["gt/truth.parquet", "det/det.parquet", "manifest.json", "camera.json", "gt/events.json"]
)
def test_a_dataset_with_a_file_missing(name, made, tmp_path, capsys):
    data, out = tmp_path / "data", tmp_path / "out"
    shutil.copytree(made / "data", data)
    (path,) = data.rglob(name)
    path.unlink()
    lines = {"track": ["blob", str(data)], "view": [str(data)], "sheet": [str(data)], "export": ["coco", str(data)]}
    for command, words in lines.items():
        assert str(path) in refused([command, *words, "--out", str(out / "x")], capsys), command
    assert run(["validate", str(data)]) == 1
    assert str(path) in capsys.readouterr().out
    assert not out.exists()


def test_a_file_in_the_place_of_the_folder_to_write(made, capsys):
    """Root may write anywhere: a path through a file is what cannot be written."""
    out = made / "scene.toml" / "out"
    data = made / "data" / "flockscope-demo" / "scene-s40000"
    for line in (
        ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", str(out)],
        ["track", "blob", str(data), "--out", str(out)],
        ["view", str(data), "--out", str(out / "page.html")],
        ["sheet", str(data), "--out", str(out / "sheet.png")],
        ["export", "coco", str(data), "--out", str(out / "coco.json")],
        ["scenarios", str(made / "scene.toml"), "--out", str(out / "plan.svg")],
        ["demo", "--quick", "--out", str(out)],
    ):
        assert "scene.toml" in refused(line, capsys)


def test_tracks_at_another_frame_rate(tmp_path, capsys):
    sequence = tmp_path / "seq" / "gt"
    sequence.mkdir(parents=True)
    (sequence / "gt.txt").write_text(ROWS)
    line = ["track", "blob", str(sequence.parent), "--detections", "truth", "--fps", "5", "--out", str(tmp_path / "t")]
    assert run(line) == 0
    assert "--fps 5" in refused(["score", str(sequence.parent), str(tmp_path / "t")], capsys)
    assert run(["score", str(sequence.parent), str(tmp_path / "t"), "--fps", "5"]) == 0


def test_a_sequence_without_its_tracks_is_named(made, tmp_path, capsys):
    assert run(["track", "blob", str(made / "data"), "--out", str(tmp_path / "t")]) == 0
    (tmp_path / "t" / "scene-s40000").rename(tmp_path / "t" / "other")
    run_json = tmp_path / "t" / "other" / "run.json"
    run_json.write_text(run_json.read_text().replace("scene-s40000", "other"))
    said = refused(["score", str(made / "data"), str(tmp_path / "t")], capsys)
    assert "scene-s40000" in said
    assert "other" in said


def test_nothing_labelled(tmp_path, capsys):
    det = tmp_path / "seq" / "det"
    det.mkdir(parents=True)
    (det / "det.txt").write_text("1,-1,10,10,20,50,0.9\n")
    (tmp_path / "tracks.txt").write_text("1,1,10,10,20,50,0.9\n")
    for line in (
        ["score", str(tmp_path / "seq"), str(tmp_path / "tracks.txt")],
        ["sheet", str(tmp_path / "seq"), "--out", "x"],
    ):
        assert "label" in refused(line, capsys)


def test_recordings_only_options_are_refused_for_generated_ones(made, tmp_path, capsys):
    for option in (["--fps", "5"], ["--px-per-m", "30"], ["--camera", str(next(made.rglob("camera.json")))]):
        said = refused(["track", "blob", str(made / "data"), "--out", str(tmp_path / "t"), *option], capsys)
        assert option[0] in said
