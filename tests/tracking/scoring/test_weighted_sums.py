"""Weighted sums over frames: linear in the weights, and exact where a total is stated."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.scoring.weighted_sums import FrameSums


def test_a_stated_total_stands_at_weights_of_one_and_changes_with_them() -> None:
    sums = FrameSums(3)
    frame, values = np.array([1, 2, 2]), np.array([0.1, 0.2, 0.3])
    sums.add("plain", frame, values)
    sums.add("number", frame)
    sums.add("exact", frame, values, 0.6)
    found = sums.of(np.array([[1.0, 1.0, 1.0], [1.0, 2.0, 0.0], [0.0, 0.0, 0.5]]))
    assert found["exact"][0] == 0.6 != 0.1 + 0.2 + 0.3
    for name in ("plain", "exact"):
        assert found[name] == pytest.approx([0.6, 0.2, 0.25])
    assert found["number"].tolist() == [3, 2, 1]
