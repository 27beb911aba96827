"""Links of pairs whose people come and go at other times than the others."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.grouping.link_rule import LinkRule, RuleLinks

FPS, LENGTH = 10.0, 100


@pytest.mark.parametrize("others", [(), ((2, 0, 5),), ((2, 90, 100),), ((2, 0, 5), (3, 95, 100))])
def test_a_pair_is_linked_and_parted_whatever_others_do(others) -> None:
    """People 0 and 1 are near from frame 20 to 59; the others, far away, are seen in these frames (first, end)."""
    rows = [(0, k, 0.0, 0.0) for k in range(LENGTH)]
    rows += [(1, k, 1.0 if 20 <= k < 60 else 9.0, 0.0) for k in range(10, 90)]
    rows += [(who, k, 50.0 + 9 * who, 0.0) for who, first, end in others for k in range(first, end)]
    column, frame, x, y = np.array(sorted(rows, key=lambda row: (row[1], row[0]))).T
    pos = np.stack([x, y], axis=1)
    finder = RuleLinks(FPS, LinkRule())
    finder.take_people(np.full(int(column.max()) + 1, -1))
    links = finder.add(frame.astype(int), column.astype(int), pos, np.zeros_like(pos), LENGTH)
    found = list(zip(links.frame.tolist(), links.a.tolist(), links.b.tolist(), links.on.tolist(), strict=True))
    # near in 16 of the 20 frames of the window; apart for 20 frames
    assert found == [(35, 0, 1, True), (79, 0, 1, False)]
