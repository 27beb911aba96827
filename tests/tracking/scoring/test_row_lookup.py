"""Rows by id and time: the same as asking every row."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.scoring.row_lookup import Lives
from tracking.scoring.similarity import Rows


def best(rows, only, id, away, reach):
    """The row of this id with the least `away` (R,), which is at most reach and not below 0; -1 if there is none."""
    found = np.flatnonzero(only & (rows.id == id) & (away >= 0) & (away <= reach))
    return int(found[away[found].argmin()]) if len(found) else -1


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("reach", [0, 3, 100])
def test_lives_are_the_slow_way(seed, reach):
    r = np.random.default_rng(seed)
    frame, id = np.nonzero(r.random((30, 6)) < 0.4)
    rows, only = Rows(frame, 7 * id - 7), r.random(len(frame)) < 0.7
    every = np.ones(len(frame), bool)
    for lives, some in ((Lives(rows), every), (Lives(rows, only), only)):
        for who in (-7, 0, 14, 28, 3, 99):
            for at in (-3, 0, 11, 12, 13, 29, 40):
                assert lives.last(who, at, reach) == best(rows, some, who, at - frame, reach)
                assert lives.next(who, at, reach) == best(rows, some, who, frame - at, reach)
                assert lives.nearest(who, at, reach) == best(rows, some, who, np.abs(frame - at), reach)


def test_of_two_as_near_the_earlier():
    assert Lives(Rows(np.array([3, 7]), np.array([1, 1]))).nearest(1, 5, 2) == 0


def test_nobody_has_no_rows():
    lives = Lives(Rows(np.zeros(0, int), np.zeros(0, int)))
    assert (lives.last(1, 5, 9), lives.next(1, 5, 9), lives.nearest(1, 5, 9)) == (-1, -1, -1)
