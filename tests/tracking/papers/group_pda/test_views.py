"""What a view at an angle hides: bodies cover other bodies, and the ground behind them; colours tell who is who."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Tracks
from tests import painted
from tests.painted import TALL, Person
from tracking.papers.group_pda.tracker import GroupPda

SCALE = TALL / 1.7


def watch(frames: list[list[Person]]) -> list[Tracks]:
    """Groups in pictures of these people."""
    return painted.watched(GroupPda(), frames, SCALE, painted.sample(np.random.default_rng(0), 28))


def merges(made: list[Tracks]) -> int:
    return sum(e.kind == "merge" for t in made for e in t.events)


@pytest.mark.parametrize(("apart", "expected"), [(2.2, 1), (2.65, 0)])
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
