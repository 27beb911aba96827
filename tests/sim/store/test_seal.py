"""A run is sealed: whatever happens to its files, its tracks are those that were written, or they are refused."""

from __future__ import annotations

import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from scenarios.errors import InputError
from sim.store.seal import NAMES, check_run, read_run, with_hash
from sim.store.tables import json_document
from sim.store.track_files import tracks_files, write_tracks
from sim.store.validate import validate
from tests.made_up import make_tracks, same
from tests.processes import python
from tests.sealing import seal_again
from tracking.app.stored_tracks import find_tracks
from tracking.recordings.track_texts import read_tracks

PAIRS = bytes(range(256))
INFO = {"tracker": "blob", "config": {"a": 1.5e-7}, "seed": 0, "sequence": "s", "fps": 10.0}


@pytest.fixture
def folder(tmp_path) -> Path:
    return write_tracks(tmp_path / "t", make_tracks(1), fps=10.0, info=INFO, pairs=PAIRS)


def write(folder: Path, files: dict[str, bytes]) -> Path:
    folder.mkdir()
    for name, body in files.items():
        (folder / name).write_bytes(body)
    return folder


def test_the_seal_names_every_file(folder):
    run = read_run(folder)
    assert set(run["files"]) == {p.name for p in folder.iterdir()} - {"run.json"} == set(NAMES) - {"run.json"}
    assert run["files"]["tracks.txt"]["bytes"] == (folder / "tracks.txt").stat().st_size
    assert list(run)[:2] == ["format", "tracker"]
    assert validate(folder) == validate(folder.parent) == []


@pytest.mark.parametrize("name", NAMES)
def test_no_flipped_bit_is_accepted(folder, name):
    """One bit in each of 60 places of every file, spread over the whole of it; every fiftieth bit of run.json."""
    path, right = folder / name, (folder / name).read_bytes()
    bits = 8 * len(right)
    chosen = range(0, bits, 50) if name == "run.json" else np.unique(np.linspace(0, bits - 1, 60).astype(int)).tolist()
    for bit in chosen:
        body = bytearray(right)
        body[bit // 8] ^= 1 << bit % 8
        path.write_bytes(body)
        with pytest.raises(InputError) as error:
            check_run(folder)
        assert error.value.file == str(path)
    with pytest.raises(InputError):
        read_tracks(folder)
    assert validate(folder)
    path.write_bytes(right)
    assert validate(folder) == []


@pytest.mark.parametrize("name", [name for name in NAMES if name != "run.json"])
@pytest.mark.parametrize("fault", ["truncated", "missing"])
def test_a_deleted_or_cut_file_is_named(folder, name, fault):
    (folder / name).write_bytes((folder / name).read_bytes()[:-1])
    if fault == "missing":
        (folder / name).unlink()
    with pytest.raises(InputError, match=rf"{fault}.*track again") as error:
        read_tracks(folder)
    assert error.value.file == str(folder / name)


REPLACED = [
    (json_document({"format": 1, **INFO, "boxes": "measured"}), "altered fields.*track again"),
    *((body, r"run\.json.*delete run\.json, then track again") for body in (b'{"boxes": "measured"', b"", b"[]")),
]


@pytest.mark.parametrize(("body", "words"), REPLACED)
def test_files_beside_a_damaged_run_json_are_no_other_program_s(folder, body, words):
    (folder / "run.json").write_bytes(body)
    for _ in range(2):
        with pytest.raises(InputError, match=words):
            read_tracks(folder)
        (folder / "tracks.parquet").unlink(missing_ok=True)
    (folder / "run.json").write_text('{"mine": 1}')
    assert len(read_tracks(folder)) > 0


def test_files_of_two_runs_are_refused(tmp_path):
    """Whichever file is of the other run; and one that this run would not have."""
    one, two = (tracks_files(make_tracks(seed), fps=10.0, info=INFO, pairs=PAIRS + bytes([seed])) for seed in (1, 2))
    for name in NAMES:
        folder = write(tmp_path / name, {**one, name: two[name]})
        with pytest.raises(InputError, match="track again"):
            read_tracks(folder)
    bare = tracks_files([t.replace(groups=None) for t in make_tracks(1)], fps=10.0, info=INFO)
    folder = write(tmp_path / "bare", {"groups.parquet": one["groups.parquet"], **bare})
    with pytest.raises(InputError, match=r"groups\.parquet: got a file that run\.json does not name"):
        read_tracks(folder)


def _parquet() -> bytes:
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table({"frame": [1], "boxes": [2]}), sink)
    return sink.getvalue().to_pybytes()


