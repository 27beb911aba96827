"""What `score`, `view`, `overlay` and `validate` make of folders of runs that are not what they seem."""

from __future__ import annotations

import json
import os
import re
import shutil
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from sim.store.atomic import lock_folder
from sim.store.seal import read_run
from sim.store.validate import validate
from sim.types import Sequence
from tests.processes import FAKE
from tests.recordings import mot_folder
from tests.refusals import answer, refused
from tests.short_scene import SCENE, write_short_scene
from tracking.app.cli import run
from tracking.app.sequence_workers import OpenedAs, over_sequences
from tracking.recordings.source import open_source
from tracking.running.run import track

ROWS = "".join(f"{k},1,{10 + k},10,20,40,1,1,1\n{k},2,{40 - k},12,20,40,1,1,1\n" for k in range(1, 9))


def generate(scene: Path, out: Path) -> list[str]:
    """The command that makes two seeds of the scene, with small pictures."""
    small = ["--streams", "left", "--set", "camera.image=[128,96]"]
    return ["generate", str(scene), "--seeds", "40000:40002", *small, "--out", str(out)]


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Two seeds of a scene, with the tracks of both trackers."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "scene.toml").write_text(SCENE)
    assert run(generate(folder / "scene.toml", folder / "data")) == 0
    for tracker in ("blob", "group-pda"):
        options = ["--detections", "file", "--out", str(folder / tracker)]
        assert run(["track", tracker, str(folder / "data"), *options]) == 0
    return folder


@pytest.fixture
def tracks(made: Path, tmp_path: Path) -> Path:
    """A copy of blob's tracks, to be spoilt."""
    return Path(shutil.copytree(made / "blob", tmp_path / "tracks"))


def readers(data: Path, tracks: Path, out: Path) -> list[list[object]]:
    """Every command that reads tracks."""
    return [
        ["score", data, tracks],
        ["score", data, tracks, f"{tracks}/."],
        ["view", data, tracks, "--video", "none", "--out", out / "pages"],
        ["overlay", data, tracks, "--out", out / "films"],
    ]


@pytest.mark.parametrize("name", ["groups.parquet", "tracks.mot.txt"])
def test_a_deleted_file_is_no_answer_without_it(made, tracks, tmp_path, capsys, name):
    (tracks / "scene-s40001" / name).unlink()
    for line in readers(made / "data", tracks, tmp_path / "out"):
        assert re.search(f"{name}: got missing; .*; track again", refused(capsys, *line))
    assert not (tmp_path / "out").exists()


CONFIGS = [(["--set", "gate=0.8"], "'gate': 0."), (["--grouping", "{folder}/rule.toml"], "'near': 0.7")]


@pytest.mark.parametrize(("option", "words"), CONFIGS)
def test_two_configs_in_one_folder(made, tracks, tmp_path, capsys, option, words):
    (tmp_path / "rule.toml").write_text("[params]\nnear = 0.7\n")
    (one,) = (p for p in (made / "data").rglob("*s40001") if p.is_dir())
    options = [word.format(folder=tmp_path) for word in option]
    line = [str(one), "--detections", "file", "--out", str(tracks / "scene-s40001")]
    assert "scene-s40001: got a run of blob; expected none" in refused(capsys, "track", "relational", *line)
    assert run(["track", "blob", *line, *options]) == 0
    text = refused(capsys, "score", made / "data", tracks)
    assert words in text
    assert "one folder per run" in text


def test_another_sequence_of_that_name(made, tracks, tmp_path, capsys):
    """The same seed of the same scene with other settings."""
    assert run([*generate(made / "scene.toml", tmp_path / "other"), "--set", "crowd.free_speed=1.0"]) == 0
    for line in readers(tmp_path / "other", tracks, tmp_path / "out"):
        assert re.search("tracks of another scene-s40000; .*; track again", refused(capsys, *line))


@pytest.mark.parametrize("name", ["tracks.parquet", "tracks.txt"])
def test_a_file_of_a_run_is_of_its_sequence(made, capsys, name):
    """A text alone matches whatever sequence is given, but these files stand for the run."""
    first, second = sorted(p for p in (made / "data").rglob("scene-s*") if p.is_dir())
    path = made / "blob" / first.name / name
    assert answer(capsys, "score", first, path)["sequences"][0]["given"] == "file"
    assert "tracks of another scene-s40001" in refused(capsys, "score", second, path)


def test_python_stores_what_was_tracked(tmp_path, capsys):
    """The same run.json as the command's, so that tracks of another recording are refused."""
    walk = mot_folder(tmp_path / "walk", ROWS)
    (sequence,) = open_source(walk, fps=5.0)
    made = track("blob", sequence, detections="truth")
    made.write(tmp_path / "t", sequence)
    assert run(["track", "blob", str(walk), "--detections", "truth", "--fps", "5", "--out", str(tmp_path / "u")]) == 0
    by_python, by_command = (read_run(tmp_path / name) for name in "tu")
    assert by_python["truth_hash"] == by_command["truth_hash"] is not None
    assert by_python.keys() == by_command.keys()
    assert "truth_hash" not in made.info, "labels are not read while tracking"
    (walk / "gt" / "gt.txt").write_text(ROWS.replace("12,", "13,"))
    assert "tracks of another walk" in refused(capsys, "score", walk, tmp_path / "t", "--fps", "5")


