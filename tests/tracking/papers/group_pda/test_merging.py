"""When groups merge: a moment in which one of them cannot merge does not take the evidence away."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracking.papers.group_pda.test_association_kernels import bank
from tracking.grouping.whole_groups import GroupIds
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import MemberPlaces
from tracking.papers.group_pda.merging_and_splitting import GroupChanges, fall_apart, moment
from tracking.papers.group_pda.scaled_parameters import scale_parameters

FPS = 10.0


@pytest.mark.parametrize("why", ["unmeasured", "infeasible"])
def test_a_moment_without_velocity_does_not_take_the_evidence_away(why: str) -> None:
    scaled, when = scale_parameters(GroupPdaConfig(merge_time=0.8), FPS, 1.0), []
    for pause in (range(0), range(4, 6)):
        changes, two = GroupChanges(), bank(size=np.ones(2), extent=np.tile(0.1 * np.eye(2), (2, 1, 1)))
        for k in range(30):
            here = k not in pause
            two.last_seen[:] = k / FPS if here or why != "unmeasured" else [k / FPS, (k - 1) / FPS]
            two.null_time[:] = [0.0, 0.1 * (not here and why == "infeasible")]
            if list(changes.step(two, scaled, k / FPS)):
                when.append(k)
                break
    assert when == [8, 8]


@pytest.mark.parametrize("seed", range(15))
def test_the_gap_is_the_least_of_all_pairs(seed: int) -> None:
    r = np.random.default_rng(seed)
    scaled = scale_parameters(GroupPdaConfig(), FPS, 40.0, sine_tilt=0.5)
    here, there = (r.normal(0, 1, (int(r.integers(1, 400)), 2)) * r.choice([0.1, 1, 30], 2) for _ in range(2))
    there = np.concatenate([there, here[: int(r.random() < 0.2)]]) + r.choice([0.0, 5, 1e4], 2)
    members = [MemberPlaces(p, np.zeros(len(p)), np.ones(len(p), bool)) for p in (here, there)]
    two = bank(size=np.ones(2), members=members)
    expected = np.hypot(*((here[:, None] - there) * scaled.metres_per_unit).T).min()
    assert moment(two, 0, 1, scaled, 0.0).gap == pytest.approx(expected, rel=1e-12)


def test_parts_of_a_group_keep_the_places_of_its_members() -> None:
    scaled, points = scale_parameters(GroupPdaConfig(), FPS, 1.0), np.array([[0.0, 0.0], [0.0, 0.6], [4.0, 0.0]])
    places = MemberPlaces(np.vstack([points, [[3.8, 0.6]]]), np.array([5.0, 5, 5, 3.9]), np.array([1, 1, 1, 1], bool))
    one = bank(size=np.array([4.0]), members=[places], x=np.zeros((1, 4)))
    fall_apart(one, 0, points, np.ones(3), scaled, 5.0, GroupIds())
    assert np.sort(np.concatenate([one.positions(k) for k in range(2)]), 0) == pytest.approx(np.sort(places.offset, 0))
    assert sorted(m.last_seen.tolist() for m in one.members) == [[5.0, 3.9], [5.0, 5.0]]
