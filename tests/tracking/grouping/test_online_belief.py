"""The belief of pairs that is kept up to date frame by frame, against that of whole sequences."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.grouping.belief import DECISIONS, UNSEEN, default_belief
from tracking.grouping.online_belief import PairBelief
from tracking.grouping.pair_beliefs import beliefs_of_tracks

FPS = 10.0


@pytest.mark.parametrize("decision", DECISIONS)
def test_the_belief_is_that_of_the_whole_sequence(decision):
    """People come and go: after each step all pairs have the belief of tracking.grouping, to the last bit."""
    rng = np.random.default_rng(0)
    people, frames = 7, 90
    born, gone = rng.integers(0, 40, people), 1 + 4 * rng.integers(12, 23, people)  # whole steps
    born[:2] = 0
    start, velocity = rng.uniform(0, 4, (people, 2)), rng.normal(0, 0.6, (people, 2))
    pos = start + velocity * np.arange(frames)[:, None, None] / FPS + 0.03 * rng.standard_normal((frames, people, 2))
    there = (np.arange(frames)[:, None] >= born) & (np.arange(frames)[:, None] < gone)
    frame, column = np.nonzero(there)
    whole = beliefs_of_tracks(frame, column, pos[there], frames, FPS, default_belief())
    kept, now, compared = PairBelief(FPS, decision), np.zeros(0, np.int64), 0
    for t in range(frames):
        kept.keep(there[t, now])
        now = now[there[t, now]]
        new = np.setdiff1d(np.flatnonzero(there[t]), now)
        now = np.concatenate([now, new])
        kept.add(np.concatenate([pos[t, now], velocity[now]], axis=1))
        kept.see(pos[t, now])
        if t % kept.size == 0:
            expected = np.full((people, people), UNSEEN)
            rows = whole.step == t // kept.size
            expected[whole.a[rows], whole.b[rows]] = expected[whole.b[rows], whole.a[rows]] = whole.log_odds[
                rows, DECISIONS.index(decision)
            ]
            apart = ~np.eye(len(now), dtype=bool)
            np.testing.assert_allclose(kept.log_odds[apart], expected[np.ix_(now, now)][apart], rtol=0, atol=1e-9)
            compared += int(rows.sum())
    assert compared > 100
