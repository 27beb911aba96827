"""Calibration error of probabilities of pairs."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief import calibration_by_input as calibration
from tests import hand_made
from tracking.grouping.known_people import people_as_tracks
from tracking.grouping.pair_beliefs import PairProbabilities


def test_a_calibrated_belief_has_no_error():
    true = np.arange(1000) < 700
    error, mean, mates, sure, found = calibration.cells(np.full(1000, 0.7), true, np.ones(1000))
    assert (error, mean, mates, sure, found) == ("0.000", "0.700", "0.700", "0.0%", "–")


def test_the_error_is_that_of_the_weighed_rows():
    probability, true = np.array([1.0, 1.0, 0.0, 0.0]), np.array([True, False, False, False])
    error, _, _, sure, found = calibration.cells(probability, true, np.array([1.0, 3.0, 2.0, 2.0]))
    assert error == "0.375"
    assert sure == "50.0%"
    assert found == "0.250"


def test_mates_are_those_of_the_frame(monkeypatch):
    together = {7: ([1, 2], None)}
    scenes = [hand_made.Scene({1: (0.0, 0.0), 2: (0.0, 1.0), 5: (0.0, 2.0)}, g) for g in ({}, together)]
    one = np.array([1, 2, 2]), np.array([1, 1, 2]), np.array([2, 2, 5]), np.array([0.2, 0.9, 0.1])
    monkeypatch.setattr(calibration, "pair_probabilities", lambda *_: PairProbabilities(*one))
    truth = hand_made.truth(scenes)
    probability, true = calibration.told(truth, people_as_tracks(truth), None)
    assert probability == pytest.approx([0.2, 0.9, 0.1])
    assert true.tolist() == [False, True, False]
