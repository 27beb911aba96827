"""The scale of a bare video: learned from lone blobs of the background sample, or refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Tracks
from tests import painted
from tracking.papers.group_pda.tracker import GroupPda


def watch(scale: float, sample: np.ndarray) -> tuple[GroupPda, list[Tracks]]:
    """Two people abreast walk through the picture; scale: px per m, as it is told."""
    tracker = GroupPda()
    frames = [[(40.0 + 4 * k, 200.0, painted.TALL), (64.0 + 4 * k, 200.0, painted.TALL)] for k in range(40)]
    return tracker, painted.watched(tracker, frames, scale, sample)


def test_lone_people_in_the_sample_tell_the_scale() -> None:
    sample = painted.sample(np.random.default_rng(0), 14, painted.spread())
    tracker, made = watch(math.nan, sample)
    assert tracker.px_per_m == pytest.approx(painted.TALL / 1.7, rel=0.06)
    assert [len(t.id) for t in made[10:]] == [1] * 30
    assert made[-1].groups is not None
    assert made[-1].groups.size == pytest.approx([2], abs=0.4)
    again, same = watch(tracker.px_per_m, sample)
    assert again.px_per_m == tracker.px_per_m
    assert [t.pos.tobytes() for t in made] == [t.pos.tobytes() for t in same]


def test_two_who_part_split() -> None:
    """0.6 m apart, at 0.6 m/s each from frame 31 on; the ellipses are 1.5 m apart in frame 41."""
    walked = [2.4 * max(k - 30, 0) for k in range(70)]
    frames = [[(148 - w, 200.0, painted.TALL), (172 + w, 200.0, painted.TALL)] for w in walked]
    made = painted.watched(GroupPda(), frames, painted.TALL / 1.7, painted.sample(np.random.default_rng(0)))
    ((kind, start, before, after),) = [
        (e.kind, e.start, e.before, e.after) for t in made for e in t.events if e.kind in ("merge", "split")
    ]
    assert (kind, before, after) == ("split", (1,), (1, 2))
    assert start == pytest.approx(41, abs=10)


@pytest.mark.parametrize("scale", [math.nan, 0.0, -3.0])
def test_without_a_scale_and_without_anybody_it_is_asked_for(scale: float) -> None:
    with pytest.raises(InputError, match=r"context\.px_per_m"):
        watch(scale, painted.sample(np.random.default_rng(0)))
