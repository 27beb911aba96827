"""Ids that stand twice in a frame."""

import numpy as np

from sim.arrays import repeated_ids


def test_ids_twice_in_a_frame():
    frame, id = np.array([2, 1, 2, 1, 2, 3, 2]), np.array([5, 5, 4, 6, 5, 5, 5])
    assert repeated_ids(frame, id).tolist() == [False, False, False, False, True, False, True]
    assert repeated_ids(frame[:0], id[:0]).tolist() == []


def test_against_pairs_one_by_one():
    draws = np.random.default_rng(0)
    for _ in range(50):
        frame, id = draws.integers(0, 4, (2, 12))
        pairs = list(zip(frame.tolist(), id.tolist(), strict=True))
        assert repeated_ids(frame, id).tolist() == [pair in pairs[:k] for k, pair in enumerate(pairs)]
