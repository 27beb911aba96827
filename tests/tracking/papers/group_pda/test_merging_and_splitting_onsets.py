"""Onsets, looked at afterwards: when groups that have merged became as fast as each other."""

from __future__ import annotations

import numpy as np
import pytest

from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY
from tracking.papers.group_pda.merging_and_splitting import PairMoment, merge_onset, split_onset

# Frames per second; when the difference of the velocities begins to fall from 2 m/s to nothing, and for how long.
FPS, SLOWS, LASTS = 10.0, 2.0, 1.0


def encounter(noise: float, seed: int, sway: float = 0.0) -> list[PairMoment]:
    """Two groups that turn into one direction, whose places are known with so much noise, m, and sway at 1 Hz, m/s."""
    t = np.arange(50) / FPS
    v = np.stack([2 * np.clip((SLOWS + LASTS - t) / LASTS, 0, 1), sway * np.sin(2 * np.pi * t)], axis=1)
    way = np.cumsum(v, axis=0) / FPS + np.random.default_rng(seed).normal(0, noise, v.shape)
    return [PairMoment(s, d, vel, np.zeros(2), 0.5) for s, d, vel in zip(t.tolist(), way, v, strict=True)]


@pytest.mark.parametrize(("noise", "sway"), [(0.0, 0.0), (0.05, 0.0), (0.1, 0.0), (0.0, 0.6)])
def test_it_is_when_they_had_become_equally_fast(noise: float, sway: float) -> None:
    due = SLOWS + LASTS * (1 - MERGE_VELOCITY / 2)
    met = [encounter(noise, seed, sway) for seed in range(40)]
    found = np.array([moments[merge_onset(moments, MERGE_VELOCITY)[0]].t for moments in met])
    assert abs(found - due).max() <= 0.5
    assert found.mean() == pytest.approx(due, abs=0.25)


def test_before_that_they_must_be_near() -> None:
    far = [m._replace(gap=MERGE_DISTANCE + 0.1) if m.t < 4.2 else m for m in encounter(0.0, 0)]
    assert far[merge_onset(far, MERGE_VELOCITY)[0]].t == pytest.approx(4.2, abs=0.1 + 1e-9)


def test_groups_that_differ_show_no_evidence_even_at_first_sight() -> None:
    apart = [m for m in encounter(0.0, 0) if m.t < SLOWS]
    assert merge_onset(apart, MERGE_VELOCITY) == (len(apart) - 1, 0.0)
    assert merge_onset([m._replace(way=np.zeros(2)) for m in apart[:5]], MERGE_VELOCITY)[1] == 0.0


@pytest.mark.parametrize(("speed", "since", "first"), [(1.0, 2.7, 0), (1.0, 2.7, 35), (2.0, 2.35, 35)])
def test_a_split_began_when_the_parts_were_apart_seen_or_not(speed: float, since: float, first: int) -> None:
    """Two of 0.8 m to each other leave from 2 s on, and are 1.5 m apart; known from one moment on."""
    t = np.arange(40) / FPS
    for seed in range(200):
        gap = 0.8 + speed * np.maximum(t - 2, 0) + np.random.default_rng(seed).normal(0, 0.05, len(t))
        past = [PairMoment(s, np.zeros(2), np.array([speed, 0]), np.zeros(2), d) for s, d in zip(t, gap, strict=True)]
        assert split_onset(past[first:]).t == pytest.approx(since, abs=0.5)
