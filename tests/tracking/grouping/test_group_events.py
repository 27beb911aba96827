"""When two people parted or came together: gaps and short stretches."""

from __future__ import annotations

import numpy as np
import pytest

from sim.truth.motion_rows import MotionRows
from tracking.grouping.group_events import TrackedMotion

FPS = 10.0


def motion(distances: list[tuple[float, int]]) -> TrackedMotion:
    """Two people with these distances, m, for these numbers of frames, at rest."""
    apart = np.concatenate([np.full(frames, distance) for distance, frames in distances])
    pos = np.zeros((len(apart), 2, 2))
    pos[:, 1, 0] = apart
    shape = pos.shape[:2]
    return TrackedMotion(MotionRows.of_table(pos, np.zeros_like(pos), np.ones(shape, bool), np.full(shape, -1)), FPS)


@pytest.mark.parametrize(("gap", "onset"), [(4, 30), (5, 30), (6, 51), (8, 53)])
def test_a_gap_of_half_a_second_does_not_end_a_stretch(gap: int, onset: int) -> None:
    """People who parted in frame 30 are beside each other for `gap` frames after 1.5 s."""
    made = motion([(1.0, 30), (3.0, 15), (1.0, gap), (3.0, 12)])
    a, b = frozenset({0}), frozenset({1})
    assert made.onset(a, b, 56 + gap, joins=False) == onset
