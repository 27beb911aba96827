"""Pairs of rows: those of the plain tables of every frame, whatever is missing, far away or not a number."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference_trackeval import box_similarity
from tracking.scoring import similarity as module
from tracking.scoring.rows import FrameRows, RowLookup
from tracking.scoring.similarity import Pairs, box_pairs, point_pairs


def random_rows(r: np.random.Generator, frames: int = 12, most: int = 9) -> FrameRows:
    counts = r.integers(0, most, frames)
    frame = np.repeat(np.arange(1, frames + 1), counts)
    return FrameRows(frame, np.concatenate([np.zeros(0, int), *(r.permutation(20)[:n] for n in counts)]))


def places(r: np.random.Generator, rows: FrameRows, broken: bool) -> np.ndarray:
    pos = r.uniform(-5, 5, (len(rows), 2))
    if broken:
        pos[r.random(len(rows)) < 0.2, r.integers(2)] = np.nan
        pos[r.random(len(rows)) < 0.05] = np.inf
        pos[r.random(len(rows)) < 0.05] *= 1e9
    return pos


def boxes(r: np.random.Generator, rows: FrameRows, broken: bool) -> np.ndarray:
    box = np.column_stack([r.uniform(-50, 300, (len(rows), 2)), r.uniform(1, 120, (len(rows), 2))])
    if broken:
        box[r.random(len(rows)) < 0.2, r.integers(4)] = np.nan
        box[r.random(len(rows)) < 0.1, 2] = 0
        box[r.random(len(rows)) < 0.05, 2] = np.inf
    return box


def as_dict(pairs: Pairs) -> dict[tuple[int, int], float]:
    assert (np.diff(pairs.i) >= 0).all()
    return dict(zip(zip(pairs.i.tolist(), pairs.j.tolist(), strict=True), pairs.s.tolist(), strict=True))


def expected(true: FrameRows, est: FrameRows, table: np.ndarray) -> dict[tuple[int, int], float]:
    """table (R, S): the similarity of all rows."""
    same = true.frame[:, None] == est.frame[None]
    return {(i, j): table[i, j] for i, j in np.argwhere(same & (table > 1e-15)).tolist()}


@pytest.mark.parametrize("broken", [False, True])
@pytest.mark.parametrize("seed", range(5))
def test_places_and_boxes_of_every_frame(seed: int, broken: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "CHUNK", 7)  # many portions
    r = np.random.default_rng(seed)
    true, est = random_rows(r), random_rows(r)
    a, b = places(r, true, broken), places(r, est, broken)
    with np.errstate(invalid="ignore"):
        distance = np.linalg.norm(a[:, None] - b[None], axis=2)
    near = point_pairs(true, est, a, b, 2.0)
    assert as_dict(near) == pytest.approx(expected(true, est, np.nan_to_num(1 - distance / 2)), abs=1e-12)
    a, b = boxes(r, true, broken), boxes(r, est, broken)
    with np.errstate(invalid="ignore"):
        overlap = np.nan_to_num(box_similarity(a, b))
    assert as_dict(box_pairs(true, est, a, b)) == pytest.approx(expected(true, est, overlap), abs=1e-12)


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
                assert lookup.nearest(who, at, reach, 0) == best(rows, some, who, at - frame, reach)
                assert lookup.nearest(who, at, 0, reach) == best(rows, some, who, frame - at, reach)
                assert lookup.nearest(who, at, reach, reach) == best(rows, some, who, np.abs(frame - at), reach)


def test_of_two_as_near_the_earlier():
    assert RowLookup(FrameRows(np.array([3, 7]), np.array([1, 1]))).nearest(1, 5, 2, 2) == 0


def test_nobody_has_no_rows():
    lookup = RowLookup(FrameRows(np.zeros(0, int), np.zeros(0, int)))
    assert lookup.nearest(1, 5, 9, 9) == -1
