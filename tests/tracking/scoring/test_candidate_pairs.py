"""Pairs of rows: those of the plain tables of every frame, whatever is missing, far away or not a number."""

from __future__ import annotations

import numpy as np
import pytest

from tests.matrix_pairs import matrix_pairs
from tests.reference_trackeval import box_similarity
from tracking.scoring import candidate_pairs as module
from tracking.scoring.candidate_pairs import Pairs, box_pairs, point_pairs
from tracking.scoring.rows import FrameRows, numbered


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
@pytest.mark.parametrize("seed", range(15))
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


@pytest.mark.parametrize("spread", [0.0, 0.3])
def test_frames_stay_apart_where_all_stand_close(spread: float) -> None:
    r = np.random.default_rng(0)
    true, est = random_rows(r), random_rows(r)
    a, b = (spread * places(r, rows, False) for rows in (true, est))
    near = np.maximum(0, 1 - np.linalg.norm(a[:, None] - b[None], axis=2) / 9)
    assert as_dict(point_pairs(true, est, a, b, 9.0)) == pytest.approx(expected(true, est, near), abs=1e-12)


def test_overlap_of_two_boxes() -> None:
    one = FrameRows(np.array([1]), np.array([1]))
    found = box_pairs(one, one, np.array([[0.0, 0, 4, 2]]), np.array([[2.0, 0, 4, 2]]))
    assert found.s == pytest.approx([4 / 12])


@pytest.mark.parametrize("seed", range(5))
def test_part_of_the_frames(seed: int) -> None:
    r = np.random.default_rng(seed)
    true, est = random_rows(r), random_rows(r)
    a, b = places(r, true, False), places(r, est, False)
    whole = point_pairs(true, est, a, b, 4.0)
    mask = r.random(13) < 0.5
    for kept in (mask, np.arange(13) <= 6):
        part, i, j = whole.in_frames(kept), kept[true.frame], kept[est.frame]
        alone = point_pairs(true.keep(i), est.keep(j), a[i], b[j], 4.0)
        assert as_dict(part) == as_dict(alone)
        assert part.true.id.tolist() == alone.true.id.tolist()
        assert part.est.frame.tolist() == alone.est.frame.tolist()


def test_tables_of_each_frame() -> None:
    pairs = matrix_pairs(
        [[5], [], [6, 7]], [[1, 2], [3], [4]], [np.array([[0.0, 0.5]]), np.zeros((0, 1)), [[0.25], [1]]]
    )
    assert as_dict(pairs) == {(0, 1): 0.5, (1, 3): 0.25, (2, 3): 1.0}
    assert pairs.frame.tolist() == [0, 2, 2]
    assert pairs.true.id.tolist() == [5, 6, 7]


def test_links_are_pairs_of_identities() -> None:
    pairs = matrix_pairs([[5, 9], [9, 5]], [[8, 3], [3]], [np.ones((2, 2)), np.ones((2, 1))])
    true_id, est_id, which = pairs.links
    seen = [(int(pairs.true_ids[0][true_id[k]]), int(pairs.est_ids[0][est_id[k]])) for k in which.tolist()]
    assert seen == [(5, 8), (5, 3), (9, 8), (9, 3), (9, 3), (5, 3)]
    assert len(true_id) == 4


@pytest.mark.parametrize("values", [[], [7], [-3, 7, -3], [10**15, 0, 10**15, 5], list(range(50, 0, -1))])
def test_numbered_as_unique(values: list[int]) -> None:
    distinct, place = numbered(np.array(values, np.int64))
    assert (distinct.tolist(), place.tolist()) == (sorted(set(values)), [sorted(set(values)).index(v) for v in values])
