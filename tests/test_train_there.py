"""The average precision of found boxes, on hand-made boxes."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.train_there import average_precision

ONE, TWO, FAR = [10.0, 10, 10, 30], [40.0, 10, 10, 30], [80.0, 10, 10, 30]
TRUTH, NONE = [np.array([ONE, TWO]), np.zeros((0, 4))], [np.zeros((0, 4))] * 2


@pytest.mark.parametrize(
    ("rows", "ignored", "expected"),
    [
        ([], NONE, 0.0),
        ([[0, *ONE, 0.9], [0, *TWO, 0.8]], NONE, 1.0),
        ([[0, *TWO, 0.8], [0, *ONE, 0.9]], NONE, 1.0),  # the order of the rows is of no account
        ([[0, *ONE, 0.9]], NONE, 51 / 101),  # precision 1 at the recalls 0 to 0.5
        ([[0, *ONE, 0.9], [0, *ONE, 0.8], [0, *TWO, 0.7]], NONE, (51 + 50 * 2 / 3) / 101),  # a person found twice
        ([[1, *ONE, 0.9], [0, *ONE, 0.8], [0, *TWO, 0.7]], NONE, 2 / 3),  # in a picture without people
        ([[0, *FAR, 0.9], [0, *ONE, 0.8], [0, *TWO, 0.7]], [np.array([FAR]), NONE[1]], 1.0),
        ([[0, *FAR, 0.9], [0, *ONE, 0.8], [0, *TWO, 0.7]], [np.array([[86.0, 10, 10, 30]]), NONE[1]], 2 / 3),
        ([[0, 10, 10, 10, 14, 0.9], [0, *TWO, 0.8]], NONE, 0.5 * 51 / 101),  # overlaps by less than a half
        ([[0, 10, 10, 10, 16, 0.9], [0, *TWO, 0.8]], NONE, 1.0),
    ],
)
def test_average_precision(rows: list[list[float]], ignored: list[np.ndarray], expected: float) -> None:
    found = np.reshape(np.array(rows, float), (-1, 6))
    assert average_precision(TRUTH, ignored, found) == pytest.approx(expected)
