"""When groups merge: a moment in which one of them cannot merge does not restart the time that they must be near."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracking.papers.group_pda.test_association_kernels import bank
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.merging import GroupMerging
from tracking.papers.group_pda.scaled_parameters import scale_parameters

FPS = 10.0


@pytest.mark.parametrize("why", ["unmeasured", "infeasible", "no own people"])
def test_a_moment_without_velocity_does_not_restart_the_time_to_merge(why: str) -> None:
    scaled, when = scale_parameters(GroupPdaConfig(merge_time=0.8), FPS, 1.0), []
    for pause in (range(0), range(4, 6)):
        merging, two = GroupMerging(), bank(size=np.ones(2), extent=np.tile(0.1 * np.eye(2), (2, 1, 1)))
        for k in range(30):
            here = k not in pause
            two.last_seen[:] = k / FPS if here or why != "unmeasured" else [k / FPS, (k - 1) / FPS]
            two.null_time[:] = [0.0, 0.1 * (not here and why == "infeasible")]
            two.own_people[:] = [1.0, 1.0 * (here or why != "no own people")]
            if list(merging.step(two, scaled, k / FPS)):
                when.append(k)
                break
    assert when == [8, 8]
