"""Onsets, looked at afterwards: when groups that have merged became as fast as each other."""

from __future__ import annotations

import numpy as np
import pytest

from sim.truth.merge_split_rules import MERGE_DISTANCE, MERGE_VELOCITY
from tracking.papers.group_pda.merging_and_splitting import PairHistory, PairMoment, split_onset

FPS, SLOWS, LASTS = 10.0, 2.0, 1.0
"""Frames per second; when the difference of the velocities begins to fall from 2 m/s to nothing, and for how long."""


def encounter(noise: float, seed: int, gap: float = 0.5) -> PairHistory:
    """Two groups that turn into one direction 3 m from each other's middles, seen with so much noise, m."""
    t = np.arange(50) / FPS
    speed = 2 * np.clip((SLOWS + LASTS - t) / LASTS, 0, 1)
    d = np.stack([3.0 + np.cumsum(speed[::-1])[::-1] / FPS, np.zeros(50)], axis=1)
    d += np.random.default_rng(seed).normal(0, noise, d.shape)
    moments = [PairMoment(time, place, place / 2, gap) for time, place in zip(t.tolist(), d, strict=True)]
    return PairHistory(3.5, moments)


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1])
def test_it_is_when_they_had_become_equally_fast(noise: float) -> None:
    due = SLOWS + LASTS * (1 - MERGE_VELOCITY / 2)
    found = np.array([encounter(noise, seed).merge_onset(MERGE_VELOCITY)[0] for seed in range(40)])
    assert abs(found - due).max() <= 0.5
    assert found.mean() == pytest.approx(due, abs=0.25)


def test_before_that_they_must_be_near() -> None:
    met = encounter(0.0, 0)
    far = [m._replace(gap=MERGE_DISTANCE + 0.1) if m.t < 4.2 else m for m in met.moments]
    assert PairHistory(4.4, far).merge_onset(MERGE_VELOCITY)[0] == pytest.approx(4.2)


def test_a_split_began_when_the_parts_were_apart_however_noisy_the_last_look() -> None:
    """Two of 0.8 m to each other leave at 1 m/s from 2 s on, and are 1.5 m apart at 2.7 s; late is one in a hundred."""
    late = 0
    for seed in range(200):
        t, r = np.arange(36) / FPS, np.random.default_rng(seed)
        apart = 0.8 + np.maximum(t - 2, 0)
        past = [
            (s, np.array([[0.0, 0.0], [d, 0.0]]) + r.normal(0, 0.04, (2, 2)))
            for s, d in zip(t.tolist(), apart.tolist(), strict=True)
        ]
        parts = [past[-1][1][:1], past[-1][1][1:]]
        found, place = split_onset(past, parts, np.ones(2), np.zeros((2, 2)), t[-1])
        assert found >= 2.3
        late += found > 3.1
        assert place == pytest.approx(past[round(found * FPS)][1].mean(0))
    assert late <= 2
