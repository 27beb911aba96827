"""Every command: done, refused, interrupted, out of room; as text and as --json; and nothing half-written."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from scenarios.errors import WorkError
from tests.commands import commands
from tests.processes import FAKE, ROOT, TOY
from tests.refusals import refused
from tracking.app.cli import run

OURS = tuple(str(ROOT / name) + os.sep for name in ("scenarios", "sim", "tracking"))
TUNE = f"tune {TOY} --suite {{scene}} --check none --validation 10000 --test 20000 --out {{out}}/toy.toml"
SCENE = """
schema = 1
about = "three people, nothing happens"
duration = 4.0
warmup = 1.0
camera = { fps = 5 }
group = [
  { id = "a", size = 2, start = [4, 4], goal = [12, 4] },
  { id = "b", size = 1, start = [12, 7], goal = [4, 7] },
]
"""


@dataclass(frozen=True)
class Place:
    """Where a command finds its input, made once, and where it may write."""

    scene: Path
    data: Path
    one: Path
    tracks: Path
    out: Path
    seen: Path


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> Path:
    """A scene, a dataset of it with two seeds, the fake tracker's answers, and one sequence with small stereo pairs."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "scene.toml").write_text(SCENE)
    line = ["generate", str(folder / "scene.toml"), "--out"]
    assert run([*line, str(folder / "data"), "--seeds", "40000:40002", "--streams", "none"]) == 0
    pair = ["--streams", "left,right,disparity,ids", "--set", "camera.baseline=0.2"]
    assert run([*line, str(folder / "seen"), "--seeds", "40000", "--set", "camera.image=[128,96]", *pair]) == 0
    for name, out in (("data", "tracks"), ("seen/flockscope-demo/scene-s40000", "tracks-seen")):
        assert run(["track", FAKE, str(folder / name), "--out", str(folder / out)]) == 0
    rows = [{"name": f"s{k}", "objective": k / 8} for k in range(6)]
    points = "5,90,-2.79,3.88 120,92,2.59,3.76 64,40,0,10.51 20,30,-5.83,14.22 110,32,5.75,13.31"
    (folder / "scene.toml.csv").write_text(points.replace(" ", "\n"))
    (folder / "scores.json").write_text(json.dumps({"sequences": rows}))
    return folder


@pytest.fixture(autouse=True)
def _ctrl_c():
    """Ctrl-C works here and in children, also where the tests themselves run in the background, without it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture(autouse=True)
def _small_pictures(monkeypatch):
    """The demo's one drawn scene is quickly tracked."""
    monkeypatch.setattr("tracking.app.commands.demo.QUICK_PIXEL_SETTINGS", ("camera.fps=5", "camera.image=[160,120]"))


@pytest.fixture
def place(made, tmp_path) -> Place:
    data = made / "data" / "flockscope-demo"
    seen = made / "seen" / "flockscope-demo" / "scene-s40000"
    return Place(made / "scene.toml", data, data / "scene-s40000", made / "tracks", tmp_path / "out", seen)


