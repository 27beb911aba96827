"""How long groups last as they are."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief.lives import lives, lives_of_tracks, lives_of_truth
from tests import hand_made

TWO, THREE = {7: ([1, 2], None)}, {7: ([1, 2, 3], None)}


def rows(*groups):
    """Frame, id, group and length of people 1, 2, 3 whose groups are given by frame; None: missed."""
    every = [(f, p, g) for f, of in enumerate(groups, 1) for p, g in enumerate(of, 1) if g is not None]
    return *np.array(every, np.int64).T, len(groups)


def test_a_stretch_ends_when_somebody_joins():
    scenes = [hand_made.Scene(dict.fromkeys((1, 2, 3), (0.0, 0.0)), g) for g in [TWO] * 30 + [THREE] * 10 + [{}] * 5]
    assert lives_of_truth(hand_made.truth(scenes)).tolist() == [3.0, 1.0]
    assert lives_of_tracks(hand_made.tracks(scenes), hand_made.FPS).tolist() == [3.0, 1.0]


def test_another_number_of_the_group_does_not_matter():
    assert lives(*rows(*[(1, 1, -1)] * 3, *[(2, 2, -1)] * 3), 10.0).tolist() == [pytest.approx(0.6)]


@pytest.mark.parametrize(("missed", "expected"), [(10, [4.0]), (11, [1.0, 1.9])])
def test_who_is_missed_for_a_second_stays(missed, expected):
    found = lives(*rows(*[(1, 1, -1)] * 10, *[(1, None, -1)] * missed, *[(1, 1, -1)] * (30 - missed)), 10.0)
    assert found.tolist() == pytest.approx(expected)


def test_people_alone_have_no_group():
    assert len(lives(*rows((1, -1, 2), (-1, -1, -1)), 10.0)) == 0
