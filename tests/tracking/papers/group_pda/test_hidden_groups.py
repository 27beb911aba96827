"""Groups that have gone, hidden ones, and what bodies hide in a view at an angle: none lives on another's points."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Array, Tracks
from tests import painted
from tests.painted import TALL, Person
from tests.tracking.papers.group_pda.test_association_kernels import bank
from tests.tracking.papers.group_pda.test_tracker import track
from tracking.papers.group_pda.association import (
    associate,
    claimed,
    gated_distances,
    search_regions,
    with_missed_members,
)
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.group_bank import MemberPlaces
from tracking.papers.group_pda.scaled_parameters import scale_parameters
from tracking.papers.group_pda.tracker import GroupPda

FPS = 10.0


def meeting(leaves: float, returns: float, seed: int, offset: float = 0.0, frames: int = 140) -> list[Array]:
    """Two who walk towards each other, 0.8 m/s, and meet at 4 s; the second is unseen between these times, s."""
    r, made = np.random.default_rng(seed), []
    for k in range(frames):
        s = k / FPS - 4.0
        there = np.array([(0.8 * s, 0.0), (-0.8 * s, offset)]) + r.normal(0, 0.06, (2, 2))
        made.append(there[:1] if leaves <= s < returns else there)
    return made


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("offset", [0.0, 0.3])
def test_who_has_left_does_not_follow_the_other_for_ever(seed: int, offset: float) -> None:
    made = track(meeting(0.0, np.inf, seed, offset))
    assert [len(t.id) for t in made[-20:]] == [1] * 20
    assert made[20].id.tolist() == [1, 2]
    assert not any(t.events for t in made)  # The two were there before, and each is alone.


def test_who_is_hidden_for_a_moment_has_his_id_afterwards() -> None:
    """In at least 11 of 12 meetings: he may be taken for the other one."""
    last = [track(meeting(-0.2, 0.2, seed, frames=80))[-1] for seed in range(12)]
    assert all(t.id.tolist() == [1, 2] for t in last)
    assert sum(np.sign(t.pos[:, 0]).tolist() == [1, -1] for t in last) >= 11


def test_a_group_whose_only_point_is_more_probably_anothers_is_predicted_only() -> None:
    scaled, t, point = scale_parameters(GroupPdaConfig(), FPS, 1.0), 1.0, np.zeros((1, 2))
    two = bank(
        size=np.ones(2), x=np.array([[0.0, 0, 1, 0], [0.3, 0, 1, 0]]), P=np.tile(0.1 * np.eye(4), (2, 1, 1)),
        extent=np.tile(0.1 * np.eye(2), (2, 1, 1)),
    )  # fmt: skip
    before, region = two.x.copy(), search_regions(two, scaled)
    claims = claimed(point, np.ones(1), gated_distances(two, point, region, scaled), t)
    mine = associate(two, claims, region, np.zeros((2, 1)), scaled, t)
    assert claims.claimants.tolist() == [2]
    assert mine.tolist() == [[True], [False]]
    assert two.last_seen.tolist() == [t, 0.0]
    assert two.x[1].tolist() == before[1].tolist()


def test_an_infeasible_group_without_points_of_its_own_coasts() -> None:
    scaled, t = scale_parameters(GroupPdaConfig(), FPS, 1.0), 1.0
    points, stand_ins = np.array([[-2.0, 0.0], [2.0, 0.0]]), np.array([[-2.0, 0.8], [2.0, 0.8]])
    places = points[:0], points[:0], stand_ins
    three = bank(
        members=[MemberPlaces(p, np.full(len(p), 0.5), np.ones(len(p), bool)) for p in places],
        size=np.ones(3), x=np.array([[-2.0, 0, 0, 0], [2, 0, 0, 0], [0, 0, 0, 0]]), null_time=np.array([0.0, 0, 0.2]),
        P=np.tile(0.05 * np.eye(4), (3, 1, 1)), extent=np.array([[[0.1]], [[0.1]], [[1.5]]]) * np.eye(2),
    )  # fmt: skip
    region = search_regions(three, scaled)
    claims = claimed(points, np.ones(2), gated_distances(three, points, region, scaled), t)
    claims = with_missed_members(claims, three, scaled, t)
    associate(three, claims, region, np.zeros((3, 4)), scaled, t)
    assert claims.claimants.tolist() == [2, 2, 1, 1]
    assert three.last_seen.tolist() == [t, t, 0.0]
    assert three.null_time[2] == pytest.approx(0.2)


SCALE = TALL / 1.7


def watch(frames: list[list[Person]]) -> list[Tracks]:
    """Groups in pictures of these people."""
    return painted.watched(GroupPda(), frames, SCALE, painted.sample(np.random.default_rng(0), 28))


def merges(made: list[Tracks]) -> int:
    return sum(e.kind == "merge" for t in made for e in t.events)


@pytest.mark.parametrize(("apart", "expected"), [(1.3, 1), (2.2, 0)])
def test_who_walks_far_behind_does_not_join_though_his_feet_touch_a_head(apart: float, expected: int) -> None:
    frames = []
    for k in range(70):
        behind = max(apart, 3.6 - 0.06 * k) * SCALE
        frames.append([(60 + 2.0 * k, 225.0, TALL), (60 + 2.0 * k, 225 - behind, TALL)])
    made = watch(frames)
    assert made[10].id.tolist() == [1, 2]
    assert merges(made) == expected
    assert len(made[-1].id) == 2 - expected


def test_who_joins_a_group_behind_its_backs_has_merged_with_it() -> None:
    frames = []
    for k in range(90):
        close = min(max(k - 20, 0) / 50, 1.0)
        wide, x = 24 - 23 * close, 80 + 1.5 * k
        three = [(x + wide * i, 200.0, TALL) for i in (-1, 0, 1)]
        frames.append([*three, (x + 12 + 100 * (1 - close), 194.0, TALL)])
    made = watch(frames)
    assert len(made[15].id) == 2
    assert merges(made) == 1
    assert len(made[-1].id) == 1