def test_what_was_tracked_before_anybody_labelled_it(tmp_path):
    """Tracks of a recording without labels are scored with labels of that name."""
    rows = "".join(f"{k},-1,{10 + k},10,20,40,1\n" for k in range(1, 9))
    walk = mot_folder(tmp_path / "walk", det=rows)
    line = ["track", "blob", str(walk), "--fps", "5", "--px-per-m", "24", "--out", str(tmp_path / "t")]
    assert run(line) == 0
    assert json.loads((tmp_path / "t" / "run.json").read_text())["truth_hash"] is None
    mot_folder(walk, ROWS)
    assert run(["score", str(walk), str(tmp_path / "t"), "--fps", "5"]) == 0


def test_validate_says_whether_a_run_is_whole(tracks, capsys):
    assert answer(capsys, "validate", tracks) == {"status": "ok", "problems": [], "content_hash": None}
    assert run(["validate", str(tracks / "scene-s40000")]) == 0
    assert capsys.readouterr().out.endswith("scene-s40000: no problems\n")
    path = tracks / "scene-s40000" / "tracks.parquet"
    path.write_bytes(path.read_bytes()[:-3])
    (tracks / "scene-s40001" / "run.json").unlink()
    assert run(["validate", str(tracks)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 2
    assert f"{path}: got truncated" in lines[0]
    assert "scene-s40001: got tracks without run.json" in lines[1]


def test_one_run_at_a_time_writes_to_a_folder(made, tmp_path, capsys):
    """The second command fails at once; a writer in Python fails, too, and inside the command it does not."""
    (source,) = (made / "data").rglob("*-s40000")
    with lock_folder(tmp_path / "out"):
        line = ["track", "blob", str(source), "--detections", "file", "--out", str(tmp_path / "out")]
        with ThreadPoolExecutor(1) as other:
            assert other.submit(run, line).result() == 2
        assert "another run that writes here" in capsys.readouterr().err
        (sequence,) = open_source(source)
        tracked = track("blob", sequence, detections="file")
        with ThreadPoolExecutor(1) as other, pytest.raises(InputError, match="another run that writes here"):
            other.submit(tracked.write, tmp_path / "out", sequence).result()
        tracked.write(tmp_path / "out", sequence)
    assert validate(tmp_path / "out") == []
    assert run(line) == 0


@pytest.mark.parametrize("below", ["", "tracks"])
def test_tracks_are_not_written_into_a_stored_sequence(made, tmp_path, capsys, below):
    data = Path(shutil.copytree(made / "data", tmp_path / "data"))
    (folder,) = data.rglob("*-s40000")
    before = sorted(data.rglob("*"))
    for line in (["track", "blob", folder], ["export", "csv", folder], ["group", made / "blob"]):
        assert "inside the stored sequence" in refused(capsys, *line, "--out", folder / below)
        assert "got a generated dataset" in refused(capsys, *line, "--out", folder.parents[below == ""])
    assert "a folder of tracks or" in refused(capsys, "export", "coco", data, "--out", folder / "manifest.json")
    assert "a folder of tracks;" in refused(capsys, *generate(made / "scene.toml", made / "blob"))
    assert sorted(data.rglob("*")) == before


@pytest.fixture(scope="module")
def data(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("workers")
    write_short_scene(folder, "0:4")
    return folder / "data"


def named(sequence: Sequence, job: str) -> str:
    warnings.warn(f"{sequence.name} warns", stacklevel=2)
    if job == "fail":
        raise InputError(got=sequence.name, expected="a", remedy="b")
    if job == "die":
        os._exit(3)
    return f"{job} on {sequence.name}"


def outcome(data: Path, jobs: list[str], workers: int) -> tuple[list[str], list[str], str]:
    """Results, warnings and error."""
    source, found, error = OpenedAs(data), list[str](), ""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            for one in over_sequences("test", named, source.open(), jobs, source, workers):
                found.append(one)
        except (InputError, WorkError) as failure:
            error = failure.line()
    return found, [str(w.message) for w in caught], error


def test_two_workers_are_one(data: Path) -> None:
    alone, both = (outcome(data, ["a", "b", "fail", "d"], n) for n in (1, 2))
    assert alone == both
    assert alone[0][:2] == ["a on scene-s00000", "b on scene-s00001"]


@pytest.mark.slow
def test_a_sequence_that_kills_its_worker_is_named(data: Path) -> None:
    found, _, error = outcome(data, ["a", "die", "c", "d"], 2)
    assert found == ["a on scene-s00000"]
    assert error.startswith("scene-s00001: got an item that killed 3 workers")


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_the_files_of_track_are_the_same(data: Path, tmp_path: Path) -> None:
    for n in "12":
        assert run(["track", FAKE, str(data), "--workers", n, "--out", str(tmp_path / n)]) == 0
    files = [p.relative_to(tmp_path / "1") for p in sorted((tmp_path / "1").rglob("*")) if p.is_file()]
    assert len(files) > 4 * 4
    for file in files:
        if file.name != "run.json":  # it holds speeds
            assert (tmp_path / "1" / file).read_bytes() == (tmp_path / "2" / file).read_bytes(), file
