"""What users get wrong: one clear line that names file and place, the right exit code, nothing half-written."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.processes import ROOT
from tests.recordings import biwi_walk, mot_folder
from tests.refusals import refused
from tests.small_disks import small_disk
from tests.tuning_toys import TOY
from tracking.app.cli import run

GROUP = '{ id = "a", size = 2, start = [4, 4], goal = [12, 4] }'
OTHER = '{ id = "b", size = 2, start = [12, 4], goal = [4, 4] }'
MERGE = '{ id = "m", type = "merge", groups = ["a", "b"], into = "ab", when = { time = 1.0 } }'
ROWS = "1,1,10,10,20,50,1,1,1\n2,1,11,10,20,50,1,1,1\n3,1,12,10,20,50,1,1,1\n"
DETECTION = "1,-1,10,10,20,50,0.9\n"
TRACKER = (
    "class Mine:\n    needs = ('{}',)\n    def reset(self, context, seed): ...\n    def step(self, frame, found):\n"
)


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bad")
    scene = folder / "scene.toml"
    scene.write_text(f"schema = 1\nduration = 2.0\ncamera = {{ fps = 5 }}\ngroup = [{GROUP}]")
    small = ["--set", "camera.image=[160,120]"]
    assert run(["generate", str(scene), "--seeds", "40000:40002", "--out", str(folder / "data"), *small]) == 0
    assert run(["track", "blob", str(folder / "data"), "--out", str(folder / "run")]) == 0
    (folder / "people.ndjson").write_text('{"track": {"f": 1, "p": 1, "x": 8.46, "y": 3.59}}\n')
    return folder


def refused_as_json(capsys, *line: object, code: int = 2) -> str:
    """Like `refused`, after a check that --json has the same error."""
    text = refused(capsys, *line, code=code)
    assert run([*map(str, line), "--json"]) == code
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == ("refused" if code == 2 else "failed")
    error = answer["error"]
    assert all(part in text for part in error.values() if part), (text, answer)
    assert all(error[part] for part in ("got", "expected", "remedy")), error
    assert error["file"] or error["place"], error
    return text


SHOW = "scenarios {tmp}/bad"
TRACK = "track blob {made}/data --out {tmp}/out"
CLASS = "track {tmp}/bad:Mine {made}/data --out {tmp}/out"
DET = "track blob {tmp}/bad --fps 10 --out {tmp}/out"
LABELS = "track blob {tmp}/bad --fps 10 --detections truth --out {tmp}/out"
REPLAY = "replay {walk} --out {tmp}/out"
TUNE = f"tune {TOY} --trials 2 --suite {{made}}/scene.toml --out {{tmp}}/toy.toml"
GOOD = "generate {made}/scene.toml --seeds 0 --out {tmp}/out"

# what is wrong: the suffix and content of the file `bad`, the command, and what the line must say ("bad": its name).
FILES = {
    "no TOML": (".toml", "schema = = 1", SHOW, "bad line 1"),
    "parameters: unknown": (".toml", "[params]\ngaet = 0.9", TRACK + " --params {tmp}/bad", "bad gaet gate"),
    "a camera: another kind": (
        ".json", '{"format": 1, "kind": "fish"}', DET.replace("{tmp}/bad", "{det}") + " --camera {tmp}/bad", "bad"
    ),
    "a word": (".txt", DETECTION + "4,1,x,10,20,50,1,1,1\n", DET, "bad line 2 x"),
    "points alone": (".txt", "1,-1,-1,-1,-1,-1,0.9,2,3,0\n", DET, "points alone boxes"),
    "labels scored": (".txt", ROWS + "0,1,1,1,2,5,1,1,1\n", "score {tmp}/bad {tmp}/bad --fps 10", "bad line 4 frame"),
    "nothing labelled": (".txt", DETECTION, "sheet {tmp}/bad --out {tmp}/out/x.png", "label"),
    "no Python": (".py", TRACKER.format("boxes") + "        return (", CLASS, "bad SyntaxError line 5"),
    "needs what is not there": (".py", TRACKER.format("stereo") + "        return None", CLASS, "needs stereo"),
}  # fmt: skip

# the same of what only a simulation or a run finds, and with exit code 1 if it is no mistake of a file.
WORLDS = {
    "out of view": (f"camera = {{ height = 2, position = [4, 1] }}\ngroup = [{GROUP}]", 2, "camera.height view"),
    "a taken place": (f"group = [{GROUP}, {GROUP.replace('a', 'b', 1)}]", 2, "group.b.start another"),
    "an order that does not come true": (
        f"duration = 4\ngroup = [{GROUP}, {OTHER}]\nevent = [{MERGE}]", 1, "event m merge fired"
    ),
}  # fmt: skip

# an argument that is wrong, without a file, and what the line must say; "…" stands for anything.
OPTIONS = {
    **{GOOD.replace("--seeds 0", f"--seeds={text}"): "seeds"
       for text in ("", "3:", "5:3", "-1:3", "1:2:3", "9990:10010", "0:30000", "39999:40001", "0.5")},
    **{f"{DET} {option}={text}".replace("{tmp}/bad", "{det}"): option
       for option in ("--fps", "--px-per-m") for text in ("0", "nan", "x")},
    **{f"{GOOD} --set {text}": text.partition("=")[0] for text in ("duration", "=3", "camera.fsp=3", "tracker.gate=1")},
    **{f"{TRACK} --set {text}": "" for text in ("gate", "gaet=0.9", "gate=7", "gate=x", "scenario.duration=3")},
    f"{TRACK} --detections truth --set sensor.noise=3": "sensor.noise",
    f"{TRACK} --detections truth --set sensor.box=round": "sensor.box",
    GOOD.replace("{tmp}/out", "{det}/out"): "det.txt",  # a path through a file
    f"{GOOD} --streams none --images png": "--images",
    f"{TRACK} --fps 5": "--fps",  # options for recordings, of a generated sequence
    "track blob {biwi} --out {tmp}/out --px-per-m 30": "--px-per-m",  # metres already
    "track blob {caviar} --out {tmp}/out --camera {made}/scene.toml": "give a camera.json",
    "scenarios merge --out {tmp}/plan.pdf": "ends in .svg; write {tmp}/",
    "fit sensor {tmp}/none --out {tmp}/x.toml": "nothing there",
    f"{GOOD} --sensor {{tmp}}/none.toml": "No such file",
    f"{REPLAY} --seeds 0": "train",
    f"{TUNE} --seeds 0-5": "--seeds: got '0-5'",
    f"{TUNE} --test 0:5": "--test: got 0:5; expected test seeds",
    "score {made}/data {made}/data": "{made}/data: got a generated dataset, no tracks; … the --out of `flockscope",
    "score {made}/data {made}/run {made}/data": "got a generated dataset, no tracks;",
    "score {made}/run {made}/data": "{made}/run: got tracks, what `flockscope track` wrote; … swap the arguments",
    "view {made}/run {made}/data --out {tmp}/x": "{made}/run: got tracks, what … swap the arguments",
    "score {made}/data {made}/scene.toml": "{made}/scene.toml: got a .toml file, no … made by `flockscope track`",
    "score {made}/data {made}/people.ndjson": "people.ndjson: got a .ndjson file, no tracks; … or MOTChallenge text",
    "track blob {walk} --detections image --out {tmp}/x":
        "with truth; expected what both have; try --detections truth",
    "track blob {made}/data --camera {made}/scene.toml --out {tmp}/x":
        "{made}/scene.toml: line 1: got … give a camera.json",
    "generate crossing --seeds 0": "flockscope generate: got missing option '--out'; … generate --help",
    "score {made}/data {made}/run {made}/run": "TRACKS: got … twice; expected each run once",
    "score {made}/data {made}/run {made}/run/scene-s40000 --by HOTAA": "--by: got HOTAA … such as HOTA",
    "score {made}/data {made}/run --by HOTA": "got --by; expected none for one run; leave it out",
    "export coco {made}/data --out {tmp}/scene.toml": "--out: got … ends in .json",
    "replay {made}/data --out {tmp}/x --duration nan": "--duration: got nan; expected a finite number",
    "export csv {made}/data --out {tmp}/x --line a=nan,2,3,4": "--line: got 'a=nan,2,3,4'",
    "export csv {made}/data --out {tmp}/x --line a=1,1,1,1": "--line: got 'a=1,1,1,1', of length 0; expected two ends",
    "export csv {made}/data --out {tmp}/x --margin 1": "--margin: got --margin alone; expected --line or --zone",
    "export csv {made}/data --out {tmp}/x --every 0": "--every: got 0 s; expected one frame, 0.2 s, or longer",
    "export csv {made}/data --out {tmp}/x --every 1week": "--every: got '1week'; expected … write 10s or 1m",
    "export csv {made}/data --out {tmp}/x --start 1h": "--start: got 3600 s; expected a time before the end",
    "export csv {made}/data --out {tmp}/x --start 1 --end 1s": "--end: got 1 s; expected a time after the start, 1 s",
    "group {made}/data --out {tmp}/x --min-duration=-1": "--min-duration: got '-1'; expected seconds",
    "stress blob --suite crossing --vary detection --share 1 --out {tmp}/x": "invalid value for '--share'",
    "minimize cross --tracker blob --while HOTA<0.5 --minutes inf --out {tmp}/x.toml": "--minutes: got inf",
    "minimize cross --tracker blob --while HOTA<2 --out {tmp}/x.toml": "--while: got 'HOTA<2', true of a perfect",
}  # fmt: skip


@pytest.fixture
def places(made, tmp_path) -> dict[str, Path]:
    """Folders and good files that the commands above name."""
    found = {"made": made, "one": made / "data" / "flockscope-demo" / "scene-s40000", "tmp": tmp_path / "here"}
    files = {"det": ("det.txt", DETECTION), "biwi": ("obsmat.txt", ""), "caviar": ("people.xml", "<dataset/>")}
    found["walk"] = biwi_walk(tmp_path / "walk") / "obsmat.txt"
    found["tmp"].mkdir()
    for key, (name, text) in files.items():
        found[key] = tmp_path / name
        found[key].write_text(text)
    return found


@pytest.mark.parametrize("name", FILES)
def test_wrong_files(name, places, capsys):
    suffix, content, line, expected = FILES[name]
    bad = places["tmp"] / f"bad{suffix}"
    bad.write_bytes(content.encode("latin-1"))
    line = line.replace("{tmp}/bad", str(bad))
    shown = refused_as_json(capsys, *[word.format(**places) for word in line.split()])
    assert all((str(bad) if word == "bad" else word) in shown for word in expected.split()), shown
    assert [path for path in places["tmp"].iterdir() if path.name != "__pycache__"] == [bad]


@pytest.mark.parametrize("line", OPTIONS)
def test_wrong_options(line, places, capsys):
    shown = refused_as_json(capsys, *[word.format(**places) for word in line.split()])
    assert all(words in shown for words in OPTIONS[line].format(**places).split(" … ")), shown
    assert not list(places["tmp"].iterdir())


@pytest.mark.parametrize("name", WORLDS)
def test_what_only_a_simulation_can_tell(name, tmp_path, capsys):
    """The scenario's file and the seed are named, and nothing is written."""
    text, code, output = WORLDS[name]
    scene, out = tmp_path / "scene.toml", tmp_path / "out"
    scene.write_text(f"schema = 1\n{text}")
    line = refused_as_json(capsys, "generate", scene, "--seeds", "0:2", "--out", out, code=code)
    assert all(word in line for word in [f"{scene}: ", "(seed 0)", "scene-s00001", *output.split()]), line
    assert not out.exists()


