import errno
import json
import os
from dataclasses import replace

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim.io.files import atomic
from sim.io.formats.mot_folder import read_seqinfo
from sim.io.source import open_source
from sim.io.store import sequence_folder
from sim.io.store.seal import with_hash
from sim.io.store.validate import validate
from sim.types import Frame, Sequence

SCENARIO = 'schema = 1\nname = "fake"\n'


@pytest.mark.parametrize("seed", range(10))
def test_a_stored_sequence_is_equal(tmp_path, make_sequence, same, seed):
    live = make_sequence(seed)
    sequence_folder.write_sequence(tmp_path / "a", live, scenario=SCENARIO, seed=seed)
    (stored,) = open_source(tmp_path / "a")
    same(live, stored)
    same(list(live), list(stored))
    same(list(stored), list(stored))
    same(live.truth, stored.truth)
    assert validate(tmp_path / "a") == []


def test_a_sequence_of_nobody_is_equal(tmp_path, same):
    live = Sequence("empty", 10.0, 3, lambda: (Frame(k, (k - 1) / 10) for k in (1, 2, 3)))
    sequence_folder.write_sequence(tmp_path / "a", live, scenario=SCENARIO, seed=0)
    (stored,) = open_source(tmp_path / "a")
    same(list(live), list(stored))
    assert stored.truth is None


@pytest.mark.parametrize("length", [1, 12])
def test_people_of_no_frame(tmp_path, make_sequence, same, length):
    live = make_sequence(1, length)
    t = live.truth
    none = np.zeros(0, bool)
    empty = {f: getattr(t, f)[:0] for f in ("frame", "id", "group", "pos", "vel", "box", "visibility", "z", "heading")}
    empty |= {f: getattr(t, f)[:0] for f in ("height", "truncation", "visible_box")}
    bare = t.replace(**empty, groups=tuple(g.none() for g in t.groups), groups_px=None, events=(), near=None, orders=())
    bare = bare.replace(camera=None, scene=None)  # of the sequence
    assert len(none) == 0
    lone = Sequence("none", 10.0, length, live.frames, load_truth=lambda: bare)
    sequence_folder.write_sequence(tmp_path / "a", lone, scenario=SCENARIO, seed=0)
    same(bare, sequence_folder.open_sequence(tmp_path / "a").truth)
    assert [p.got for p in validate(tmp_path / "a")] == [p.got for p in validate(tmp_path / "a")]


def test_same_content_same_bytes(make_sequence):
    a, b = (sequence_folder.sequence_files(make_sequence(3), scenario=SCENARIO, seed=3) for _ in range(2))
    assert a == b
    c = sequence_folder.sequence_files(make_sequence(4), scenario=SCENARIO, seed=3)
    hashes = [json.loads(x["manifest.json"]) for x in (a, c)]
    assert hashes[0]["truth_hash"] != hashes[1]["truth_hash"]
    assert hashes[0]["content_hash"] != hashes[1]["content_hash"]


def test_manifest_names_no_place_and_every_file(tmp_path, make_sequence):
    sequence_folder.write_sequence(tmp_path / "a", make_sequence(3), scenario=SCENARIO, seed=3)
    text = (tmp_path / "a/manifest.json").read_text()
    assert str(tmp_path) not in text
    named = set(json.loads(text)["files"]) | {"manifest.json"}
    assert named == {p.relative_to(tmp_path / "a").as_posix() for p in (tmp_path / "a").rglob("*") if p.is_file()}


def files_of(folder):
    return sorted(
        p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file() and p.name != "manifest.json"
    )


