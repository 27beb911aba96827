"""Ranks of runs: who shares a rank, and how often that is wrong."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.ranking import rank
from tracking.stats import paired


def draws(count: int, runs: int, sequences: int, better: float = 0.0):
    """Scores of runs with independent noise on sequences that differ; the first is better by `better`."""
    for seed in range(count):
        r = np.random.default_rng(seed)
        scores = 0.6 + 0.2 * r.standard_normal(sequences) + 0.05 * r.standard_normal((runs, sequences))
        scores[0] += better
        yield scores


@pytest.mark.parametrize("sequences", [6, 12, 36])
def test_copies_of_one_tracker_share_all_ranks(sequences: int) -> None:
    """Plain intervals of 28 pairs would part some of eight copies in most draws."""
    tied = [(found.first == 1).all() and (found.last == 8).all() for found in map(rank, draws(4000, 8, sequences))]
    assert np.mean(tied) >= 0.95
    plain = [any(paired(s[:1].T, s[1:].T)[1] > 0) for s in draws(200, 8, sequences)]
    assert np.mean(plain) > 0.05


@pytest.mark.parametrize("better", [0.02, 0.05, 0.1])
def test_joint_intervals_hold_the_true_margin(better: float) -> None:
    held, alone, promised = [], [], []
    for scores in draws(200, 8, 36, better):
        found = rank(scores)
        place = int(np.flatnonzero(found.order == 0)[0])
        others = np.arange(8) != place
        low, high = found.less_low[place, others], found.less_high[place, others]
        held.append(((low <= better) & (better <= high)).all())
        alone.append(found.first[place] == found.last[place] == 1)
        promised.append((low > 0).all())
    assert np.mean(held) >= 0.95
    assert alone == promised
    assert np.mean(alone) < 0.2 if better == 0.02 else np.mean(alone) > 0.95 if better == 0.1 else True


def test_two_runs_are_parted_by_their_paired_interval() -> None:
    (scores,) = draws(1, 2, 15, 0.05)
    found = rank(scores)
    a, b = found.order
    expected = paired(scores[b][:, None], scores[a][:, None])
    assert (found.less[0, 1], found.less_low[0, 1], found.less_high[0, 1]) == pytest.approx([e[0] for e in expected])
    assert found.better[0, 1] == (expected[1][0] > 0)


def test_few_or_unknown_sequences_part_nobody() -> None:
    (scores,) = draws(1, 3, 6, 0.5)
    assert rank(scores).first.tolist() == [1, 2, 2]
    gap = scores.copy()
    gap[1, 2] = np.nan
    for few in (rank(scores[:, :5]), rank(gap), rank(scores[:, :1]), rank(scores[:, :0])):
        assert few.first.tolist() == [1, 1, 1]
        assert few.last.tolist() == [3, 3, 3]
    assert rank(gap).sequences == 5
