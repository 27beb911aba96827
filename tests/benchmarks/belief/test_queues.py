"""Pairs in queues: what is false, found and missed."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief import queues
from sim.types import GroupEvent
from tests import hand_made

PLACES = {1: (0.0, 0.0), 2: (1.0, 0.0), 3: (2.0, 0.0), 4: (3.0, 0.0)}


def line():
    """Four people for 10 frames, 1 and 2 together, 3 and 4 too; 1, 2, 3 queue in the frames 4 to 6."""
    scenes = [hand_made.Scene(PLACES, {1: ([1, 2], None), 2: ([3, 4], None)})] * 10
    return hand_made.truth(scenes, [GroupEvent("queue", 4, 6, None, (), (), (1, 2, 3), (0.0, 0.0))])


def test_people_queue_during_the_event():
    truth = line()
    waits = queues.queueing(truth)
    assert np.unique(truth.frame[waits]).tolist() == [4, 5, 6]
    assert np.unique(truth.id[waits]).tolist() == [1, 2, 3]


def test_scores_of_pairs(monkeypatch):
    truth = line()
    reported = {(1, 2): range(1, 6), (2, 3): range(1, 11)}  # in the frames
    monkeypatch.setattr(queues, "linked_pairs", lambda erring, rule, i, j: np.array([
        erring.frame[a] in reported.get((erring.id[a], erring.id[b]), ()) for a, b in zip(i, j, strict=True)
    ]))  # fmt: skip
    false, precision, recall, found = queues.pair_scores(truth, truth, queues.LinkRule())
    assert false == 10 / 40  # pairs of frames for each person of a frame
    assert precision == 5 / 15
    assert recall == 5 / 20
    assert found == pytest.approx(2 / 3)  # 1 and 2 in the frames 4 and 5 of 4 to 6
