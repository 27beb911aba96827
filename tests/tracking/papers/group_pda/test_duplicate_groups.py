"""A group that has gone does not live on another's points; who is hidden for a moment does."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Array, Context, Detections, Frame, Tracks
from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.tracker import GroupPda

FPS = 10.0


def track(frames: list[Array], config: GroupPdaConfig | None = None) -> list[Tracks]:
    """Answers to points on the ground."""
    tracker, made = GroupPda(config), []
    tracker.reset(Context(FPS, 40.0), 0)
    for k, points in enumerate(frames):
        t, score = k / FPS, np.ones(len(points))
        frame = Frame(k + 1, t, detections=Detections(k + 1, t, "ground", points, score=score))
        made.append(tracker.step(frame, frame.detections))
    return made


def meeting(leaves: float, returns: float, seed: int, offset: float = 0.0) -> list[Array]:
    """Two who walk towards each other, 0.8 m/s, and meet at 4 s; the second is unseen between these times, s."""
    r, made = np.random.default_rng(seed), []
    for k in range(140):
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


@pytest.mark.parametrize("seed", range(6))
def test_who_is_hidden_for_a_moment_has_his_id_afterwards(seed: int) -> None:
    made = track(meeting(-0.2, 0.2, seed))
    assert made[-1].id.tolist() == [1, 2]
    assert np.sign(made[-1].pos[:, 0]).tolist() == [1, -1]
