"""What `score`, `view`, `overlay` and `validate` make of folders of runs that are not what they seem."""

from __future__ import annotations

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from scenarios.errors import InputError
from sim import hashing
from sim.io.files.atomic import lock_folder
from sim.io.source import open_source
from sim.io.store.seal import read_run
from sim.io.store.validate import validate
from tests.refusals import refused
from tests.sealing import seal_again
from tracking.app.cli import run
from tracking.running.run import track

SCENE = """
schema = 1
duration = 4.0
warmup = 1.0
camera = { fps = 5, image = [128, 96] }
group = [
  { id = "a", size = 2, start = [4, 4], goal = [12, 4] },
  { id = "b", size = 1, start = [12, 7], goal = [4, 7] },
]
"""
ROWS = "".join(f"{k},1,{10 + k},10,20,40,1,1,1\n{k},2,{40 - k},12,20,40,1,1,1\n" for k in range(1, 9))


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """Two seeds of a scene, with the tracks of both trackers."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "scene.toml").write_text(SCENE)
    line = ["generate", str(folder / "scene.toml"), "--seeds", "40000:40002", "--streams", "left", "--out"]
    assert run([*line, str(folder / "data")]) == 0
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


@pytest.mark.parametrize("name", ["groups.parquet", "events.json", "tracks.mot.txt"])
def test_a_deleted_file_is_no_answer_without_it(made, tracks, tmp_path, capsys, name):
    (tracks / "scene-s40001" / name).unlink()
    for line in readers(made / "data", tracks, tmp_path / "out"):
        text = refused(capsys, *line)
        assert f"{name}: got missing" in text
        assert "track again" in text
    assert not (tmp_path / "out").exists()


def test_an_unfinished_run(made, tracks, tmp_path, capsys):
    (tracks / "scene-s40001" / "run.json").unlink()
    for line in readers(made / "data", tracks, tmp_path / "out"):
        assert "incomplete: track again" in refused(capsys, *line)
    (one,) = (p for p in (made / "data").rglob("*s40001") if p.is_dir())
    alone = (tracks / "scene-s40001").rename(tmp_path / "alone")
    assert "incomplete: track again" in refused(capsys, "score", one, alone)


def test_two_trackers_in_one_folder(made, tracks, tmp_path, capsys):
    shutil.rmtree(tracks / "scene-s40001")
    shutil.copytree(made / "group-pda" / "scene-s40001", tracks / "scene-s40001")
    for line in readers(made / "data", tracks, tmp_path / "out"):
        text = refused(capsys, *line)
        assert "blob in scene-s40000, group-pda in scene-s40001" in text
        assert "one folder per run" in text
    (one,) = (p for p in (made / "data").rglob("*s40001") if p.is_dir())
    assert run(["score", str(one), str(tracks)]) == 0


@pytest.mark.parametrize(
    ("option", "words"),
    [
        (["--set", "orphan_gate=0.8"], "blob (orphan_gate = "),
        (["--grouping", "{folder}/rule.toml"], "blob (near = 0.7"),
    ],
)
def test_two_configs_in_one_folder(made, tracks, tmp_path, capsys, option, words):
    (tmp_path / "rule.toml").write_text("[params]\nnear = 0.7\n")
    (one,) = (p for p in (made / "data").rglob("*s40001") if p.is_dir())
    options = [word.format(folder=tmp_path) for word in option]
    line = ["track", "blob", str(one), "--detections", "file", *options, "--out", str(tracks / "scene-s40001")]
    assert run(line) == 0
    text = refused(capsys, "score", made / "data", tracks)
    assert words in text
    assert "one folder per run" in text


def test_another_sequence_of_that_name(made, tracks, tmp_path, capsys):
    """The same seed of the same scene with other settings."""
    line = ["generate", str(made / "scene.toml"), "--seeds", "40000:40002", "--streams", "left", "--out"]
    assert run([*line, str(tmp_path / "other"), "--set", "crowd.free_speed=1.0"]) == 0
    for line in readers(tmp_path / "other", tracks, tmp_path / "out"):
        text = refused(capsys, *line)
        assert "tracks of another scene-s40000" in text
        assert "track again" in text


@pytest.mark.parametrize("name", ["tracks.parquet", "tracks.txt"])
def test_a_file_of_a_run_is_of_its_sequence(made, capsys, name):
    """A text alone matches whatever sequence is given, but these files stand for the run."""
    first, second = sorted(p for p in (made / "data").rglob("scene-s*") if p.is_dir())
    path = made / "blob" / first.name / name
    assert run(["score", str(first), str(path)]) == 0
    assert "detections file" in capsys.readouterr().out
    assert "tracks of another scene-s40001" in refused(capsys, "score", second, path)


def recording(folder: Path, rows: str) -> Path:
    (folder / "gt").mkdir(parents=True)
    (folder / "gt" / "gt.txt").write_text(rows)
    return folder


def test_another_recording_of_that_name(tmp_path, capsys):
    one, two = (recording(tmp_path / k / "walk", rows) for k, rows in (("1", ROWS), ("2", ROWS.replace("12,", "13,"))))
    options = ["--detections", "truth", "--fps", "5", "--out"]
    assert run(["track", "blob", str(one), *options, str(tmp_path / "t")]) == 0
    assert run(["score", str(one), str(tmp_path / "t"), "--fps", "5"]) == 0
    assert run(["score", str(one), str(tmp_path / "t"), "--fps", "5", "--px-per-m", "30"]) == 0
    assert "tracks of another walk" in refused(capsys, "score", two, tmp_path / "t", "--fps", "5")


def test_python_stores_what_was_tracked(tmp_path, capsys):
    """The same run.json as the command's, so that tracks of another recording are refused."""
    walk = recording(tmp_path / "walk", ROWS)
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