# every command: what works, and the same with something wrong.
COMMANDS = {
    "scenarios": ("scenarios", "scenarios --out {out}/plan.svg"),
    "scenarios NAME": ("scenarios {scene}", "scenarios no-such-scene"),
    "scenarios --out": ("scenarios {scene} --out {out}/plan.svg", "scenarios {scene} --set a=1 --out {out}/plan.svg"),
    "generate": ("generate {scene} --seeds 5:7 --streams none --out {out}", "generate {scene} --seeds 5:5 --out {out}"),
    "generate pictures": (
        "generate {scene} --seeds 5 --set camera.image=[128,96] --out {out}",
        "generate {scene} --seeds 5 --streams left,centre --out {out}",
    ),
    "replay": ("replay {one} --set camera.image=[128,96] --out {out}", "replay {out}/nothing --out {out}/x"),
    "fit sensor": ("fit sensor {data} --out {out}/mine.toml", "fit sensor {out}/nothing --out {out}/mine.toml"),
    "fit scene": ("fit scene {one} --out {out}/like.toml", "fit scene {data} --out {out}/like.toml"),
    "fit grouping": (
        "fit grouping side-by-side --seeds 0 --out {out}/mine.toml",
        "fit grouping no-such-scene --out {out}/mine.toml",
    ),
    "fit relational": (
        "fit relational cross --seeds 30000 --out {out}/mine.toml",
        "fit relational no-such-scene --out {out}/mine.toml",
    ),
    "fit joint": (
        "fit joint party --seeds 30000 --out {out}/mine.toml", "fit joint no-such-scene --out {out}/mine.toml",
    ),
    "track": ("track " + FAKE + " {data} --out {out}", "track " + FAKE + " {out}/nothing --out {out}/x"),
    "track blob": ("track blob {one} --out {out}", "track blobb {one} --out {out}"),
    "group": ("group {data} --out {out}", "group {out}/nothing --out {out}/x"),
    "calibrate": (
        "calibrate {seen} --points {scene}.csv --out {out}/camera.json", "calibrate {seen} --out {out}/camera.json",
    ),
    "score": ("score {data} {tracks}", "score {data} {out}/nothing"),
    "errors": ("errors {data} {tracks}", "errors {data} {out}/nothing"),
    "stress": (
        "stress " + FAKE + " --vary detection --suite {scene} --seeds 0:2 --start 2 --by HOTA --out {out}",
        "stress " + FAKE + " --vary nothing --suite {scene} --out {out}/x",
    ),
    "minimize": (
        "minimize {scene} --tracker " + FAKE + " --while HOTA<1 --confirm 1 --episodes 6 --out {out}/small.toml",
        "minimize {scene} --tracker " + FAKE + " --while HOTTA<0.7 --out {out}/small.toml",
    ),
    "compare": (
        "compare {tracks}/../scores.json {tracks}/../scores.json", "compare {tracks}/../scores.json {out}/nothing.json",
    ),
    "view": (
        "view {one} {tracks}/scene-s40000 --out {out}/page.html", "view {one} {out}/nothing --out {out}/page.html",
    ),
    "view all": ("view {data} {tracks} --out {out}", "view {data} {tracks} --out {out}/page.html"),
    "view report": (
        "view {data} {tracks} " + FAKE + " --out {out}", "view {data} {tracks} " + FAKE + " --out {out}/page.html",
    ),
    "view pictures": (
        "view {seen} --video beside --out {out}/page.html", "view {seen} --video outside --out {out}/page.html",
    ),
    "overlay": (
        "overlay {seen} {tracks}-seen --out {out}/film.mp4",
        "overlay {one} {tracks}/scene-s40000 --out {out}/film.mp4",
    ),
    "sheet": ("sheet {one} --out {out}/sheet.png", "sheet {out}/nothing --out {out}/sheet.png"),
    "tune": (TUNE + " --trials 2 --seeds 0", TUNE + " --trials 2 --seeds 0:20000"),
    "tune --like": (
        TUNE.replace("--suite {scene}", "--like {one}") + " --trials 1 --seeds 0",
        TUNE.replace("--suite {scene}", "") + " --trials 1 --seeds 0",
    ),
    "validate": ("validate {data}", "validate {out}/nothing"),
    "export csv": ("export csv {data} --out {out}", "export csv {out}/nothing --out {out}/x"),
    "export parquet": ("export parquet {tracks}/scene-s40000 --out {out}", "export parquet {scene} --out {out}"),
    "export trajnet": ("export trajnet {data} --out {out}", "export trajnet {out}/nothing --out {out}/x"),
    "export pedpy": ("export pedpy {tracks}/scene-s40000 --out {out}", "export pedpy {scene} --out {out}"),
    "export coco": ("export coco {data} --out {out}/coco.json", "export coco {out}/nothing --out {out}/coco.json"),
    "export yolo": ("export yolo {seen} --out {out}", "export yolo {one} --out {out}"),
    "export mots": ("export mots {seen} --out {out}", "export mots {seen} --out {seen}"),
    "export kitti": ("export kitti {seen} --out {out}", "export kitti {one} --out {out}"),
    "export webdataset frames": (
        "export webdataset {seen} --sample frame --out {out}", "export webdataset {one} --sample frame --out {out}",
    ),
    "export webdataset": (
        "export webdataset {data} --out {out}", "export webdataset {data} --out {out} --shard-size 0",
    ),
    "demo": ("demo --quick --out {out}", "demo --quick --out {scene}/x"),
}  # fmt: skip
WRITING = [name for name, (good, _) in COMMANDS.items() if "--out {out}" in good]


def words(line: str, place: Place) -> list[str]:
    return [word.format(**place.__dict__) for word in line.split()]


