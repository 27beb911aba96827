"""Samples of single frames: all of them once, in an order of the seed, read with the standard library alone."""

from __future__ import annotations

import json
import tarfile
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios.errors import InputError
from sim.store import sequence_folder
from sim.store.validate import content_hash
from tests.fake_simulator import content
from tests.made_up import make_in_view, make_sequence
from tests.recordings import mot_folder
from tracking.export.frame_shards import frame_shards
from tracking.export.webdataset import webdataset

STREAMS = ("left", "ids")
Samples = dict[str, dict[str, bytes]]


def store(folder: Path, seed: int, **more: str) -> None:
    live = replace(make_in_view(seed, STREAMS), name=folder.name)
    sequence_folder.write_sequence(folder, live, scenario="schema = 1\n", seed=seed, streams=STREAMS, **more)


@pytest.fixture
def data(tmp_path: Path) -> Path:
    for seed, name in enumerate(("b-s00000", "a.2-s00001")):
        store(tmp_path / "data/flockscope-train" / name, seed, images="png")
    return tmp_path / "data"


def samples(folder: Path) -> Samples:
    """The files of each sample by the part of their name after the first dot, in the order of the shards."""
    found: Samples = {}
    for shard in json.loads((folder / "index.json").read_text())["shards"]:
        with tarfile.open(folder / shard["name"]) as tar:
            for member in tar:
                key, _, kind = member.name.partition(".")
                assert key not in found or key == list(found)[-1], "a sample's files stand together"
                found.setdefault(key, {})[kind] = tar.extractfile(member).read()
    return found


def test_every_frame_is_a_sample_with_its_labels(data: Path, tmp_path: Path) -> None:
    made, index = frame_shards(data, tmp_path / "out")
    found = samples(tmp_path / "out")
    assert index["content_hash"] == content_hash(data)
    assert sum(shard["samples"] for shard in index["shards"]) == len(found) == made.pictures == 24
    kept = ignored = 0
    for seed, name in enumerate(("b-s00000", "a%2E2-s00001")):
        truth = make_in_view(seed, STREAMS).truth
        folder = data / "flockscope-train" / name.replace("%2E", ".")
        for k in range(1, 13):
            sample = found[f"flockscope-train/{name}-{k:06d}"]
            assert sample.keys() == {"png", "json", "ids.png"}
            assert sample["png"] == (folder / f"img1/{k:06d}.png").read_bytes()
            assert sample["ids.png"] == (folder / f"ids/{k:06d}.png").read_bytes()
            labels = json.loads(sample["json"])
            assert (labels["frame"], labels["width"], labels["height"]) == (k, 64, 48)
            assert labels["t"] == pytest.approx((k - 1) / truth.fps)
            for person in labels["people"]:
                row = truth.rows(k).start + truth.id[truth.rows(k)].tolist().index(person["id"])
                assert person["box"] == pytest.approx(truth.box[row].tolist(), abs=0.006)
                assert person["group"] == truth.group[row]
                shares = (truth.visibility[row], truth.truncation[row])
                assert (person["visibility"], person["truncation"]) == pytest.approx(shares, abs=6e-4)
                assert person["ignored"] == (truth.visibility[row] < 0.2 or person["id"] > 2)
                kept, ignored = kept + (not person["ignored"]), ignored + person["ignored"]
    assert (made.kept, made.ignored) == (kept, ignored)
    assert min(kept, ignored) > 0


def test_the_seed_is_the_order(data: Path, tmp_path: Path) -> None:
    for name, seed in (("one", 0), ("again", 0), ("other", 1)):
        frame_shards(data, tmp_path / name, seed=seed, shard_size=50_000)
    one, other = samples(tmp_path / "one"), samples(tmp_path / "other")
    assert content(tmp_path / "one") == content(tmp_path / "again")
    assert one == other
    assert list(one) != list(other)
    for order in (list(one), list(other)):
        assert order != sorted(order)
        assert len({key.rpartition("-")[0] for key in order[:12]}) == 2, "both sequences"


def test_shards_are_as_large_as_allowed(data: Path, tmp_path: Path) -> None:
    _, whole = frame_shards(data, tmp_path / "whole", shard_size=1)
    assert [shard["samples"] for shard in whole["shards"]] == [1] * 24
    _, some = frame_shards(data, tmp_path / "some", shard_size=60_000)
    sizes = [shard["bytes"] for shard in some["shards"]]
    assert 1 < len(sizes) < 24
    assert max(sizes) <= 60_000
    assert [p.stat().st_size for p in sorted((tmp_path / "some").glob("*.tar"))] == sizes
    assert list(samples(tmp_path / "some")) == list(samples(tmp_path / "whole"))


def test_the_same_export_again_and_no_other(data: Path, tmp_path: Path) -> None:
    seen = []
    frame_shards(data, tmp_path / "out", shard_size=50_000, progress=lambda *a: seen.append(a[:2]))
    assert seen == [(k, 24) for k in range(1, 25)]
    before = content(tmp_path / "out")
    (tmp_path / "out/shard-000001.tar").write_bytes(b"")
    frame_shards(data, tmp_path / "out", shard_size=50_000)
    assert content(tmp_path / "out") == before
    for change in ({"seed": 1}, {"shard_size": 60_000}, {"min_visibility": 0.3}):
        with pytest.raises(InputError, match="another export"):
            frame_shards(data, tmp_path / "out", **{"shard_size": 50_000, **change})
    for first, second in ((webdataset, frame_shards), (frame_shards, webdataset)):
        first(data, tmp_path / first.__name__)
        with pytest.raises(InputError, match="another export"):
            second(data, tmp_path / first.__name__)
    (tmp_path / "out/mine").touch()
    with pytest.raises(InputError, match="other files"):
        frame_shards(data, tmp_path / "out", shard_size=50_000)


def test_frames_of_videos_become_jpg(tmp_path: Path) -> None:
    store(tmp_path / "flockscope-train/s", 1, images="mp4")
    frame_shards(tmp_path, tmp_path / "out")
    body = samples(tmp_path / "out")["flockscope-train/s-000007"]["jpg"]
    right = next(f.image for f in make_in_view(1, STREAMS) if f.index == 7)
    assert np.abs(cv2.imdecode(np.frombuffer(body, np.uint8), cv2.IMREAD_COLOR).astype(int) - right).mean() < 15


def test_what_cannot_be_exported_is_refused(data: Path, tmp_path: Path) -> None:
    mot_folder(tmp_path / "mot", det="1,-1,0,0,4,6,1,-1,-1,-1\n")
    store(tmp_path / "both/a", 1)
    store(tmp_path / "both/b", 10_000)
    sequence_folder.write_sequence(tmp_path / "bare", make_sequence(1), scenario="schema = 1\n", seed=1)
    for source, words in (("mot", "a recording"), ("both", "the splits train, val"), ("bare", "no pictures")):
        with pytest.raises(InputError, match=words):
            frame_shards(tmp_path / source, tmp_path / "out")
    path = data / "flockscope-train/b-s00000/img1/000003.png"
    path.write_bytes(path.read_bytes() + b" ")
    with pytest.raises(InputError, match=r"000003\.png"):
        frame_shards(data, tmp_path / "out")
    assert not (tmp_path / "out").exists()
