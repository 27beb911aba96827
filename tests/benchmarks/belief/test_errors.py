"""Errors of positions have the stated size, memory and direction; labels stay with the people."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.belief.errors import Errors, each_second, missed, of_rows, switched, with_errors
from tests import hand_made


def walk(frames: int, apart: float = 1.0):
    """Two people in one group side by side, 10 frames/s, 1 m/s along x."""
    scenes = [hand_made.Scene({1: (0.1 * k, 0.0), 2: (0.1 * k, apart)}, {7: ([1, 2], None)}) for k in range(frames)]
    return hand_made.truth(scenes)


def lagged(x: np.ndarray, lag: int) -> float:
    return float(np.corrcoef(x[:-lag], x[lag:])[0, 1])


@pytest.mark.parametrize(("time", "lag", "expected"), [(1.0, 10, np.exp(-1)), (3.0, 10, np.exp(-1 / 3)), (0.0, 1, 0.0)])
def test_errors_are_correlated_over_their_time(time, lag, expected):
    true = walk(20_000)
    error = (with_errors(true, Errors(0.1, 0.3, time), 1).pos - true.pos)[true.id == 1]
    assert error.std(axis=0) == pytest.approx([0.1, 0.3], rel=0.12)
    assert lagged(error[:, 0], lag) == pytest.approx(expected, abs=0.07)


def test_the_first_error_is_as_large_as_the_others():
    true = walk(1)
    first = [(with_errors(true, Errors(0.0, 0.3, 10.0), seed).pos - true.pos)[:, 1] for seed in range(400)]
    assert np.std(first) == pytest.approx(0.3, rel=0.1)


def test_the_line_of_sight_turns():
    true = walk(5_000)
    along = with_errors(true, Errors(0.0, 0.6), 0).pos - true.pos
    turned = with_errors(true, Errors(0.0, 0.6, turn_deg=90.0), 0).pos - true.pos
    diagonal = with_errors(true, Errors(0.0, 0.6, turn_deg=45.0), 0).pos - true.pos
    assert np.abs(along[:, 0]).max() == 0
    assert turned == pytest.approx(np.column_stack([-along[:, 1], along[:, 0]]))
    assert np.abs(diagonal.sum(axis=1)).max() == pytest.approx(0, abs=1e-12)


def test_no_errors_change_no_place():
    true = walk(20)
    erring = with_errors(true, Errors(0.0, 0.0), 0)
    assert np.array_equal(erring.pos, true.pos)
    assert erring.vel is None


def test_a_share_of_the_rows_is_missed():
    true = walk(2_000)
    assert len(missed(true, 0.3, 0).id) / len(true.id) == pytest.approx(0.7, abs=0.03)


def test_ids_switch_and_labels_stay():
    true = walk(300)
    true = true.replace(group=np.where(true.id == 1, 5, -1))
    other = switched(true, 2.0, 0)
    assert np.array_equal(np.lexsort((other.id, other.frame)), np.arange(len(true.id)))
    assert (np.bincount(other.frame * 3 + other.id) <= 1).all()  # nobody is twice in a frame
    assert 0 < (other.id[other.pos[:, 1] == 0] == 2).mean() < 1  # who walks at y = 0 has the other's id for a while
    assert np.array_equal(other.group >= 0, other.pos[:, 1] == 0)


def test_people_far_apart_keep_their_ids():
    true = walk(300, apart=2.5)
    assert np.array_equal(switched(true, 0.2, 0).pos, true.pos)


def test_one_frame_a_second():
    true = walk(26).replace(fps=2.5)  # 0.25 m/s
    slow = each_second(of_rows(true, ~((true.frame == 4) & (true.id == 2))))
    assert (slow.fps, slow.length) == (1.0, 11)
    assert slow.pos[slow.id == 1, 0] == pytest.approx(0.25 * np.arange(11))
    # person 2 is missing in the frame at 1.2 s, between whose neighbours 1 s lies
    assert slow.frame[slow.id == 2].tolist() == [1, *range(3, 12)]
