"""What users get wrong: one clear line that names file and place, the right exit code, nothing half-written."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.sealing import seal_again
from tracking.app.cli import run

ROOT = Path(__file__).resolve().parents[3]
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
    small = ["--set", "camera.image=[160,120]"]
    assert run(["generate", str(scene), "--seeds", "40000", "--out", str(folder / "data"), *small]) == 0
    return folder


def refused(line: list[str], capsys, code: int = 2) -> str:
    """Runs a command that must fail; returns its one line on stderr, after checking that --json has the same error."""
    capsys.readouterr()
    assert run(line) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    (text,) = [row for row in printed.err.splitlines() if not row.startswith("warning: ")]
    assert run([*line, "--json"]) == code
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == ("refused" if code == 2 else "failed")
    error = answer["error"]
    assert all(part in text for part in error.values() if part), (text, answer)
    assert all(error[part] for part in ("got", "expected", "remedy")), error
    assert error["file"] or error["place"], error
    return text


@pytest.mark.parametrize("name", SCENES)
def test_wrong_scenarios(name, tmp_path, capsys):
    text, words = SCENES[name]
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(text)
    for line in (["scenarios", str(scene)], ["generate", str(scene), "--seeds", "0:3", "--out", str(out)]):
        output = refused(line, capsys)
        assert all(word in output for word in [str(scene), *words]), output
    assert not out.exists()


SAME = GROUP.replace('"a"', '"b"')
DRAWN = GROUP.replace("[4, 4]", "[{ uniform = [4, 4.1] }, 4]")
NEVER = MERGE.replace("time = 1.0", "distance_lt = 0.1")

# what only a simulation can tell: the file's text, the exit code, and what the line must say.
WORLDS = {
    "out of view": (f"camera = {{ height = 2, position = [4, 1] }}\ngroup = [{GROUP}]", 2, ["camera.height", "view"]),
    "a place that is taken": (f"group = [{GROUP}, {SAME}]", 2, ["group.b.start", "another group"]),
    "always in a wall": (
        f"world = {{ walls = [[4, 0, 4, 9]] }}\ngroup = [{DRAWN}]",
        2,
        ["group.a.start", "no free place"],
    ),
    "an order that never fires": (
        f"duration = 4\ngroup = [{GROUP}, {OTHER}]\nevent = [{NEVER}]",
        1,
        ["event m", "never fired"],
    ),
    "an order that does not come true": (
        f"duration = 4\ngroup = [{GROUP}, {OTHER}]\nevent = [{MERGE}]",
        1,
        ["event m", "no such merge"],
    ),
}


@pytest.mark.parametrize("name", WORLDS)
def test_what_only_a_simulation_can_tell(name, tmp_path, capsys):
    """The scenario's file and the seed are named, and nothing is written."""
    text, code, output = WORLDS[name]
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(f"schema = 1\n{text}")
    line = refused(["generate", str(scene), "--seeds", "0:2", "--out", str(out)], capsys, code)
    assert all(word in line for word in [f"{scene}: ", "(seed 0)", "scene-s00001", *output]), line
    assert not out.exists()


def test_an_entry_of_a_suite_is_named_with_its_file(tmp_path, capsys):
    text, code, _ = WORLDS["out of view"]
    (tmp_path / "scene.toml").write_text(f"schema = 1\n{text}")
    suite = tmp_path / "suite.toml"
    suite.write_text('[[entry]]\nname = "low"\nscenario = "scene.toml"\n')
    line = refused(["generate", str(suite), "--seeds", "0", "--out", str(tmp_path / "out")], capsys, code)
    assert f"{suite}: entry low: camera.height" in line


TRACKERS = {
    "raises": ("return 1 / 0", 1, ["ZeroDivisionError", "scene-s40000, frame 1"]),
    "says nothing": ("return None", 1, ["NoneType", "frame 1"]),
    "is no Python": ("return (", 2, ["SyntaxError", "line 5"]),
    "needs what is not there": ("", 2, ["needs stereo"]),
}


