"""Stored sequences: exact round trips; whatever happens to a file or the manifest is told in one line."""

import errno
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim.store import atomic
from sim.store.seal import MANIFEST, with_hash
from sim.store.sequence_folder import open_sequence, write_sequence
from sim.store.tables import json_document
from sim.store.validate import validate
from sim.types import Frame, Sequence
from tests.made_up import make_sequence, same
from tracking.recordings.mot_folder import read_seqinfo
from tracking.recordings.source import open_source

SCENARIO = 'schema = 1\nname = "fake"\n'


def stored(folder, seed, live=None):
    return write_sequence(folder, live or make_sequence(seed), scenario=SCENARIO, seed=seed)


@pytest.mark.parametrize("seed", range(4))
def test_a_stored_sequence_is_equal(tmp_path, seed):
    live = make_sequence(seed)
    (read,) = open_source(stored(tmp_path / "a", seed, live))
    same(live, read)
    same(list(live), list(read))
    same(list(read), list(read))
    same(live.truth, read.truth)
    assert validate(tmp_path / "a") == []


def test_a_sequence_of_nobody_is_equal(tmp_path):
    live = Sequence("empty", 10.0, 3, lambda: (Frame(k, (k - 1) / 10) for k in (1, 2, 3)))
    (read,) = open_source(stored(tmp_path / "a", 0, live))
    same(list(live), list(read))
    assert read.truth is None


def files_of(folder):
    return sorted(
        p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p.name != "manifest.json"
    )


def test_each_missing_or_altered_file_is_named(tmp_path):
    folder = stored(tmp_path / "a", 3)
    for name in files_of(folder):
        whole = (folder / name).read_bytes()
        for kind, body in (("missing", None), ("altered", whole[:-1] + b"#"), ("truncated", whole[: len(whole) // 2])):
            (folder / name).unlink() if body is None else (folder / name).write_bytes(body)
            with pytest.raises(InputError) as error:
                open_source(folder)
            assert error.value.file.endswith(name)
            assert kind in error.value.got
            assert [p.file for p in validate(folder)] == [error.value.file]
            (folder / name).write_bytes(whole)
    (folder / "manifest.json").unlink()
    with pytest.raises(InputError, match="missing"):
        open_source(folder)


def test_each_altered_or_missing_field_of_the_manifest_is_told(tmp_path):
    folder = stored(tmp_path / "a", 3)
    path = folder / "manifest.json"
    whole = json.loads(path.read_text())
    for key in whole:
        for changed in ({**whole, key: 99}, {k: v for k, v in whole.items() if k != key}):
            path.write_text(json.dumps(changed))
            with pytest.raises(InputError) as error:
                open_source(folder)
            assert error.value.file == str(path)
            assert [str(p) for p in validate(folder)] == [str(error.value)]


def test_points_of_the_sensor_stand_on_the_stairs(tmp_path):
    from sim.scene.terrain import height_at

    live = make_sequence(3)
    stored(tmp_path / "a", 3, live)
    table = np.loadtxt(tmp_path / "a/det/det.txt", delimiter=",")
    pos = np.concatenate([f.detections.pos for f in live])
    assert (height_at(live.scene, pos) > 0.01).any()
    np.testing.assert_allclose(table[:, 9], height_at(live.scene, pos), atol=6e-4)
    assert validate(tmp_path / "a") == []


def test_validate_reports_strangers_files_and_leftovers(tmp_path):
    root = tmp_path / "flockscope-train"
    stored(root / "a", 5)
    (root / "a" / "note.txt").write_text("x")
    (root / ".partial-b-17").mkdir()
    (root / "a" / "._note").write_text("")
    (root / "a" / "img1").mkdir()
    (root / "a" / "img1" / "Thumbs.db").write_text("")
    (root / "__MACOSX").mkdir()
    problems = validate(tmp_path)
    assert {"a file the manifest does not name", "left by an interrupted run"} <= {p.got for p in problems}
    assert not any(word in str(p) for word in ("._note", "Thumbs", "__MACOSX") for p in problems)
    with pytest.raises(InputError):
        validate(tmp_path / "nowhere")


@pytest.mark.parametrize(("number", "kind"), [(errno.ENOSPC, WorkError), (errno.EACCES, InputError)])
@pytest.mark.parametrize("after", [0, 3, 8])
def test_a_failing_write_leaves_nothing(tmp_path, monkeypatch, number, kind, after):
    done, write = [], atomic.write_inside

    def fail(path, body):
        done.append(path)
        if len(done) > after:
            raise OSError(number, os.strerror(number))
        write(path, body)

    monkeypatch.setattr(atomic, "write_inside", fail)
    with pytest.raises(kind) as error:
        stored(tmp_path / "new" / "a", 1)
    assert os.strerror(number) in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_a_failing_write_keeps_what_was_there(tmp_path, monkeypatch):
    stored(tmp_path / "a", 1)
    before = {n: (tmp_path / "a" / n).read_bytes() for n in files_of(tmp_path / "a")}

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic, "write_inside", full)
    with pytest.raises(WorkError):
        stored(tmp_path / "a", 2)
    assert before == {n: (tmp_path / "a" / n).read_bytes() for n in files_of(tmp_path / "a")}
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_a_line_break_in_a_name_is_no_line_of_the_ini_file(tmp_path):
    named = replace(make_sequence(1), name="x\nseqLength=1")
    folder = stored(tmp_path / "a", 1, named)
    assert read_seqinfo(folder / "seqinfo.ini").length == named.length
    assert open_sequence(folder).name == named.name


WRONG = {
    "fps": ["10", -5, 0, None, 1e9, True], "length": ["5", -1, 2.5, 10**8, None], "px_per_m": ["x", -1, 0, 1e-3, 2e5],
    "image_size": [[1], "x", [0, 0], [64, 48, 3], ["64", 48], [16384, 16384]], "name": [5, None],
}  # fmt: skip
TOP = {
    "streams": ["left", ["x"], None, [1]], "images": [5, "gif"], "seed": ["a", -1, None, 1.5], "repeat": ["x"],
    "truth_hash": [5], "sequence": [None, 5, []],
}  # fmt: skip


def sealed(folder, change):
    manifest = json.loads((folder / MANIFEST).read_bytes())
    change(manifest)
    (folder / MANIFEST).write_bytes(json_document(with_hash(manifest)))


@pytest.mark.parametrize(
    ("place", "value"),
    [(f"sequence.{key}", v) for key, some in WRONG.items() for v in some] + [(k, v) for k, w in TOP.items() for v in w],
)
def test_values_of_another_kind(tmp_path, place, value):
    folder = stored(tmp_path / "a", 1)
    key = place.removeprefix("sequence.")
    sealed(folder, lambda m: (m["sequence"] if key != place else m).__setitem__(key, value))
    with pytest.raises(InputError) as error:
        open_sequence(folder)
    assert error.value.place.startswith(place)
    assert error.value.file == str(folder / MANIFEST)


def test_another_length_than_the_files(tmp_path):
    folder = stored(tmp_path / "a", 1)
    sealed(folder, lambda m: m["sequence"].__setitem__("length", 7))
    for read in (lambda: list(open_sequence(folder).frames()), lambda: open_sequence(folder).truth):
        with pytest.raises(InputError, match="7 frames"):
            read()
