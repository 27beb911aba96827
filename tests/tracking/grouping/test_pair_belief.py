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


def test_new_people_have_a_belief_at_once():
    """Of the others, the belief of the last step stays."""
    kept = PairBelief(FPS)
    old = np.array([[0, 0, 1, 0], [0, 0.7, 1, 0.0]])
    kept.add(old)
    for t in range(30):
        kept.see(old[:, :2] + [t / FPS, 0])
    before = kept.log_odds[0, 1]
    kept.keep(np.array([True, True]))
    kept.add(np.array([[3, 0, 1, 0], [3, 0.7, 1, 0], [3, 1.4, 1, 0], [3, -0.7, -1, 0], [30, 0, 1, 0]]))
    assert kept.log_odds[0, 1] == before > 0
    assert kept.log_odds[1, 2] > kept.log_odds[0, 3] > UNSEEN
    assert kept.log_odds[1, 3] < 0
    assert (kept.log_odds[4, :4] == UNSEEN).all()


def test_people_who_are_added_later_than_seen_have_the_time_of_their_first_sight():
    """People who are there at the beginning have no arrival, whenever they are added; others have that of their sight.

    The log-odds of a pair without arrival differ by the tables of "arrival gap" and "first distance".
    """
    state = np.array([[0, 0, 1, 0], [0, 0.7, 1, 0.0]])

    def log_odds(added, ago=None):
        """Of a pair whose people are added in the frames `added`, and seen from then on, after 10 s."""
        kept = PairBelief(FPS)
        for t in range(100):
            if t in added:
                new = np.array([t == x for x in added])
                people = state[: len(kept.count) + int(new.sum())] + np.array([t / FPS, 0, 0, 0])
                kept.add(people, None if ago is None else np.array(ago)[new])
            kept.see(state[: len(kept.count), :2] + np.array([t / FPS, 0]))
        return kept.log_odds[0, 1]

    def arrival(gap, distance):
        """What the tables of the arrival add, in log-odds, for two who walk among few others."""
        tables = {table.name: table for table in default_belief().tables}
        values = {"arrival gap": gap, "first distance": distance}
        return sum(np.interp(x, tables[name].at, tables[name].log_odds[0]) for name, x in values.items())

    at_start = log_odds((0, 0))
    assert arrival(0.0, 0.7) > 0.3
    np.testing.assert_allclose(log_odds((4, 4)) - at_start, arrival(0.0, 0.7), atol=1e-3)
    np.testing.assert_allclose(log_odds((4, 4), (0.3, 0.3)), at_start, atol=1e-3)
    np.testing.assert_allclose(log_odds((4, 7), (0.3, 0.6)), at_start, atol=1e-3)
    np.testing.assert_allclose(log_odds((52, 60), (0.3, 1.1)), log_odds((52, 52)), atol=1e-3)
    assert log_odds((52, 60), (0.3, 0.3)) < log_odds((52, 52)) - 0.1
