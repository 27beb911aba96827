"""The belief of pairs that is kept up to date frame by frame, against that of whole sequences."""

from __future__ import annotations

import numpy as np

from tracking.grouping.belief import UNSEEN, beliefs_of_tracks, default_belief
from tracking.grouping.pair_belief import PairBelief

FPS = 10.0


def test_the_belief_is_that_of_the_whole_sequence():
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
    kept, now, compared = PairBelief(FPS), np.zeros(0, np.int64), 0
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
            expected[whole.a[rows], whole.b[rows]] = expected[whole.b[rows], whole.a[rows]] = whole.log_odds[rows]
            apart = ~np.eye(len(now), dtype=bool)
            np.testing.assert_allclose(kept.log_odds[apart], expected[np.ix_(now, now)][apart], rtol=0, atol=1e-9)
            compared += int(rows.sum())
    assert compared > 100


def test_people_who_are_not_seen_for_a_while_are_as_in_the_whole_sequence():
    """Rows stay; the belief is that of tracking.grouping over the frames in which people were seen."""
    rng = np.random.default_rng(1)
    people, frames = 6, 80
    pos = rng.uniform(0, 3, (people, 2)) + rng.normal(0, 0.6, (people, 2)) * np.arange(frames)[:, None, None] / FPS
    there = rng.random((frames, people)) < 0.6
    there[:, 0], there[:30, 1], there[40:60, 2] = True, False, False
    frame, column = np.nonzero(there)
    whole = beliefs_of_tracks(frame, column, pos[there], frames, FPS, default_belief())
    kept, compared = PairBelief(FPS), 0
    kept.add(np.full((people, 4), np.nan))
    for t in range(frames):
        kept.see(np.where(there[t, :, None], pos[t], np.nan))
        if t % kept.size == 0:
            rows = whole.step == t // kept.size
            expected = np.full((people, people), UNSEEN)
            expected[whole.a[rows], whole.b[rows]] = expected[whole.b[rows], whole.a[rows]] = whole.log_odds[rows]
            np.testing.assert_allclose(kept.log_odds, expected, rtol=0, atol=1e-9)
            recent = there[max(t - kept.size + 1, 0) : t + 1].any(axis=0)
            assert np.array_equal(kept.seen(), recent)
            compared += int(rows.sum())
    assert compared > 100