def test_an_entry_of_a_suite_is_named_with_its_file(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(f"schema = 1\n{WORLDS['out of view'][0]}")
    suite = tmp_path / "suite.toml"
    suite.write_text('[[entry]]\nname = "low"\nscenario = "scene.toml"\n')
    line = refused_as_json(capsys, "generate", suite, "--seeds", "0", "--out", tmp_path / "out")
    assert f"{suite}: entry low: camera.height" in line


@pytest.mark.slow
def test_a_disk_that_cannot_be_written(made, tmp_path, capsys):
    """Every command that writes names the place."""
    data = str(made / "data" / "flockscope-demo" / "scene-s40000")
    with small_disk(tmp_path / "disk", "ro") as root:
        out = str(root / "out")
        for line in (
            ["generate", str(made / "scene.toml"), "--seeds", "0", "--out", out],
            ["track", "blob", data, "--out", out],
            ["view", data, "--out", f"{out}/page.html"],
            ["sheet", data, "--out", f"{out}/sheet.png"],
            ["overlay", data, "--out", f"{out}/film.mp4"],
            ["export", "coco", data, "--out", f"{out}/coco.json"],
            ["export", "webdataset", data, "--out", out],
            ["scenarios", str(made / "scene.toml"), "--out", f"{out}/plan.svg"],
            ["demo", "--quick", "--out", out],
        ):
            output = refused_as_json(capsys, *line)
            assert "Read-only" in output, output
            assert str(root) in output, output


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
    sequence = mot_folder(tmp_path / "seq", ROWS)
    line = ["track", "blob", str(sequence), "--detections", "truth", "--fps", "5", "--out", str(tmp_path / "t")]
    assert run(line) == 0
    assert "--fps 5" in refused_as_json(capsys, "score", sequence, tmp_path / "t")
    assert run(["score", str(sequence), str(tmp_path / "t"), "--fps", "5"]) == 0
