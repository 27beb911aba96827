"""Scores of simulated detections: beside those of a real detector, and with the draws of boxes as they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenarios import load
from scenarios.schema.sensor import Sensor
from sim.detector.draws import false_scores, true_scores
from sim.sequence import simulate
from tracking.fitting.detection_matching import match_sequence
from tracking.recordings.source import open_source

U = np.linspace(0.1, 0.9, 9)
CUT = 0.5  # the detector of both recordings reports no score below


@pytest.mark.filterwarnings("ignore:MOTChallenge data without")
def test_default_scores_are_as_those_of_a_real_detector(shared_data: Path) -> None:
    pets, campus = (
        match_sequence(open_source(shared_data / "mot" / name, images=False)[0])
        for name in ("PETS09-S2L1-first200", "TUD-Campus")
    )
    score = np.concatenate([m.score[m.match[m.hit]] for m in (pets, campus)])
    visibility = np.concatenate([m.truth.visibility[m.hit] for m in (pets, campus)])
    clear = visibility >= 0.9
    assert true_scores(U, np.ones(9), Sensor()) == pytest.approx(np.quantile(score[clear], U), abs=0.04)
    half = score[(visibility > 0.2) & (visibility < 0.5)].mean() / score[clear].mean()
    assert float(np.mean(true_scores(U, np.full(9, 0.35), Sensor()))) == pytest.approx(half * 0.98, abs=0.08)
    drawn = false_scores(np.linspace(0.0, 1.0, 1001), Sensor())
    measured = np.quantile(campus.score[campus.false], U)
    assert np.quantile(drawn[drawn >= CUT], U) == pytest.approx(measured, abs=0.1)


def test_true_boxes_pass_the_usual_thresholds_of_trackers() -> None:
    # OC-SORT and ByteTrack take new people from detections above 0.7 in roboflow's `trackers`
    found = match_sequence(simulate(load("street"), 30_000, streams=()))
    true = found.score[found.match[found.hit]]
    assert (true > 0.7).mean() > 0.9
    assert (true > 0.8).mean() > 0.8
    assert found.score[found.false].mean() < 0.6


def test_scores_of_detections_change_nothing_else() -> None:
    scenario = load("cross")
    other = Sensor(**scenario.sensor.model_dump() | {"true_scores": (0.0, 0.5), "false_scores": (0.5, 1.0)})
    made = [
        [f.detections for f in simulate(s, 30_000, streams=()).without_pictures()]
        for s in (scenario, scenario.model_copy(update={"sensor": other}))
    ]
    for a, b in zip(*made, strict=True):
        assert np.array_equal(a.box, b.box)
        assert np.array_equal(a.pos, b.pos)
    assert any(not np.array_equal(a.score, b.score) for a, b in zip(*made, strict=True))
