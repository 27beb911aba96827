"""Tar shards: the same bytes each time, read as samples, turned back into the dataset with the same content hash."""

from __future__ import annotations

import json
import re
import shutil
import tarfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scenarios.errors import InputError
from sim.store import atomic, sequence_folder, tables
from sim.store.seal import read_manifest, with_hash
from sim.store.validate import content_hash, validate
from tests.fake_simulator import content
from tests.made_up import make_pictured
from tests.recordings import mot_folder
from tracking.export.webdataset import size_of, webdataset
from tracking.recordings.source import generated_folders

Sample = dict[str, bytes]


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """Three sequences with pictures, one of them with a dot in its name."""
    for k, name in enumerate(("b-s00000", "a.2-s00000", "c-s00000")):
        live = make_pictured(k, ("left", "ids", "background"))
        folder = tmp_path / "data" / "flockscope-train" / name
        sequence_folder.write_sequence(
            folder, live, scenario="schema = 1\n", seed=k, streams=("left", "ids", "background"), images="png"
        )
    return tmp_path / "data"


def members(path: Path) -> list[tuple[tarfile.TarInfo, bytes]]:
    with tarfile.open(path) as tar:
        return [(info, tar.extractfile(info).read()) for info in tar]


def samples(*paths: Path) -> dict[str, Sample]:
    """As webdataset groups them: consecutive files whose names are the same up to the first dot of the last part."""
    found: dict[str, Sample] = {}
    last = None
    for path in paths:
        for info, body in members(path):
            key, kind = re.fullmatch(r"((?:.*/|)[^.]+)[.]([^/]*)", info.name).groups()
            assert key == last or key not in found, "a sample's files stand together"
            assert kind not in found.setdefault(key, {})
            found[key][kind] = body
            last = key
    return found


def test_a_sequence_is_a_sample_and_can_be_unpacked(data: Path, tmp_path: Path) -> None:
    index = webdataset(data, tmp_path / "out")
    (shard,) = index["shards"]
    found = samples(tmp_path / "out" / shard["name"])
    assert list(found) == [f"flockscope-train/{name}" for name in ("a%2E2-s00000", "b-s00000", "c-s00000")]
    for key, sample in found.items():
        files = {name: sample.pop(name.replace("/", ".")) for name in json.loads(sample["manifest.json"])["files"]}
        files["manifest.json"] = sample.pop("manifest.json")
        assert not sample
        for name, body in files.items():
            atomic.write_inside(tmp_path / "back" / key.replace("%2E", ".") / name, body)
    assert content(tmp_path / "back") == content(data)
    assert index["content_hash"] == content_hash(data) == content_hash(tmp_path / "back")
    assert [p for s in (tmp_path / "back").glob("*/*") for p in validate(s)] == []