@pytest.mark.parametrize("name", TRACKERS)
def test_wrong_trackers(name, made, tmp_path, capsys):
    body, code, words = TRACKERS[name]
    file, out = tmp_path / "mine.py", tmp_path / "out"
    needs = "boxes" if body else "stereo"
    file.write_text(
        f"class Mine:\n    needs = ({needs!r},)\n    def reset(self, context, seed): ...\n"
        f"    def step(self, frame, detections):\n        {body or 'return None'}\n"
    )
    line = refused(["track", f"{file}:Mine", str(made / "data"), "--out", str(out)], capsys, code)
    assert all(word in line for word in words), line
    assert body == "" or str(file) in line
    assert not out.exists()


@pytest.mark.parametrize(
    ("line", "suffix"),
    [
        ("scenarios merge --out {0}/plan.pdf", "svg"), ("sheet {1} --out {0}/sheet.jpg", "png"),
        ("overlay {1} --out {0}/film.avi", "mp4"), ("view {1} --out {0}/page", "html"),
        ("fit sensor {1} --out {0}/mine.txt", "toml"), ("fit grouping merge --out {0}/mine.txt", "toml"),
    ],
)  # fmt: skip
def test_a_file_is_what_its_name_says(line, suffix, made, tmp_path, capsys):
    words = line.format(tmp_path, made / "data" / "flockscope-demo" / "scene-s40000").split()
    assert f"expected a file that ends in .{suffix}; write {tmp_path}/" in refused(words, capsys)
    assert not list(tmp_path.iterdir())


PARAMS = {
    "no TOML": ("gate = [", ["TOML"]),
    "unknown": ("[params]\ngaet = 0.9", ["gaet", "gate"]),
    "wrong type": ('[params]\ngate = "wide"', ["gate", "wide"]),
    "another table": ("[other]\ngate = 0.9", ["other", "params"]),
    "another tracker's": ('tracker = "other"\n[params]\ngate = 0.9', ["other"]),
}


@pytest.mark.parametrize("name", PARAMS)
def test_wrong_parameter_files(name, made, tmp_path, capsys):
    text, words = PARAMS[name]
    file, out = tmp_path / "params.toml", tmp_path / "out"
    file.write_text(text)
    line = refused(["track", "blob", str(made / "data"), "--params", str(file), "--out", str(out)], capsys)
    assert all(word in line for word in [str(file), *words]), line
    assert not out.exists()


@pytest.mark.parametrize("text", ["{", "{}", "[1]", '{"format": 1, "kind": "fish"}', "\xff"])
def test_wrong_cameras(text, tmp_path, capsys):
    file, det, out = tmp_path / "camera.json", tmp_path / "det.txt", tmp_path / "out"
    file.write_bytes(text.encode("latin-1"))
    det.write_text("1,-1,10,10,20,50,0.9\n")
    line = ["track", "blob", str(det), "--fps", "10", "--camera", str(file), "--out", str(out)]
    assert str(file) in refused(line, capsys)
    assert not out.exists()


@pytest.mark.parametrize("option", ["--fps", "--px-per-m"])
@pytest.mark.parametrize("value", ["0", "-1", "nan", "inf", "x"])
def test_wrong_scales(option, value, tmp_path, capsys):
    (tmp_path / "det.txt").write_text("1,-1,10,10,20,50,0.9\n")
    line = ["track", "blob", str(tmp_path / "det.txt"), f"{option}={value}", "--out", str(tmp_path / "out")]
    assert option in refused(line, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["a word", "NaN", "no width", "frame 0", "too few columns", "no text"])
def test_wrong_detections(name, tmp_path, capsys):
    det, out = tmp_path / "seq" / "det" / "det.txt", tmp_path / "out"
    det.parent.mkdir(parents=True)
    det.write_bytes(MOT[name][0].encode("latin-1"))
    line = refused(["track", "blob", str(tmp_path / "seq"), "--fps", "10", "--out", str(out)], capsys)
    assert all(word in line for word in [str(det), *MOT[name][1]]), line
    assert not out.exists()