def test_score_hashes_each_file_once(made, capsys, monkeypatch):
    hashed, file_hash = [], hashing.file_hash
    monkeypatch.setattr(hashing, "file_hash", lambda body: hashed.append(body) or file_hash(body))
    assert run(["score", str(made / "data"), str(made / "blob")]) == 0
    capsys.readouterr()
    bodies = [path.read_bytes() for path in (made / "blob").rglob("tracks*.*")]
    assert bodies
    assert [hashed.count(body) for body in bodies] == [1] * len(bodies)


def test_what_was_tracked_before_anybody_labelled_it(tmp_path):
    """Tracks of a recording without labels are scored with labels of that name."""
    walk = tmp_path / "walk"
    (walk / "det").mkdir(parents=True)
    (walk / "det" / "det.txt").write_text("".join(f"{k},-1,{10 + k},10,20,40,1\n" for k in range(1, 9)))
    line = ["track", "blob", str(walk), "--fps", "5", "--px-per-m", "24", "--out", str(tmp_path / "t")]
    assert run(line) == 0
    assert json.loads((tmp_path / "t" / "run.json").read_text())["truth_hash"] is None
    recording(walk, ROWS)
    assert run(["score", str(walk), str(tmp_path / "t"), "--fps", "5"]) == 0


def test_labels_that_cannot_be_read_stop_track_before_the_first_frame(tmp_path, capsys):
    walk = recording(tmp_path / "walk", ROWS + "3,1,x,10,20,40,1,1,1\n")
    (walk / "seqinfo.ini").write_text("[Sequence]\nseqLength=8\nframeRate=5\n")
    (walk / "det").mkdir()
    (walk / "det" / "det.txt").write_text("1,-1,10,10,20,40,1\n")
    text = refused(capsys, "track", "blob", walk, "--px-per-m", "24", "--out", tmp_path / "t")
    assert "gt.txt: line 17" in text
    assert not (tmp_path / "t").exists()


def test_a_text_of_others_is_what_it_was(made, tmp_path, capsys):
    """A folder of texts, one text, and a folder with a tracks.txt alone; none has a run.json."""
    texts = tmp_path / "texts"
    texts.mkdir()
    for folder in (made / "blob").iterdir():
        shutil.copy(folder / "tracks.mot.txt", texts / f"{folder.name}.txt")
        (tmp_path / "folders" / folder.name).mkdir(parents=True)
        shutil.copy(folder / "tracks.txt", tmp_path / "folders" / folder.name / "tracks.txt")
    assert run(["score", str(made / "data"), str(texts)]) == 0
    assert run(["score", str(made / "data"), str(tmp_path / "folders")]) == 0
    (one,) = (p for p in (made / "data").rglob("*s40001") if p.is_dir())
    assert run(["score", str(one), str(texts / "scene-s40001.txt")]) == 0
    capsys.readouterr()


