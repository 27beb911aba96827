"""Replays as a dataset: whole, the same bytes again, on the splits that nothing is tuned on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import load, load_observation
from sim.dataset.generate import store_replays
from sim.dataset.replay import Cut
from sim.dataset.splits import is_real
from sim.sequence import simulate
from sim.store.validate import validate
from sim.types import Sequence
from tests.fake_simulator import content
from tests.recordings import biwi_walk
from tracking.recordings.biwi import open_folder
from tracking.recordings.source import open_source

SMALL = load_observation(set=["camera.image=[160, 120]", "camera.fps=5"])


@pytest.fixture
def walk(tmp_path: Path) -> Sequence:
    return open_folder(biwi_walk(tmp_path / "walk"))


def test_a_dataset_like_any_other(walk: Sequence, tmp_path: Path) -> None:
    told, where = [], (SMALL, range(20_000, 20_002), tmp_path / "a")
    made = store_replays([walk], *where, cut=Cut(1.0, 2.0), progress=lambda *words: told.append(words))
    assert [p.name for p in made] == ["walk-t1-s20000", "walk-t1-s20001"]
    assert told[-1] == (2, 2, "walk-t1-s20001")
    assert validate(tmp_path / "a") == []
    manifest = json.loads((made[0] / "manifest.json").read_text())
    assert manifest["origin"]["real"] is True
    assert manifest["origin"]["name"] == "walk"
    assert str(tmp_path) not in (made[0] / "manifest.json").read_text() + (made[0] / "scenario.toml").read_text()
    stored = open_source(tmp_path / "a")[0]
    assert is_real(stored)
    assert stored.truth.labelled.all()
    assert next(iter(stored)).image is not None


def test_same_bytes_again_and_what_is_there_is_kept(walk: Sequence, tmp_path: Path) -> None:
    how = {"cut": Cut(0.0, 1.0), "streams": ("left", "ids")}
    (first,) = store_replays([walk], SMALL, range(20_000, 20_001), tmp_path / "a", **how)
    (second,) = store_replays([walk], SMALL, range(20_000, 20_001), tmp_path / "b", **how)
    assert content(first) == content(second)
    stamp = (first / "manifest.json").stat().st_mtime_ns
    store_replays([walk], SMALL, range(20_000, 20_001), tmp_path / "a", **how)
    assert (first / "manifest.json").stat().st_mtime_ns == stamp
    (first / "gt" / "gt.txt").write_text("")
    store_replays([walk], SMALL, range(20_000, 20_001), tmp_path / "a", **how)
    assert content(first) == content(second)


def test_real_motion_stays_out_of_what_is_tuned_on(walk: Sequence, tmp_path: Path) -> None:
    for first in (0, 10_000):
        with pytest.raises(InputError, match="20000"):
            store_replays([walk], SMALL, range(first, first + 1), tmp_path, streams=())
    own = simulate(load("merge", set=["duration=2.0", "event=[]"]), 3, streams=())
    (made,) = store_replays([own], SMALL, range(1), tmp_path, streams=())
    assert made.parent.name == "flockscope-train"
    assert not is_real(open_source(made)[0])
    with pytest.raises(InputError, match="unique names"):
        store_replays([walk, walk], SMALL, range(20_000, 20_001), tmp_path, streams=())
