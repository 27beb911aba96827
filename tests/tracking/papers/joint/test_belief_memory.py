"""The memory of beliefs."""

from __future__ import annotations

import numpy as np

from tracking.grouping.belief import default_belief
from tracking.papers.joint.tracker import remembered


def test_pairs_of_a_group_gain_and_others_lose():
    found = remembered(np.zeros((4, 4)), np.array([3, 3, -1, -1]), np.array([1.0, 1.0, 1.0, 0.0]), 0.5)
    stay, come = default_belief().stay / 2, -default_belief().come / 2
    apart = found[np.triu_indices(4, 1)]
    np.testing.assert_allclose(apart, [stay, come, 0, come, 0, 0])
    assert np.array_equal(found, found.T)