def test_validate_says_whether_a_run_is_whole(made, tracks, capsys):
    assert run(["validate", str(tracks), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"status": "ok", "problems": [], "content_hash": None}
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
    assert run(["validate", str(made)]) in (0, 1)  # data and tracks together


def test_a_sealed_fault_is_named_with_its_frame(made, tracks, tmp_path, capsys, monkeypatch):
    """NaN in a table with right hashes, as a broken writer could make it."""
    from sim.io.store.track_files import read_tracks, write_tracks

    folder = tracks / "scene-s40000"
    info = json.loads((folder / "run.json").read_text())
    wrong = [t.replace(pos=t.pos * (np.nan if t.index == 7 else 1.0)) for t in read_tracks(folder)]
    with monkeypatch.context() as patch:
        patch.setattr("sim.io.store.track_files.RunRows.reject_faults", lambda *_: None)
        write_tracks(folder, wrong, fps=5.0, info=info)
    seal_again(folder)
    assert "tracks.parquet: frame 7, id " in refused(capsys, "score", made / "data", tracks)


def test_one_run_at_a_time_writes_to_a_folder(made, tmp_path, capsys):
    """The second command fails at once; a writer in Python fails, too, and inside the command it does not."""
    pytest.importorskip("fcntl")
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


def test_writers_of_one_folder_leave_a_whole_run(made, tmp_path):
    """Each writer ends with success or with one clear error, and those with success leave a run."""
    pytest.importorskip("fcntl")
    (sequence,) = open_source(next((made / "data").rglob("*-s40000")))
    tracked = track("blob", sequence, detections="file")

    def write(_):
        try:
            tracked.write(tmp_path / "out", sequence)
        except InputError as error:
            return str(error).partition(": ")[2].partition(";")[0]
        return "done"

    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(write, range(60)))
    assert set(found) <= {"got another run that writes here", "done"}
    assert "done" in found
    assert validate(tmp_path / "out") == []


@pytest.mark.parametrize("below", ["", "tracks"])
def test_tracks_are_not_written_into_a_stored_sequence(made, tmp_path, capsys, below):
    data = Path(shutil.copytree(made / "data", tmp_path / "data"))
    (folder,) = data.rglob("*-s40000")
    before = sorted(data.rglob("*"))
    line = ["track", "blob", folder, "--detections", "file", "--out", folder / below]
    assert "inside the stored sequence" in refused(capsys, *line)
    line = ["track", "blob", data, "--detections", "file", "--out", folder.parent]
    assert "inside the stored sequence" in refused(capsys, *line)
    assert sorted(data.rglob("*")) == before


def test_side_files_are_no_tracks(made, tmp_path, capsys):
    (tmp_path / "texts").mkdir()
    name = next((made / "blob").iterdir()).name
    shutil.copy(made / "blob" / name / "tracks.mot.txt", tmp_path / "texts" / f"{name}.txt")
    (tmp_path / "texts" / f"._{name}.txt").write_bytes(b"\0\5\x16\7")
    (source,) = (made / "data").rglob(name)
    assert run(["score", str(source), str(tmp_path / "texts")]) == 0


def test_a_renamed_folder_is_named_as_the_cause(tmp_path, capsys):
    """seqinfo.ini still has the name of before; tracks have that of the folder."""
    ini = recording(tmp_path / "data" / "cam1", "1,1,5,5,10,20,1,1,1\n2,1,6,5,10,20,1,1,1\n") / "seqinfo.ini"
    ini.write_text("[Sequence]\nname=video_1\nframeRate=25\nseqLength=2\n")
    (tmp_path / "results").mkdir()
    for name in ("cam1", "cam2"):
        (tmp_path / "results" / f"{name}.txt").write_text("1,1,5,5,10,20,1,-1,-1,-1\n")
    line = refused(capsys, "score", tmp_path / "data", tmp_path / "results")
    assert "got tracks of cam1, cam2; expected tracks of video_1" in line
    assert f"name=video_1 in {ini} is another than its folder's, cam1: correct it" in line