def test_the_same_bytes_from_anywhere_and_nothing_of_the_machine(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    webdataset(data, tmp_path / "one", shard_size=1)
    for path in data.rglob("*"):
        path.touch()
    monkeypatch.chdir(data / "flockscope-train")
    webdataset(".", tmp_path / "two", shard_size=1)
    assert content(tmp_path / "one") == content(tmp_path / "two")
    assert len(list((tmp_path / "one").glob("*.tar"))) == 3
    for info, _ in members(tmp_path / "one" / "shard-000001.tar"):
        assert (info.mtime, info.uid, info.gid, info.uname, info.gname, info.mode) == (0, 0, 0, "", "", 0o644)


def test_shards_hold_whole_sequences_up_to_their_size(data: Path, tmp_path: Path) -> None:
    whole = webdataset(data, tmp_path / "whole", shard_size=1)["shards"]
    largest = max(shard["bytes"] for shard in whole)
    some = webdataset(data, tmp_path / "some", shard_size=int(2.5 * largest))["shards"]
    assert [len(shard["sequences"]) for shard in some] == [2, 1]
    assert all(shard["bytes"] <= 2.5 * largest for shard in some)
    paths = [tmp_path / "some" / shard["name"] for shard in some]
    assert samples(*paths) == samples(*[tmp_path / "whole" / shard["name"] for shard in whole])


def test_the_same_export_again(data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What an interrupted one left is removed, a damaged shard replaced; links stay, and the folder may be "."."""
    out, disk = tmp_path / "out", tmp_path / "disk"
    disk.mkdir()
    out.symlink_to(disk)
    webdataset(data, out, shard_size=1)
    before = content(disk)
    (out / "shard-000002.tar").write_bytes(b"")
    (out / f"{atomic.PARTIAL}index.json-0123456789ab").mkdir()
    seen = []
    monkeypatch.chdir(disk)
    webdataset(data, ".", shard_size=1, progress=lambda *a: seen.append(a))
    assert content(disk) == before
    assert seen == [(k, 3, f"shard-{k - 1:06d}.tar") for k in (1, 2, 3)]
    (out / "mine").write_text("mine")
    with pytest.raises(InputError, match="other files"):
        webdataset(data, out, shard_size=1)


@pytest.mark.parametrize("name", ["gt/truth.parquet", "img1/000003.png", "manifest.json"])
def test_an_altered_file_is_named_and_its_shard_not_written(data: Path, tmp_path: Path, name: str) -> None:
    path = data / "flockscope-train" / "b-s00000" / name
    path.write_bytes(path.read_bytes().replace(b"1", b"2", 1) + b" ")
    with pytest.raises(InputError, match=re.escape(str(path))):
        webdataset(data, tmp_path / "out", shard_size=1)
    assert sorted(tmp_path.iterdir()) == [tmp_path / "data"]


def test_what_is_not_ours_is_refused(tmp_path: Path) -> None:
    mot_folder(tmp_path / "mot", det="1,-1,0,0,4,6,1,-1,-1,-1\n")
    for source, word in ((tmp_path / "mot", "a recording, mot"), (tmp_path / "no", "no sequences")):
        with pytest.raises(InputError, match=f"{word}.*flockscope generate"):
            webdataset(source, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("text", "size"), [("1", 1), ("500MB", 500_000_000), ("1.5 GB", 1_500_000_000), ("20 kB", 20_000), ("7B", 7)]
)
def test_sizes(text: str, size: int) -> None:
    assert size_of(text) == size


def copied(data: Path, tmp_path: Path, change: Callable[[dict[str, Any], Path], None]) -> Path:
    """A copy of the first sequence whose manifest is changed and sealed again."""
    folder = Path(shutil.copytree(generated_folders(data)[0], tmp_path / "flockscope-train/a"))
    manifest = read_manifest(folder)
    change(manifest, folder)
    (folder / "manifest.json").write_bytes(tables.json_document(with_hash(manifest)))
    return folder


def link_out_of_the_sequence(manifest: dict[str, Any], folder: Path) -> None:
    secret = folder.parent / "secret"
    (folder / "scenario.toml").rename(secret)
    (folder / "scenario.toml").symlink_to(secret)


CHANGED_MANIFESTS = [
    (lambda manifest, _: manifest.update(files={}), r"files: got no scenario.toml and \d+ more"),
    (link_out_of_the_sequence, r"scenario.toml: got a link that leads out of the sequence"),
]


@pytest.mark.parametrize(("change", "words"), CHANGED_MANIFESTS)
def test_what_a_changed_manifest_vouches_for_is_not_exported(data, tmp_path: Path, change, words) -> None:
    folder = copied(data, tmp_path, change)
    with pytest.raises(InputError, match=words):
        webdataset(folder, tmp_path / "out")
    assert not list((tmp_path / "out").glob("*"))


@pytest.mark.parametrize(("part", "more"), [("", {"shard_size": 1}), ("b-s00000", {})])
def test_another_export_is_not_overwritten(data: Path, tmp_path: Path, part: str, more: dict[str, Any]) -> None:
    source = data / "flockscope-train" / part
    for first, second in (((data, {}), (source, more)), ((source, more), (data, {}))):
        out = tmp_path / f"out{len(list(tmp_path.iterdir()))}"
        webdataset(first[0], out, **first[1])
        before = content(out)
        with pytest.raises(InputError, match="another export"):
            webdataset(second[0], out, **second[1])
        assert content(out) == before


def test_two_of_one_name_are_refused(data: Path, tmp_path: Path) -> None:
    both = tmp_path / "both"
    for part in ("one", "two"):
        (both / part).mkdir(parents=True)
        (both / part / "flockscope-train").symlink_to(data / "flockscope-train")
    with pytest.raises(InputError, match=r"two sequences flockscope-train/a\.2-s00000"):
        webdataset(both, tmp_path / "out")
