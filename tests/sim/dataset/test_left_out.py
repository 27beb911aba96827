"""A scene whose script does not come true is left out, named and counted; many of them are a failure."""

from __future__ import annotations

import pytest

from scenarios.errors import OrderError, WorkError
from sim.dataset import generate as sequence_job
from sim.dataset.generate import generate
from tracking.tuning.search import PlayedScenes, _unfulfilled

store = sequence_job.simulate_and_store


def failing(*seeds: int):
    def make(job):
        if job.seed in seeds:
            raise OrderError(
                file="s", place="event m1", got="a merge that never fired", expected="one", remedy="mend it"
            )
        store(job)

    return make


def test_one_of_twenty_is_left_out_and_named(tmp_path, monkeypatch, simulate):
    monkeypatch.setattr(sequence_job, "simulate_and_store", failing(3))
    made = generate(["cross"], range(20), tmp_path, streams=())
    assert len(made) == 19
    assert {name: error.got for name, error in made.left_out.items()} == {"cross-s00003": "a merge that never fired"}
    assert "cross-s00003" not in (tmp_path / "seqmaps/flockscope-train.txt").read_text()


def test_more_than_five_per_cent_are_a_failure(tmp_path, monkeypatch, simulate):
    monkeypatch.setattr(sequence_job, "simulate_and_store", failing(0, 1))
    with pytest.raises(WorkError, match=r"never fired \(and 1 more of 20"):
        generate(["cross"], range(20), tmp_path, streams=())
    with pytest.raises(WorkError, match="never fired"):
        generate(["cross"], range(1), tmp_path / "one", streams=())


def test_a_search_counts_its_scenes():
    class Scene:
        def __init__(self, seed):
            self.name, self.seed, self.key = "cross", seed, seed

        def open(self):
            if self.seed == 7:
                raise OrderError(place="event m1", got="no merge", expected="one", remedy="mend it")
            return self

        truth = None

    scenes = PlayedScenes(lambda *_: iter(()))
    for seed in range(20):
        scenes.record(one := Scene(seed), _unfulfilled(one))
    scenes.require_most()
    assert [line.split(":")[0] for line in scenes.left_out.values()] == ["cross seed 7"]
    few = PlayedScenes(lambda *_: iter(()))
    few.record(Scene(7), _unfulfilled(Scene(7)))
    with pytest.raises(WorkError, match="1 of 1 scenes"):
        few.require_most()
