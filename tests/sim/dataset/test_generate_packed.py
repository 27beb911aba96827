"""Shards hold what the folders hold that are made without them; they are kept, extended, made anew and refused."""

from __future__ import annotations

import io
import json
import subprocess
import tarfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scenarios.errors import InputError, OrderError, WorkError
from scenarios.loading.resolve import Entry
from sim.dataset import generate as dataset
from sim.dataset.generate import generate
from sim.store import packs
from sim.store.tables import read_table
from sim.store.validate import content_hash, validate
from sim.workers.start import WorkerOptions
from tests.fake_simulator import scenario
from tracking.export.coco import coco
from tracking.export.webdataset import webdataset
from tracking.recordings.source import open_source


def bytes_below(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def entries() -> list[Entry]:
    return [Entry("x", scenario()), Entry("y-1", scenario(), 1)]


def shards(root: Path) -> list[str]:
    return [path.relative_to(root / "flockscope-train").as_posix() for path in packs.shards_in(root)]


def test_shards_hold_the_folders_of_the_same_command(tmp_path: Path, simulate: Any) -> None:
    generate(entries(), range(98, 103), tmp_path / "plain")
    made = generate(entries(), range(98, 103), tmp_path / "packed", pack=True)
    assert shards(tmp_path / "packed") == [
        "x/x-s00000.tar", "x/x-s00100.tar", "y-1/y-1-s00000.tar", "y-1/y-1-s00100.tar",
    ]  # fmt: skip
    assert made == packs.shards_in(tmp_path / "packed")
    (tmp_path / "untarred").mkdir()
    for shard in made:
        subprocess.run(["tar", "xf", shard, "-C", tmp_path / "untarred"], check=True)
    assert bytes_below(tmp_path / "untarred") == bytes_below(tmp_path / "plain" / "flockscope-train")
    assert validate(tmp_path / "packed") == []
    assert content_hash(tmp_path / "packed") == content_hash(tmp_path / "plain")
    index, split = (
        read_table(tmp_path / "packed/flockscope-train/index.parquet"),
        tmp_path / "plain/flockscope-train",
    )
    wanted = sorted(path.name for path in split.iterdir())
    assert index.columns["name"].tolist() == wanted
    columns = [index.columns[name].tolist() for name in packs.COLUMNS]
    for name, seed, of, shard, first, span, frames, people, content in zip(*columns, strict=True):
        tar = (tmp_path / "packed/flockscope-train" / shard).read_bytes()[first : first + span]
        with tarfile.open(fileobj=io.BytesIO(tar)) as members:
            assert {member.name.partition("/")[0] for member in members} == {name}
            assert len(members.getmembers()) == len(bytes_below(split / name))
        (sequence,) = open_source(split / name)
        assert sequence.truth is not None
        assert (frames, people) == (sequence.length, len(np.unique(sequence.truth.id)))
        assert (of, seed, content) == ("train", int(name[-5:]), content_hash_of(split / name))


def content_hash_of(folder: Path) -> str:
    return str(json.loads((folder / "manifest.json").read_text())["content_hash"])


def test_readers_take_shards_as_folders(tmp_path: Path, simulate: Any) -> None:
    for name, pack in (("plain", False), ("packed", True)):
        generate(entries(), range(3), tmp_path / name, pack=pack, streams=())
    plain, packed = (open_source(tmp_path / name) for name in ("plain", "packed"))
    assert (
        [s.name for s in plain] == [s.name for s in packed] == [f"{n}-s0000{k}" for n in ("x", "y-1") for k in range(3)]
    )
    for a, b in zip(plain, packed, strict=True):
        assert a.truth is not None
        assert b.truth is not None
        np.testing.assert_array_equal(a.truth.pos, b.truth.pos)
    (one,) = packs.shards_in(tmp_path / "packed")[:1]
    assert [s.name for s in open_source(one)] == ["x-s00000", "x-s00001", "x-s00002"]
    hashes = [webdataset(tmp_path / name, tmp_path / f"{name}-shards")["content_hash"] for name in ("plain", "packed")]
    assert hashes[0] == hashes[1] == content_hash(tmp_path / "packed")
    both = [coco(tmp_path / name, tmp_path / f"{name}.json").files[0].read_text() for name in ("plain", "packed")]
    assert json.loads(both[0])["annotations"] == json.loads(both[1])["annotations"]


def test_coco_cannot_name_pictures_in_shards(tmp_path: Path, simulate: Any) -> None:
    generate(entries()[:1], range(1), tmp_path / "set", pack=True)
    with pytest.raises(InputError, match="pictures in a shard"):
        coco(tmp_path / "set", tmp_path / "coco.json")


def test_shards_are_kept_extended_and_made_anew(tmp_path: Path, simulate: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def made(seeds: range, **more: Any) -> int:
        count = 0
        store = dataset.simulate_and_store

        def counted(job: Any) -> None:
            nonlocal count
            count += 1
            store(job)

        with monkeypatch.context() as patched:
            patched.setattr(dataset, "simulate_and_store", counted)
            generate([Entry("x", scenario(**more))], seeds, tmp_path, pack=True, streams=())
        return count

    assert made(range(2)) == 2
    assert made(range(2)) == 0
    assert made(range(1, 4)) == 4  # the shard of the hundred is made anew with all seeds
    before = bytes_below(tmp_path)
    assert made(range(4)) == 0
    (shard,) = packs.shards_in(tmp_path)
    shard.write_bytes(shard.read_bytes()[:-1] + b"x")
    assert [error.got.split(":")[0] for error in validate(tmp_path)] == ["altered"]
    assert made(range(4)) == 4
    assert bytes_below(tmp_path) == before
    packs.seal_of(shard).unlink()
    assert [error.got for error in validate(tmp_path)] == ["a shard without a seal"]
    assert made(range(4)) == 4
    with pytest.raises(InputError, match=r"x-s00000.tar: .*scenario_hash"):
        made(range(4), duration=3.0)
    with pytest.raises(InputError, match="a packed dataset"):
        generate([Entry("x", scenario())], range(1), tmp_path)
    assert bytes_below(tmp_path) == before


def test_workers_make_the_same_shards(tmp_path: Path) -> None:
    short = {"set": ["duration=1"], "streams": (), "pack": True}
    generate(["cross"], range(99, 102), tmp_path / "one", **short)
    generate(["cross"], range(99, 102), tmp_path / "two", workers=WorkerOptions(2), **short)
    assert bytes_below(tmp_path / "one") == bytes_below(tmp_path / "two")


def test_what_fails_is_named_and_what_is_left_out_is_known_again(
    tmp_path: Path, simulate: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    store, asked = dataset.simulate_and_store, list[int]()

    def fails(job: Any) -> None:
        asked.append(job.seed)
        if job.seed == 7:
            raise OrderError(got="never", expected="a merge", remedy="wait")
        if job.seed == 130:
            raise WorkError(file=job.name, got="a bug", expected="none", remedy="mend it")
        store(job)

    monkeypatch.setattr(dataset, "simulate_and_store", fails)
    for _ in range(2):
        made = generate([Entry("x", scenario())], range(25), tmp_path, pack=True, streams=())
        assert list(made.left_out) == ["x-s00007"]
    assert generate([Entry("x", scenario())], range(2), tmp_path, pack=True, streams=()).left_out == {}
    assert asked == list(range(25))
    assert len(open_source(tmp_path)) == 24
    with pytest.raises(WorkError, match="x-s00130"):
        generate([Entry("x", scenario())], range(131), tmp_path, pack=True, streams=())
    assert shards(tmp_path) == ["x/x-s00000.tar"]
    assert not list(tmp_path.rglob(".partial*"))