@pytest.mark.parametrize("text", ["duration", "=3", "camera.fsp=3", "group.c.size=2", "tracker.gate=1", "duration=[1"])
def test_wrong_settings_of_a_scenario(text, made, tmp_path, capsys):
    line = ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", str(tmp_path / "out"), "--set", text]
    assert text.partition("=")[0] in refused(line, capsys)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("text", ["gate", "gaet=0.9", "gate=7", "gate=x", "scenario.duration=3", "sensor.noise_m=3"])
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


@pytest.mark.parametrize("streams", ["none", "ids", "disparity,ids"])
def test_a_kind_of_pictures_that_nothing_is_stored_as(streams, made, tmp_path, capsys):
    line = ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", str(tmp_path / "out")]
    assert "--images" in refused([*line, "--streams", streams, "--images", "png"], capsys)
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
        output = refused(["score", str(sequence), str(tracks)], capsys)
        assert all(word in output for word in [str(path), *words]), output
    gt.write_bytes(text.encode("latin-1"))
    for line in (
        ["track", "blob", str(sequence), "--detections", "truth", "--out", str(out)],
        ["view", str(sequence), "--out", str(out / "page.html")],
        ["sheet", str(sequence), "--out", str(out / "sheet.png")],
        ["export", "coco", str(sequence), "--out", str(out / "coco.json")],
    ):
        output = refused(line, capsys)
        assert all(word in output for word in [str(gt), *words]), output
    assert not out.exists()


@pytest.mark.parametrize("name", ["tracks.parquet", "groups.parquet", "events.json", "run.json"])
def test_tracks_cut_short(name, made, tmp_path, capsys):
    tracks = tmp_path / "tracks"
    assert run(["track", "blob", str(made / "data"), "--out", str(tracks)]) == 0
    (path,) = tracks.rglob(name)
    path.write_bytes(path.read_bytes()[:-20])
    for line in (["score"], ["view", "--out", str(tmp_path / "page.html")]):
        output = refused([line[0], str(made / "data"), str(tracks), *line[1:]], capsys)
        assert str(path) in output
    assert not (tmp_path / "page.html").exists()


@pytest.mark.parametrize(
    "name", ["gt/truth.parquet", "det/det.parquet", "manifest.json", "camera.json", "gt/events.json"]
)
def test_a_dataset_with_a_file_missing(name, made, tmp_path, capsys):
    data, out = tmp_path / "data", tmp_path / "out"
    shutil.copytree(made / "data", data)
    (path,) = data.rglob(name)
    path.unlink()
    lines = (["track", "blob"], ["view"], ["sheet"], ["export", "coco"], ["export", "webdataset"])
    for words in lines:
        assert str(path) in refused([*words, str(data), "--out", str(out / "x")], capsys), words
    assert run(["validate", str(data)]) == 1
    assert str(path) in capsys.readouterr().out
    assert not out.exists()


def writers(made: Path, out: Path) -> list[list[str]]:
    """Every command that writes."""
    data = made / "data" / "flockscope-demo" / "scene-s40000"
    return [
        ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", str(out)],
        ["track", "blob", str(data), "--out", str(out)],
        ["view", str(data), "--out", str(out / "page.html")],
        ["sheet", str(data), "--out", str(out / "sheet.png")],
        ["overlay", str(data), "--out", str(out / "film.mp4")],
        ["export", "coco", str(data), "--out", str(out / "coco.json")],
        ["export", "webdataset", str(data), "--out", str(out)],
        ["scenarios", str(made / "scene.toml"), "--out", str(out / "plan.svg")],
        ["demo", "--quick", "--out", str(out)],
    ]


def test_a_file_in_the_place_of_the_folder_to_write(made, capsys):
    """Root may write anywhere: a path through a file is what cannot be written."""
    for line in writers(made, made / "scene.toml" / "out"):
        assert "scene.toml" in refused(line, capsys)


