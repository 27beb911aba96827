"""The crowd whose costs are measured."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief import cost
from tests import hand_made


@pytest.mark.parametrize("people", [10, 120])
def test_a_crowd_has_so_many_people(people):
    truth = cost.crowd(people)
    assert len(truth.id) / truth.length == pytest.approx(people, rel=0.25)
    key = truth.frame * 10**6 + truth.id
    assert (np.diff(key) > 0).all()
    # nobody jumps: copies that begin anew are other people
    order = np.lexsort((truth.frame, truth.id))
    same = (np.diff(truth.id[order]) == 0) & (np.diff(truth.frame[order]) == 1)
    assert np.hypot(*np.diff(truth.pos[order], axis=0).T)[same].max() < 0.5


def test_a_step_is_every_fourth_frame():
    slow = cost.each_step(hand_made.truth([hand_made.Scene({1: (float(k), 0.0)}) for k in range(10)]))
    assert (slow.fps, slow.length, slow.frame.tolist()) == (2.5, 3, [1, 2, 3])
    assert slow.pos[:, 0].tolist() == [0, 4, 8]


def test_people_come_and_go_in_the_live_belief():
    here = [{1: (0.0, 0.0), 2: (0.0, 1.0)}, {2: (0.0, 1.0)}, {}, {3: (1.0, 1.0), 2: (0.0, 1.0)}, {3: (1.0, 1.0)}]
    spent = cost.live(hand_made.truth([hand_made.Scene(people) for people in here]))
    assert len(spent) == 5
    assert (spent >= 0).all()
