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

from tracking.app.cli import run

ROOT = Path(__file__).resolve().parents[3]
FAKE = f"{ROOT / 'tests' / 'fake_tracker.py'}:Nearest"
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


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> Path:
    """A scene, a dataset of it with two seeds, and the fake tracker's answers."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "scene.toml").write_text(SCENE)
    assert run(["generate", str(folder / "scene.toml"), "--seeds", "40000:40002", "--out", str(folder / "data")]) == 0
    assert run(["track", FAKE, str(folder / "data"), "--out", str(folder / "tracks")]) == 0
    return folder


@pytest.fixture
def place(made, tmp_path) -> Place:
    data = made / "data" / "flockscope-demo"
    return Place(made / "scene.toml", data, data / "scene-s40000", made / "tracks", tmp_path / "out")


GOOD = {
    "scenarios": "scenarios",
    "scenarios NAME": "scenarios {scene}",
    "scenarios --out": "scenarios {scene} --out {out}/plan.svg",
    "scenarios --schema": "scenarios --schema",
    "generate": "generate {scene} --seeds 5:7 --out {out}",
    "track": "track " + FAKE + " {data} --out {out}",
    "track blob": "track blob {one} --out {out}",
    "score": "score {data} {tracks}",
    "score one": "score {one} {tracks}/scene-s40000",
    "score text": "score {one} {tracks}/scene-s40000/tracks.mot.txt",
    "view": "view {one} {tracks}/scene-s40000 --out {out}/page.html",
    "view all": "view {data} {tracks} --out {out}",
    "view truth": "view {one} --out {out}/page.html",
    "sheet": "sheet {one} --out {out}/sheet.png",
    "validate": "validate {data}",
    "export coco": "export coco {data} --out {out}/coco.json",
    "demo": "demo --quick --out {out}",
}

BAD = {
    "scenarios": "scenarios no-such-scene",
    "generate": "generate {scene} --seeds 5:5 --out {out}",
    "track": "track " + FAKE + " {out}/nothing --out {out}/x",
    "score": "score {one} {out}/nothing",
    "view": "view {one} {out}/nothing --out {out}/page.html",
    "sheet": "sheet {out}/nothing --out {out}/sheet.png",
    "validate": "validate {out}/nothing",
    "export coco": "export coco {out}/nothing --out {out}/coco.json",
    "demo": "demo --quick --out {scene}/x",
}

WRITING = ("scenarios --out", "generate", "track", "track blob", "view", "view all", "sheet", "export coco", "demo")
INNER = {
    "scenarios": "scenarios.document.names",
    "scenarios NAME": "scenarios.draw.text",
    "score": "tracking.app.score_command.score_run",
    "validate": "sim.io.validate._sequence",
}
"""A function inside each command that writes nothing, to be interrupted there."""


def words(line: str, place: Place) -> list[str]:
    return [word.format(**place.__dict__) for word in line.split()]


def said(capsys, code: int, as_json: bool) -> dict[str, object]:
    """What a command printed: exactly one object, or lines of which an error is one."""
    printed = capsys.readouterr()
    if not as_json:
        if code:
            assert sum(line.startswith(("error: ", "interrupted: ")) for line in printed.err.splitlines()) == 1
            assert "Traceback" not in printed.err
        return {}
    answer = json.loads(printed.out)
    assert answer["status"] == {0: "ok", 1: "failed", 2: "refused", 130: "interrupted"}[code]
    assert ("error" in answer) == (code != 0)
    if code:
        assert set(answer["error"]) == {"file", "place", "got", "expected", "remedy"}
        assert "\n" not in "".join(answer["error"].values())
    return answer


def files(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize("line", GOOD.values(), ids=GOOD)
def test_good(line, as_json, place, capsys):
    assert run(words(line, place) + ["--json"] * as_json) == 0
    said(capsys, 0, as_json)
    if "{out}" in line:
        assert files(place.out)
        assert not list(place.out.rglob(".partial-*"))


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize("line", BAD.values(), ids=BAD)
def test_bad(line, as_json, place, capsys):
    assert run(words(line, place) + ["--json"] * as_json) == 2
    said(capsys, 2, as_json)
    assert not place.out.exists()


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize("name", INNER)
def test_interrupted_while_reading(name, as_json, place, capsys, monkeypatch):
    monkeypatch.setattr(INNER[name], _raise(KeyboardInterrupt()))
    assert run(words(GOOD[name], place) + ["--json"] * as_json) == 130
    said(capsys, 130, as_json)


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize(
    ("error", "code"), [(KeyboardInterrupt(), 130), (OSError(errno.ENOSPC, "No space left on device"), 1)]
)
@pytest.mark.parametrize("name", WRITING)
def test_interrupted_and_full_disk_while_writing(name, error, code, as_json, place, capsys, monkeypatch):
    """Whatever of writing fails, nothing is seen of it afterwards."""
    for function in ("fsync", "replace", "rename"):
        monkeypatch.setattr(os, function, _raise(error))
    assert run(words(GOOD[name], place) + ["--json"] * as_json) == code
    monkeypatch.undo()
    said(capsys, code, as_json)
    assert not place.out.exists(), list(place.out.rglob("*"))


def _raise(error: BaseException):
    def function(*_: object, **__: object) -> None:
        raise error

    return function


def test_every_command_is_in_the_tables():
    import typer

    from tracking.app.cli import app

    group = typer.main.get_command(app)
    known = {" ".join([name, *sub]) for name, sub in _leaves(group)}
    assert known == {name for name in GOOD if name in known} == set(BAD)
    assert {name.split(" ")[0] for name in INNER} | {name.split(" --")[0] for name in WRITING} >= known - {"export"}


def _leaves(group):
    for name, command in group.commands.items():
        inner = getattr(command, "commands", {})
        yield from [(name, [sub]) for sub in inner] if inner else [(name, [])]


@pytest.mark.parametrize("as_json", [False, True], ids=["text", "json"])
@pytest.mark.parametrize(
    ("line", "got"),
    [
        ("trak", "no such command 'trak'"),
        ("track blob", "missing argument 'SOURCE'"),
        ("track blob x", "missing option '--out'"),
        ("track blob x --out y --colour red", "no such option: --colour"),
        ("track blob x --out y --seed one", "invalid value for '--seed'"),
        ("track blob x --out y --detections magic", "magic"),
        ("generate merge --seeds 0:2 --out y --workers 0", "invalid value for '--workers'"),
        ("scenarios --out x.svg", "--out with nothing to explain"),
        ("export coc", "no such command 'coc'"),
    ],
)
def test_usage(line, got, as_json, capsys):
    assert run(line.split() + ["--json"] * as_json) == 2
    printed = capsys.readouterr()
    text = json.loads(printed.out)["error"]["got"] if as_json else printed.err
    assert got in text
    assert len(printed.err.splitlines()) == (0 if as_json else 1)


def test_a_family_of_commands_alone_is_refused(capsys):
    assert run(["export"]) == 2
    assert "missing command" in capsys.readouterr().err


def test_without_arguments_it_explains_itself(capsys):
    assert run([]) == 0
    assert "generate" in capsys.readouterr().out


def test_a_bug_is_one_line_and_shown_whole_when_asked_for(place, capsys, monkeypatch):
    monkeypatch.setattr("sim.io.export.coco", _raise(KeyError("lost")))
    line = words(GOOD["export coco"], place)
    assert run(line) == 1
    printed = capsys.readouterr().err
    assert "KeyError: 'lost'" in printed
    assert "FLOCKSCOPE_DEBUG=1" in printed
    monkeypatch.setenv("FLOCKSCOPE_DEBUG", "1")
    with pytest.raises(KeyError):
        run(line)


@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c_in_a_real_process(place, workers):
    """SIGINT in the middle of `generate`: 130, one object, and whatever is there is whole."""
    line = [sys.executable, "-m", "tracking.app.cli", *words("generate {scene} --seeds 0:400 --out {out}", place)]
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


def test_a_full_disk_of_its_own(place, tmp_path):
    """A file system of 200 kB: exit code 1, one line, and every sequence there is whole."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", disk], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("no right to mount a small disk")
    try:
        assert run(words(f"generate {{scene}} --seeds 0:10 --out {disk}/out", place)) == 1
        assert not list(disk.rglob(".partial-*"))
        sequences = list(disk.glob("out/flockscope-train/*"))
        assert len(sequences) < 10
        assert all(run(["validate", str(p)]) == 0 for p in sequences)
    finally:
        subprocess.run(["umount", disk], check=True)


def test_a_dataset_altered_is_told_by_every_reader(place, tmp_path, capsys):
    data = tmp_path / "data"
    shutil.copytree(place.data.parent, data)
    victim = data / "flockscope-demo" / "scene-s40001" / "gt" / "truth.parquet"
    whole = victim.read_bytes()
    lines = ["track blob {data} --out {out}", "score {data} {tracks}", "sheet {data} --out {out}", "validate {data}"]
    for content in (whole[: len(whole) // 2], whole[:-1] + b"x", None):
        victim.write_bytes(content) if content is not None else victim.unlink()
        for line in lines:
            words_ = [word.format(data=data, tracks=place.tracks, out=place.out) for word in line.split()]
            assert run(words_) == (1 if line.startswith("validate") else 2), line
            printed = capsys.readouterr()
            assert str(victim) in printed.err + printed.out
            assert not place.out.exists()