def check_output(capsys, code: int, as_json: bool) -> None:
    """What a command printed: exactly one object on stdout, or an error as exactly one line on stderr."""
    printed = capsys.readouterr()
    shown = printed.err.splitlines()
    if not as_json:
        assert bool(printed.out) == (code == 0)
        assert len(shown) == (code != 0), shown
        assert all(line.startswith("interrupted: " if code == 130 else "error: ") for line in shown)
        return
    answer = json.loads(printed.out)
    assert not shown
    assert answer["status"] == {0: "ok", 1: "failed", 2: "refused", 130: "interrupted"}[code]
    assert ("error" in answer) == (code != 0)
    if code:
        assert set(answer["error"]) == {"file", "place", "got", "expected", "remedy"}
        assert "\n" not in "".join(answer["error"].values())


class Calls:
    """Counts calls of our own functions; at the call numbered `stop` Ctrl-C is pressed."""

    def __init__(self, stop: int = -1) -> None:
        self.count, self.stop = 0, stop

    def __enter__(self):
        sys.setprofile(self._seen)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    def _seen(self, frame, event: str, _: object) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(OURS):
            self.count += 1
            # pydantic swallows what is raised while it asks which kind of value it writes (scenarios/schema)
            if self.stop > 0 and self.count >= self.stop and "/schema/" not in frame.f_code.co_filename:
                sys.setprofile(None)
                signal.raise_signal(signal.SIGINT)


LENGTHS: dict[str, int] = {}


