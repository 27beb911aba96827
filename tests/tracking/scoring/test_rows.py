"""Rows by id and time: the same as a search through every row."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.scoring.rows import FrameRows, RowLookup


def best(rows, only, id, away, reach):
    """The row of this id with the least `away` (R,), which is at most reach and not below 0; -1 if there is none."""
    found = np.flatnonzero(only & (rows.id == id) & (away >= 0) & (away <= reach))
    return int(found[away[found].argmin()]) if len(found) else -1


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("reach", [0, 3, 100])
def test_lookup_is_the_slow_way(seed, reach):
    r = np.random.default_rng(seed)
    frame, id = np.nonzero(r.random((30, 6)) < 0.4)
    rows, only = FrameRows(frame, 7 * id - 7), r.random(len(frame)) < 0.7
    every = np.ones(len(frame), bool)
    for lookup, some in ((RowLookup(rows), every), (RowLookup(rows, only), only)):
        for who in (-7, 0, 14, 28, 3, 99):
            for at in (-3, 0, 11, 12, 13, 29, 40):
                assert lookup.last(who, at, reach) == best(rows, some, who, at - frame, reach)
                assert lookup.next(who, at, reach) == best(rows, some, who, frame - at, reach)
                assert lookup.nearest(who, at, reach) == best(rows, some, who, np.abs(frame - at), reach)


def test_of_two_as_near_the_earlier():
    assert RowLookup(FrameRows(np.array([3, 7]), np.array([1, 1]))).nearest(1, 5, 2) == 0


def test_nobody_has_no_rows():
    lookup = RowLookup(FrameRows(np.zeros(0, int), np.zeros(0, int)))
    assert (lookup.last(1, 5, 9), lookup.next(1, 5, 9), lookup.nearest(1, 5, 9)) == (-1, -1, -1)