@contextmanager
def disk(folder: Path, options: str) -> Iterator[Path]:
    """A small file system of its own."""
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", folder]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("no right to mount a file system")
    try:
        yield folder
    finally:
        subprocess.run(["umount", folder], check=True)


@pytest.mark.slow
def test_a_disk_that_cannot_be_written(made, tmp_path, capsys):
    with disk(tmp_path / "disk", "ro") as root:
        for line in writers(made, root / "out"):
            output = refused(line, capsys)
            assert "Read-only" in output, output
            assert str(root) in output, output


@pytest.mark.slow
def test_a_full_disk(made, tmp_path, capsys):
    with disk(tmp_path / "disk", "size=4k") as root:
        (root / "full").write_bytes(bytes(4096))
        for line in writers(made, root / "out"):
            assert "No space" in refused(line, capsys, 1)
            assert sorted(root.iterdir()) == [root / "full"], line


@pytest.mark.slow
def test_a_full_disk_or_nobody_behind_stdout(made):
    """A result that cannot be written is an error; a closed pipe is not."""
    line = [sys.executable, "-m", "tracking.app.cli", "validate", str(made / "data")]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(line, stdout=full, stderr=subprocess.PIPE, text=True, check=False, cwd=ROOT)
    assert done.returncode == 1
    assert done.stderr.startswith("error: stdout: got No space left")
    assert len(done.stderr.splitlines()) == 1
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run(line, stdout=write, stderr=subprocess.PIPE, text=True, check=False, cwd=ROOT)
    os.close(write)
    assert (done.returncode, done.stderr) == (0, "")


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
    seal_again(tmp_path / "t" / "other", sequence="other")
    output = refused(["score", str(made / "data"), str(tmp_path / "t")], capsys)
    assert "scene-s40000" in output
    assert "other" in output


def test_nothing_labelled(tmp_path, capsys):
    det = tmp_path / "seq" / "det"
    det.mkdir(parents=True)
    (det / "det.txt").write_text("1,-1,10,10,20,50,0.9\n")
    (tmp_path / "tracks.txt").write_text("1,1,10,10,20,50,0.9\n")
    for line in (
        ["score", str(tmp_path / "seq"), str(tmp_path / "tracks.txt")],
        ["sheet", str(tmp_path / "seq"), "--out", "x.png"],
    ):
        assert "label" in refused(line, capsys)


def test_recordings_only_options_are_refused_for_generated_ones(made, tmp_path, capsys):
    for option in (["--fps", "5"], ["--px-per-m", "30"], ["--camera", str(next(made.rglob("camera.json")))]):
        output = refused(["track", "blob", str(made / "data"), "--out", str(tmp_path / "t"), *option], capsys)
        assert option[0] in output


def test_options_without_effect_are_refused_for_recordings(made, tmp_path, capsys):
    """A BIWI recording is in metres already, a CAVIAR one knows no ground."""
    (tmp_path / "obsmat.txt").write_text("")
    (tmp_path / "people.xml").write_text("<dataset/>")
    camera = next(made.rglob("camera.json"))
    given = [("obsmat.txt", "--px-per-m", "30"), ("obsmat.txt", "--camera", camera), ("people.xml", "--camera", camera)]
    for name, option, value in given:
        line = ["track", "blob", str(tmp_path / name), "--out", str(tmp_path / "t"), option, str(value)]
        assert option in refused(line, capsys)


def test_points_for_a_tracker_of_boxes(tmp_path, capsys):
    """Said before a frame is read."""
    (tmp_path / "det.txt").write_text("1,-1,-1,-1,-1,-1,0.9,2,3,0\n")
    line = ["track", "blob", str(tmp_path / "det.txt"), "--fps", "10", "--out", str(tmp_path / "t")]
    output = refused(line, capsys)
    assert "points alone" in output
    assert "boxes" in output
