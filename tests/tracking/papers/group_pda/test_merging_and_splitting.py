"""When groups merge: a moment in which one of them cannot merge does not take the evidence away."""

from __future__ import annotations

import numpy as np
import pytest

from tests.tracking.papers.group_pda.test_association_kernels import bank
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import MemberPlaces
from tracking.papers.group_pda.merging_and_splitting import GroupChanges, moment
from tracking.papers.group_pda.scaled_parameters import scale_parameters

FPS = 10.0


@pytest.mark.parametrize("why", ["unmeasured", "infeasible"])
def test_a_moment_without_velocity_does_not_take_the_evidence_away(why: str) -> None:
    scaled, when = scale_parameters(GroupPdaConfig(merge_time=0.8), FPS, 1.0), []
    for pause in (range(0), range(4, 6)):
        extent, since = np.tile(0.1 * np.eye(2), (2, 1, 1)), np.full(2, -9.0)
        changes, two = GroupChanges(), bank(size=np.ones(2), extent=extent, first_seen=since)
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


@pytest.mark.parametrize(("since", "splits"), [(-3.0, 1), (-2.0, 0)])
def test_who_was_there_for_less_than_2_s_was_never_one_group(since: float, splits: int) -> None:
    scaled, changes = scale_parameters(GroupPdaConfig(), FPS, 1.0), GroupChanges()
    two = bank(size=np.ones(2), x=np.diag([0.0, 2.2])[:, [0, 1, 0, 0]])
    two.parent[1], two.first_seen[:], two.last_seen[:] = 0, since, 1.0
    events = [e for k in range(10) for e in changes.step(two, scaled, k / FPS)]
    split = ("split", pytest.approx(0.4 - 0.7 / 0.7), (0,), (0, 1))
    assert [(e.kind, e.onset, e.before, e.after) for e in events] == splits * [split]


def test_in_the_paper_groups_merge_whose_places_and_velocities_overlap() -> None:
    """Three at one place, of which the second has another velocity."""
    scaled = scale_parameters(GroupPdaConfig(corrections=False), FPS, 1.0)
    x = np.array([[0.0, 0.0, 9.0, 0.0], [0.1, 0.0, 0.0, 0.0], [0.0, 0.1, 9.0, 0.0]])
    three = bank(size=np.ones(3), x=x, extent=np.tile(0.1 * np.eye(2), (3, 1, 1)), first_seen=np.full(3, -9.0))
    three.last_seen[:] = 0.0
    (merge,) = GroupChanges().step(three, scaled, 0.0)
    assert (merge.kind, merge.before, merge.after) == ("merge", (0, 2), (0,))
