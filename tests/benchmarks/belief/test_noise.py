"""The naive rule, against a loop over pairs and frames."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from benchmarks.belief.errors import Errors, missed, with_errors
from benchmarks.belief.noise import naive_pairs, scores
from benchmarks.belief.pairs import pairs_in_frames
from tests import hand_made


def crowd(fps: float):
    """12 people in a square of 5 m who drift for 40 frames, some of them missed."""
    r = np.random.default_rng(0)
    start, velocity = r.uniform(0, 5, (12, 2)), r.normal(0, 0.02, (12, 2))
    scenes = [hand_made.Scene(dict(enumerate(map(tuple, start + k * velocity), 1))) for k in range(40)]
    return missed(with_errors(hand_made.truth(scenes).replace(fps=fps), Errors(0.1, 0.3), 0), 0.2, 0)


def by_loops(truth) -> set[tuple[int, int, int]]:
    """Returns (frame, id, id) of the pairs that the rule links."""
    place = {(f, p): x for f, p, x in zip(truth.frame.tolist(), truth.id.tolist(), truth.pos, strict=True)}
    found = set()
    for now in range(1, truth.length + 1):
        for a, b in combinations(sorted(p for f, p in place if f == now), 2):
            if np.abs(place[now, b] - place[now, a]).max() > 6:
                continue
            past = range(now, now - round(6 * truth.fps), -1)
            d = np.array([place[f, b] - place[f, a] for f in past if (f, a) in place and (f, b) in place])
            new, old = d[: len(d) // 2], d[len(d) // 2 :]
            change = 0 if len(d) < 4 else np.hypot(*(new.mean(axis=0) - old.mean(axis=0)))
            if np.hypot(*d.mean(axis=0)) < 1.3 and change < 0.2 * len(d) / truth.fps + 0.3:
                found.add((now, a, b))
    return found


@pytest.mark.parametrize("fps", [1.0, 2.5])
def test_the_naive_rule_is_that_of_loops(fps):
    truth = crowd(fps)
    i, j, _ = pairs_in_frames(truth)
    linked = naive_pairs(truth, i, j)
    rows = zip(truth.frame[i[linked]].tolist(), truth.id[i[linked]].tolist(), truth.id[j[linked]].tolist(), strict=True)
    expected = by_loops(truth)
    assert set(rows) == expected
    assert 100 < len(expected) < len(i) - 100


def test_scores_of_a_couple_are_perfect():
    scenes = [hand_made.Scene({1: (0.3 * k, 0.0), 2: (0.3 * k, 0.7)}, {7: ([1, 2], None)}) for k in range(60)]
    scenes = [hand_made.Scene({**s.people, 3: (20.0 - 0.3 * k, 8.0)}, s.given) for k, s in enumerate(scenes)]
    naive, spencer, rule = scores(hand_made.truth(scenes).replace(fps=2.5), {})
    assert naive == 1.0
    assert spencer == pytest.approx(1.0, abs=0.02)  # without velocities in the first frame
    assert rule > 0.9


def test_who_is_far_away_now_is_not_together():
    scenes = [hand_made.Scene({1: (0.0, 0.0), 2: (0.7, 0.0)})] * 14 + [hand_made.Scene({1: (0.0, 0.0), 2: (7.0, 0.0)})]
    truth = hand_made.truth(scenes).replace(fps=2.5)
    i, j, _ = pairs_in_frames(truth)
    assert naive_pairs(truth, i, j).tolist() == [True] * 14 + [False]