def length(name: str, place: Place) -> int:
    """Calls that a command makes from start to end, once all is loaded."""
    if name not in LENGTHS:
        for k in range(2):
            line = words(COMMANDS[name][0].replace("{out}", "{out}" + f"-{k}"), place)
            with Calls() as calls:
                assert run(line) == 0
        LENGTHS[name] = calls.count
    return LENGTHS[name]


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize("state", ["good", "bad"])
@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow] * (n == "demo")) for n in COMMANDS])
def test_command(name, state, as_json, place, capsys):
    """Codes 0 and 2; one line or one object; nothing is written by a command that is refused."""
    code = run(words(COMMANDS[name][state == "bad"], place) + ["--json"] * as_json)
    assert code == {"good": 0, "bad": 2}[state]
    check_output(capsys, code, as_json)
    assert not list(place.out.parent.rglob(".partial-*"))
    if state == "bad":
        assert not place.out.exists()
    elif name in WRITING:
        assert any(path.is_file() for path in place.out.rglob("*"))


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in WRITING if name != "demo"])
def test_ctrl_c_at_many_moments(name, place, capsys):
    """130 or done, and never anything half-written, from the third call of ours on.

    The first two are run and run_command.
    """
    end, line = length(name, place), words(COMMANDS[name][0], place)
    for stop in {3, *range(5, end, max(end // 6, 1)), end - 8, end - 5, end - 2}:
        with Calls(stop):
            assert run(line) in (0, 130)
        assert not list(place.out.parent.rglob(".partial-*")), stop
        assert not place.out.exists() or run(line) == 0
        shutil.rmtree(place.out, ignore_errors=True)


@pytest.mark.slow
@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (OSError(errno.ENOSPC, "No space left on device"), 1)]
)
@pytest.mark.parametrize("name", WRITING)
def test_interrupted_and_full_disk_while_writing(name, error, code, as_json, place, capsys, monkeypatch):
    """Whatever of writing fails, nothing is seen of it afterwards."""
    for function in ("replace", "rename"):
        monkeypatch.setattr(os, function, _raise(error))
    assert run(words(COMMANDS[name][0], place) + ["--json"] * as_json) == code
    monkeypatch.undo()
    check_output(capsys, code, as_json)
    left = {"tune": ["toy.journal", "toy.journal.lock"], "stress": ["episodes.jsonl"]}.get(name, [])
    assert sorted(p.name for p in place.out.rglob("*")) == left


def _raise(error: BaseException):
    def function(*_: object, **__: object) -> None:
        raise error

    return function


def test_every_command_is_in_the_tables():
    assert {" ".join(words) for words in commands()} <= set(COMMANDS)


USAGE = [
    ("trak", "no such command 'trak'"), ("track blob", "missing argument 'SOURCE'"),
    ("track blob x", "missing option '--out'"), ("track blob x --out y --colour red", "no such option: --colour"),
    ("track blob x --out y --seed one", "invalid value for '--seed'"),
    ("track blob x --out y --detections magic", "magic"),
    ("generate merge --seeds 0:2 --out y --workers 0", "invalid value for '--workers'"),
    ("scenarios --out x.svg", "--out without a scenario to explain"), ("export coc", "no such command 'coc'"),
]  # fmt: skip


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize(("line", "got"), USAGE)
def test_usage(line, got, as_json, capsys):
    assert run(line.split() + ["--json"] * as_json) == 2
    printed = capsys.readouterr()
    text = json.loads(printed.out)["error"]["got"] if as_json else printed.err
    assert got in text
    assert len(printed.err.splitlines()) == (0 if as_json else 1)


@pytest.mark.parametrize("line", ["--help", "-h", "--version", "track --help", "export --help", "export coco -h"])
@pytest.mark.parametrize("first", [False, True])
def test_help_and_version_are_text(line, first, capsys):
    assert run(line.split()) == 0
    text = capsys.readouterr().out
    assert run(["--json", *line.split()] if first else [*line.split(), "--json"]) == 0
    assert capsys.readouterr() == (text, "")


def test_what_a_tracker_prints_is_not_in_the_object(place, tmp_path, capsys):
    loud = tmp_path / "loud.py"
    loud.write_text(Path(FAKE.rpartition(":")[0]).read_text() + "\nprint('hello')\n")
    assert run(["track", f"{loud}:Nearest", str(place.one), "--out", str(place.out), "--json"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["status"] == "ok"
    assert set(printed.err.splitlines()) == {"hello"}


@pytest.mark.parametrize("folder", ["{scene}/x", "/proc"])
@pytest.mark.parametrize("line", ["view {one} --out %s/page.html", "sheet {one} --out %s/sheet.png"])
def test_an_unwritable_out_is_named_as_given(place, line, folder, capsys):
    line %= folder
    shown = refused(capsys, *words(line, place))
    assert shown.startswith(f"error: {words(line, place)[-1]}: ")
    assert ".partial" not in shown


def test_without_arguments_it_explains_itself(capsys):
    assert run([]) == 0
    assert "generate" in capsys.readouterr().out
    assert run(["export"]) == 2
    assert "missing command" in capsys.readouterr().err


def test_ctrl_c_that_became_another_error(place, capsys, monkeypatch):
    """As libraries make of one that ends their import."""

    def load(*_: object, **__: object) -> None:
        try:
            raise KeyboardInterrupt
        except KeyboardInterrupt:
            raise ImportError("a library failed to import")  # noqa: B904

    monkeypatch.setattr("tracking.export.coco.coco", load)
    assert run(words(COMMANDS["export coco"][0], place)) == 130
    check_output(capsys, 130, as_json=False)


def test_a_bug_is_one_line_and_shown_whole_when_asked_for(place, capsys, monkeypatch):
    monkeypatch.setattr("tracking.export.coco.coco", _raise(KeyError("lost")))
    line = words(COMMANDS["export coco"][0], place)
    assert run(line) == 1
    printed = capsys.readouterr().err
    assert "KeyError: 'lost'" in printed
    assert "FLOCKSCOPE_DEBUG=1" in printed
    monkeypatch.setenv("FLOCKSCOPE_DEBUG", "1")
    with pytest.raises(WorkError) as caught:
        run(line)
    assert isinstance(caught.value.__cause__, KeyError)


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_in_a_real_process(place, workers):
    """SIGINT in the middle of `generate`: 130, one object, and whatever is there is whole."""
    what = "generate {scene} --seeds 0:400 --streams none --out {out}"
    line = [sys.executable, "-m", "tracking.app.cli", *words(what, place)]
    line += ["--workers", str(workers), "--json"]
    process = subprocess.Popen(
        line, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True
    )
    end = time.monotonic() + 60
    first = "flockscope-train/scene-*/manifest.json"
    while process.poll() is None and not list(place.out.glob(first)) and time.monotonic() < end:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    out, _ = process.communicate(timeout=60)
    assert process.returncode == 130
    assert json.loads(out)["status"] == "interrupted"
    assert not list(place.out.rglob(".partial-*"))
    sequences = [p for p in (place.out / "flockscope-train").iterdir() if p.is_dir()]
    assert 0 < len(sequences) < 400
    assert all(run(["validate", str(p)]) == 0 for p in sequences)