def test_each_missing_or_altered_file_is_named(tmp_path, make_sequence):
    folder = tmp_path / "a"
    sequence_folder.write_sequence(folder, make_sequence(3), scenario=SCENARIO, seed=3)
    for name in files_of(folder):
        whole = (folder / name).read_bytes()
        for kind, body in (("missing", None), ("altered", whole[:-1] + b"#"), ("truncated", whole[: len(whole) // 2])):
            (folder / name).unlink() if body is None else (folder / name).write_bytes(body)
            with pytest.raises(InputError) as error:
                open_source(folder)
            assert error.value.file.endswith(name)
            assert kind in error.value.got
            assert "\n" not in str(error.value)
            assert [p.file for p in validate(folder)] == [error.value.file]
            (folder / name).write_bytes(whole)
    (folder / "manifest.json").unlink()
    with pytest.raises(InputError, match="missing"):
        open_source(folder)


def test_each_altered_or_missing_field_of_the_manifest_is_told(tmp_path, make_sequence):
    folder = tmp_path / "a"
    sequence_folder.write_sequence(folder, make_sequence(3), scenario=SCENARIO, seed=3)
    path = folder / "manifest.json"
    whole = json.loads(path.read_text())
    inner = [("sequence", k) for k in whole["sequence"]] + [("files", "seqinfo.ini", k) for k in ("sha256", "bytes")]
    for keys in [*((k,) for k in whole), *inner]:
        for gone in (False, True):
            manifest = json.loads(path.read_text())
            held = manifest
            for key in keys[:-1]:
                held = held[key]
            if gone:
                del held[keys[-1]]
            else:
                held[keys[-1]] = 99
            path.write_text(json.dumps(manifest))
            with pytest.raises(InputError) as error:
                open_source(folder)
            assert error.value.file == str(path)
            assert "\n" not in str(error.value)
            assert [str(p) for p in validate(folder)] == [str(error.value)]
            path.write_text(json.dumps(whole))
    assert validate(folder) == []


def test_points_of_the_sensor_stand_on_the_stairs(tmp_path, make_sequence):
    from sim.scene.terrain import height_at

    live = make_sequence(3)
    sequence_folder.write_sequence(tmp_path / "a", live, scenario=SCENARIO, seed=3)
    table = np.loadtxt(tmp_path / "a/det/det.txt", delimiter=",")
    pos = np.concatenate([f.detections.pos for f in live])
    assert (height_at(live.scene, pos) > 0.01).any()
    np.testing.assert_allclose(table[:, 9], height_at(live.scene, pos), atol=6e-4)
    assert validate(tmp_path / "a") == []


def test_a_truncated_table_is_one_clear_line(tmp_path, make_sequence):
    from sim.io.files.tables import read_table

    files = sequence_folder.sequence_files(make_sequence(3), scenario=SCENARIO, seed=3)
    for name in [n for n in files if n.endswith(".parquet")]:
        path = tmp_path / "t.parquet"
        path.write_bytes(files[name][: len(files[name]) // 2])
        with pytest.raises(InputError) as error:
            read_table(path)
        assert error.value.file == str(path)
        assert "\n" not in str(error.value)


def swap(path, old, new):
    """Alter a file and let the manifest vouch for it, so that only the cross checks can see it."""
    from sim.hashing import file_hash

    text = path.read_text().replace(old, new, 1)
    assert text != path.read_text()
    path.write_text(text)
    folder = path.parent.parent if path.parent.name in ("gt", "det") else path.parent
    manifest = json.loads((folder / "manifest.json").read_text())
    body = path.read_bytes()
    manifest["files"][path.relative_to(folder).as_posix()] = {"sha256": file_hash(body), "bytes": len(body)}
    (folder / "manifest.json").write_text(json.dumps(with_hash(manifest)))


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("gt/events.json", '"members": [1', '"members": [99'),
        ("gt/events.json", '"end": 12', '"end": 99'),
        ("gt/script.json", '"event": null', '"event": 9'),
        ("gt/near.csv", "start,end,a,b\n", "start,end,a,b\n1,2,1,2\n"),
        ("scenario.toml", "fake", "fakes"),
    ],
)
def test_validate_sees_what_disagrees(tmp_path, make_sequence, name, old, new):
    folder = tmp_path / "a"
    sequence_folder.write_sequence(folder, make_sequence(5), scenario=SCENARIO, seed=5)
    swap(folder / name, old, new)
    problems = validate(folder)
    assert problems
    assert any(name in p.file or "manifest" in p.file for p in problems)
    assert all("\n" not in str(p) for p in problems)


def test_validate_reports_strangers_files_and_leftovers(tmp_path, make_sequence):
    root = tmp_path / "flockscope-train"
    sequence_folder.write_sequence(root / "a", make_sequence(5), scenario=SCENARIO, seed=5)
    (root / "a" / "note.txt").write_text("x")
    (root / ".partial-b-17").mkdir()
    (root / "a" / "._note").write_text("")
    (root / "a" / "img1").mkdir()
    (root / "a" / "img1" / "Thumbs.db").write_text("")
    (root / "__MACOSX").mkdir()
    got = [p.got for p in validate(tmp_path)]
    assert "a file the manifest does not name" in got
    assert "left by an interrupted run" in got
    named = [str(p) for p in validate(tmp_path)]
    assert not any(word in text for word in ("._note", "Thumbs", "__MACOSX") for text in named)
    with pytest.raises(InputError):
        validate(tmp_path / "nowhere")


@pytest.mark.parametrize(("number", "kind"), [(errno.ENOSPC, WorkError), (errno.EACCES, InputError)])
@pytest.mark.parametrize("after", [0, 3, 8])
def test_a_failing_write_leaves_nothing(tmp_path, make_sequence, monkeypatch, number, kind, after):
    done, write = [], atomic.write_inside

    def fail(path, body):
        done.append(path)
        if len(done) > after:
            raise OSError(number, os.strerror(number))
        write(path, body)

    monkeypatch.setattr(atomic, "write_inside", fail)
    with pytest.raises(kind) as error:
        sequence_folder.write_sequence(tmp_path / "new" / "a", make_sequence(1), scenario=SCENARIO, seed=1)
    assert os.strerror(number) in str(error.value)
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_seen_before_the_rename(tmp_path, make_sequence, monkeypatch):
    def fail(source, target):
        assert (source / "manifest.json").is_file()
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(atomic.os, "rename", fail)
    with pytest.raises(InputError):
        sequence_folder.write_sequence(tmp_path / "a", make_sequence(1), scenario=SCENARIO, seed=1)
    assert list(tmp_path.iterdir()) == []


def test_a_failing_write_keeps_what_was_there(tmp_path, make_sequence, monkeypatch):
    sequence_folder.write_sequence(tmp_path / "a", make_sequence(1), scenario=SCENARIO, seed=1)
    before = {n: (tmp_path / "a" / n).read_bytes() for n in files_of(tmp_path / "a")}

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(atomic, "write_inside", full)
    with pytest.raises(WorkError):
        sequence_folder.write_sequence(tmp_path / "a", make_sequence(2), scenario=SCENARIO, seed=2)
    assert before == {n: (tmp_path / "a" / n).read_bytes() for n in files_of(tmp_path / "a")}
    assert [p.name for p in tmp_path.iterdir()] == ["a"]


def test_an_unwritable_path(tmp_path, make_sequence):
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="--out"):
        sequence_folder.write_sequence(tmp_path / "file" / "a", make_sequence(1), scenario=SCENARIO, seed=1)


def test_a_line_break_in_a_name_is_no_line_of_the_ini_file(tmp_path, make_sequence):
    named = replace(make_sequence(1), name="x\nseqLength=1")
    folder = sequence_folder.write_sequence(tmp_path / "a", named, scenario="a = 1\n", seed=1)
    assert read_seqinfo(folder / "seqinfo.ini").length == named.length
    assert sequence_folder.open_sequence(folder).name == named.name