FOREIGN = {
    "tracks.parquet": _parquet(), "a broken tracks.parquet": b"PAR1", "run.json": b'{"boxes": [1, 2], "format": 1}',
    "a broken run.json": b'{"boxes": "measured"', "a list in run.json": b'["boxes"]',
    "another run.json": b'{"mine": 1}', "tracks.txt": b"mine", "groups.csv": b"mine",
}  # fmt: skip


@pytest.mark.parametrize("kind", FOREIGN)
def test_a_file_with_our_name_and_words_is_not_replaced(tmp_path, kind):
    name = kind.split()[-1]
    (tmp_path / name).write_bytes(FOREIGN[kind])
    with pytest.raises(InputError, match=r"another program.*choose another --out") as error:
        write_tracks(tmp_path, make_tracks(1), fps=10.0)
    assert error.value.file == str(tmp_path / name)
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {name: FOREIGN[kind]}


FAULTS = {
    "id": (lambda t: t.replace(id=np.where(t.id == t.id.max(), -1, t.id)), "negative id"),
    "id twice": (lambda t: t.replace(id=np.full_like(t.id, 3)), "second time"),
    "group": (lambda t: t.replace(group=t.group - 5), "group below -1"),
    "pos nan": (lambda t: t.replace(pos=t.pos * np.nan), "NaN or infinity in pos"),
    "pos inf": (lambda t: t.replace(pos=t.pos + np.inf), "NaN or infinity in pos"),
    "vel": (lambda t: t.replace(vel=t.vel + np.inf), "infinity in vel"),
    "score": (lambda t: t.replace(score=t.score * np.nan), "NaN or infinity in score"),
    "box": (lambda t: t if t.box is None else t.replace(box=t.box * np.nan), "NaN or infinity in box"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_sealed_fault_is_a_fault(tmp_path, monkeypatch, fault):
    """Neither the writer nor the reader takes it, even with right hashes."""
    spoil, words = FAULTS[fault]
    wrong = [spoil(t.replace(id=t.id + 1)) if len(t.id) > 1 else t for t in make_tracks(1)]
    with pytest.raises(InputError, match=words):
        write_tracks(tmp_path / "t", wrong, fps=10.0)
    assert not (tmp_path / "t").exists()
    with monkeypatch.context() as patch:
        patch.setattr("sim.store.track_files.RunRows.reject_faults", lambda *_: None)
        write_tracks(tmp_path / "t", wrong, fps=10.0)
    with pytest.raises(InputError, match=words) as error:
        read_tracks(tmp_path / "t")
    assert error.value.place.startswith("frame ")


def test_groups_of_other_frames_or_ids(tmp_path):
    one = tracks_files(make_tracks(1), fps=10.0, info=INFO)
    for name, groups in (
        ("fewer", tracks_files(make_tracks(1)[:5], fps=10.0)["groups.parquet"]),
        ("later", tracks_files([t.replace(index=t.index + 1) for t in make_tracks(1)], fps=10.0)["groups.parquet"]),
    ):
        folder = write(tmp_path / name, {**one, "groups.parquet": groups})
        seal_again(folder)
        with pytest.raises(InputError, match=r"groups\.parquet: schema: got groups of frames"):
            read_tracks(folder)
    spoilt = [t if t.groups is None else t.replace(groups=t.groups.replace(id=t.groups.id - 9)) for t in make_tracks(1)]
    folder = write(tmp_path / "ids", {**one, "groups.parquet": tracks_files(spoilt, fps=10.0)["groups.parquet"]})
    seal_again(folder)
    with pytest.raises(InputError, match=r"groups\.parquet: frame \d+: got a group below 0"):
        read_tracks(folder)


# A program of its own that writes the new run over a folder, killed before the k-th call that changes the disk.
PROGRAM = """
import os, pickle, sys
from pathlib import Path
from sim.store import atomic
from sim.store.seal import NAMES

root, files = Path(sys.argv[1]), pickle.loads(Path(sys.argv[2]).read_bytes())

def write(folder, last):
    count = 0
    def dying(call):
        def run(*arguments, **more):
            nonlocal count
            count += 1
            if count == last:
                os._exit(9)
            return call(*arguments, **more)
        return run
    for name in ("replace", "unlink", "mkdir"):
        setattr(os, name, dying(getattr(os, name)))
    atomic.replace_sealed(folder, files, "run.json", NAMES)

for k in range(1, 200):
    child = os.fork()
    if child == 0:
        write(root / str(k), k)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if status == 0:
        break
print(k)
"""


@pytest.mark.parametrize("before", ["another run", "nothing"])
def test_killed_at_any_moment(tmp_path, before):
    """The old run is whole, or the new one is, or the folder is refused."""
    old, new = make_tracks(1), [t.replace(groups=None) for t in make_tracks(2)]
    (tmp_path / "program.py").write_text(PROGRAM)
    (tmp_path / "files").write_bytes(pickle.dumps(tracks_files(new, fps=10.0, info=INFO)))
    first = write_tracks(tmp_path / "old", old, fps=10.0, info=INFO)
    (tmp_path / "out").mkdir()
    for k in range(1, 60):
        if before == "another run":
            shutil.copytree(first, tmp_path / "out" / str(k))
    done = python(tmp_path / "program.py", tmp_path / "out", tmp_path / "files")
    assert done.returncode == 0, done.stderr
    last = int(done.stdout)
    assert 5 < last < 60
    ended = [ending(tmp_path / "out" / str(k), old, new) for k in range(1, last + 1)]
    assert any((tmp_path / "out").glob(".partial-*"))
    (tmp_path / "out" / ".partial-9-9-0123456789ab").write_text("of another target")
    for k in range(1, last + 1):
        same(new, read_tracks(write_tracks(tmp_path / "out" / str(k), new, fps=10.0, info=INFO)))
    assert [p.name for p in (tmp_path / "out").glob(".partial-*")] == [".partial-9-9-0123456789ab"]
    assert ended == sorted(ended, key=["nothing", "old", "refused", "new"].index)
    assert ended[0] == ("nothing" if before == "nothing" else "old")
    assert ended[-1] == "new"
    assert "refused" in ended


def ending(folder: Path, old: list, new: list) -> str:
    """What a reader gets of a folder after a kill."""
    try:
        found = read_tracks(folder, fps=10.0)
    except InputError as refusal:
        line = refusal.line()
    else:
        kind = "new" if found[0].groups is None else "old"
        same(found, {"old": old, "new": new}[kind])
        return kind
    if (folder / "tracks.parquet").exists():
        assert "incomplete: track again" in line
        return "refused"
    assert "no tracks" in line
    return "nothing"


RIGHT = {"sha256": "x", "bytes": 3}
WRONG = {
    "tracker": [None, 5, ["blob"]], "sequence": [None, 5, {}], "config": [[], "x", 3], "grouping": ["x", [1]],
    "sensor": [[], "x"], "seed": ["0", 1.5, True], "detections": [5, ["image"]], "background": [5, {}],
    "plane": [2, []], "causal": ["yes", 1], "truth_hash": [5, []], "fps": ["10", -5, 0, 1e9, True],
    "px_per_m": ["x", True], "boxes": [None, "x", 3],
    "files": [
        {"a": 3}, {"a": {"sha256": "x"}}, {"a": {"sha256": "x", "bytes": "3"}}, {"": RIGHT}, {"../a": RIGHT},
        {"/a": RIGHT}, {"a\0": RIGHT},
    ],
}  # fmt: skip


@pytest.mark.parametrize(("key", "value"), [(key, value) for key, values in WRONG.items() for value in values])
def test_values_of_another_kind(folder, key, value):
    """With a right hash of its own."""
    run = {**json.loads((folder / "run.json").read_bytes()), key: value}
    (folder / "run.json").write_bytes(json_document(with_hash(run)))
    with pytest.raises(InputError) as error:
        find_tracks(folder)
    assert (error.value.file, error.value.place.partition(".")[0]) == (str(folder / "run.json"), key)
    assert "track again" in error.value.remedy


def test_right_values_and_further_keys(tmp_path):
    nothing = dict.fromkeys(WRONG.keys() - {"tracker", "sequence", "boxes", "files"})
    for info in ({}, nothing, {"mine": [1, {"a": None}]}):
        assert info.items() <= read_run(write_tracks(tmp_path / "t", make_tracks(1), fps=10.0, info=info)).items()
