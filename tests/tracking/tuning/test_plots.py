"""Pictures of a search: well-formed, every trial where it belongs, round numbers beside them."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import pytest

from tests.toy_tracker import ToyConfig
from tests.tuning_toys import toy_plan
from tracking.tuning.comparison import Candidate, TrialRecord
from tracking.tuning.result import TuningResult

SVG = "{http://www.w3.org/2000/svg}"
DEFAULTS = {"reach": 0.1, "skip": 0, "colour": "red", "forbidden": 0.0}


@pytest.fixture
def found(tmp_path) -> TuningResult:
    made = toy_plan(tmp_path)
    values = [0.5, 0.4, 0.6, -9.0, 0.55, 0.7]
    trials = [TrialRecord(k, (v,), DEFAULTS if k == 0 else {"reach": v}, 5, pruned=v < 0) for k, v in enumerate(values)]
    trials.append(TrialRecord(6, (), {"reach": 1.0}, 0, error="no"))
    importance = {"reach": 0.7, "skip": 0.3, "colour": 0.0, "forbidden": 0.0}
    candidate = Candidate(5, ToyConfig(reach=1.0), (0.7,), (0.65,))
    return TuningResult(
        made, ToyConfig(reach=1.0), (), (candidate,), tuple(trials), importance, validation=((0.5,), (0.65,))
    )


def dots(text: str, radius: str = "3.5") -> list[tuple[float, float, str]]:
    """Of the picture itself: those of the key stand above it."""
    found = [c.attrib for c in ElementTree.fromstring(text).iter(f"{SVG}circle") if c.attrib["r"] == radius]
    return [(float(a["cx"]), float(a["cy"]), a["fill"]) for a in found if float(a["cy"]) > 50]


def test_history_shows_what_was_played(found):
    """Six trials; one far below is a tick at the edge, as it would flatten the rest."""
    text = found.plots()[".history.svg"]
    shown = dots(text)
    assert len(shown) == 5
    assert "1 far below: ticks" in text
    assert text.count("v8") == 1
    heights = [y for _, y, _ in shown]
    assert sorted(range(5), key=lambda k: -heights[k]) == [1, 0, 3, 2, 4], "higher is further up"
    assert [x for x, _, _ in shown] == sorted(x for x, _, _ in shown)
    steps = ElementTree.fromstring(text).find(f"{SVG}polyline").attrib["points"].split()
    assert [float(p.split(",")[1]) for p in steps][-1] == min(heights)


def test_trials_given_up_are_hollow(found):
    near = tuple(replace(t, values=(0.45,)) if t.pruned else t for t in found.trials)
    shown = dots(replace(found, trials=near).plots()[".history.svg"])
    assert [fill for _, _, fill in shown].count("#fff") == 1
