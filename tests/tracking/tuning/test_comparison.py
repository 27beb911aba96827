"""The line of a comparison of two configs."""

from __future__ import annotations

import pytest

from tracking.tuning.comparison import Comparison


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [(0.05, 0.15, "+0.1000 [+0.0500, +0.1500]"), (float("nan"), float("nan"), "+0.1000 (no interval)")],
)
def test_an_unknown_interval_is_not_printed(low: float, high: float, said: str) -> None:
    line = Comparison("merge", "HOTA", True, 0.5, 0.6, 0.1, low, high, 1 + (low == low)).line()
    assert said in line
    assert "nan" not in line
