"""Plots of a search: well-formed, the same bytes again, every trial and candidate is drawn."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest

from tests.toy_tracker import ToyConfig
from tests.tuning_toys import toy_plan
from tracking.tuning.candidates import Candidate, TrialRecord
from tracking.tuning.result import TuningResult

DEFAULTS = {"reach": 0.1, "skip": 0, "colour": "red", "forbidden": 0.0}


@pytest.fixture
def found(tmp_path) -> TuningResult:
    made = toy_plan(tmp_path)
    values = [0.5, 0.4, 0.6, -9.0, 0.55, 0.7]
    trials = [TrialRecord(k, (v,), DEFAULTS if k == 0 else {"reach": v}) for k, v in enumerate(values)]
    trials.append(TrialRecord(6, (), {"reach": 1.0}, "no"))
    importance = {"reach": 0.7, "skip": 0.3, "colour": 0.0, "forbidden": 0.0}
    candidate = Candidate(5, ToyConfig(reach=1.0), (0.7,), (0.65,))
    return TuningResult(
        made, ToyConfig(reach=1.0), (), (candidate,), tuple(trials), importance, validation=((0.5,), (0.65,))
    )


def words(svg: str) -> list[str]:
    return ["".join(e.itertext()) for e in ElementTree.fromstring(svg).iter() if e.tag.endswith("}text")]


def test_plots_repeat_to_the_byte(found):
    assert found.plots() == found.plots()


def test_history_marks_a_trial_that_loses_by_far(found):
    shown = words(found.plots()[".history.svg"])
    assert {"trials", "best so far", "defaults", "far worse"} <= set(shown)
    near = tuple(replace(t, values=(0.45,)) if t.values == (-9.0,) else t for t in found.trials)
    assert "far worse" not in words(replace(found, trials=near).plots()[".history.svg"])
