"""A scene whose script does not come true is left out, named and counted; many of them are a failure."""

from __future__ import annotations

import pytest

from scenarios.errors import OrderError, WorkError
from sim.dataset import generate as sequence_job
from sim.dataset.generate import generate
from tests.tuning_toys import toy_plan
from tracking.tuning.candidates import HeldOutEvaluator

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


def test_a_search_counts_its_scenes(tmp_path):
    plan = toy_plan(tmp_path, seeds=range(20))
    scenes = HeldOutEvaluator(plan, None, None)
    scenes.count(plan.training, ["", "no merge", *[""] * 18])
    scenes.require_most()
    assert list(scenes.left_out.values()) == ["one seed 1: no merge"]
    few = HeldOutEvaluator(plan, None, None)
    few.count(plan.training[:1], ["no merge"])
    with pytest.raises(WorkError, match="1 of 1 scenes"):
        few.require_most()
