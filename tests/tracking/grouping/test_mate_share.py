"""The share of mates among the pairs so far shifts the log-odds towards what explains them best."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.grouping.mate_share import MateShare


def drawn(share: float, pairs: int, seed: int = 0, clear: float = 3.0):
    """Log-odds of pairs by a belief that is right where a tenth are mates, and whether they are mates."""
    r = np.random.default_rng(seed)
    mates = r.random(pairs) < share
    x = r.normal(np.where(mates, clear, -clear) / 2, 1.0)
    return clear * x + np.log(0.1 / 0.9), mates


@pytest.mark.parametrize("share", [0.02, 0.1, 0.4])
def test_the_share_of_another_place_is_found(share):
    log_odds, mates = drawn(share, 4000)
    shifts = MateShare(0.1).add(np.arange(4000) // 20, np.arange(4000), log_odds)
    right = np.log(mates.sum() / (~mates).sum()) - np.log(0.1 / 0.9)
    assert shifts[-1] == pytest.approx(right, abs=0.25)
    assert abs(shifts[0]) < 0.5 * abs(right) + 0.3, "few pairs shift little"


def test_a_pair_counts_once_by_its_latest_belief():
    often = MateShare(0.1)
    step = np.arange(300)
    often.add(step, np.zeros(300, np.int64), np.where(step < 299, 5.0, -5.0))
    once = MateShare(0.1)
    for _ in range(150):
        once.add(np.zeros(1, np.int64), np.zeros(1, np.int64), np.array([-5.0]))
    assert often.counts.sum() == 1
    assert often.shift[0] == pytest.approx(once.shift[0], abs=0.02)


def test_portions_and_renumbered_pairs_change_nothing():
    log_odds, _ = drawn(0.4, 60)
    step, pair = np.arange(240) // 60, np.tile(np.arange(60), 4)
    values = log_odds[pair] + 0.1 * step
    whole = MateShare(0.1).add(step, pair, values)
    parts, order = MateShare(0.1), np.random.default_rng(0).permutation(60)
    number = np.argsort(order)
    first = parts.add(step[:120], pair[:120], values[:120])
    parts.take(order)
    rest = parts.add(step[120:], number[pair[120:]], values[120:])
    np.testing.assert_array_equal(np.concatenate([first, rest]), whole)
    parts.take(np.array([-1, 3]))
    assert parts.latest[0] == -1
    assert parts.counts.sum() == 60, "who is gone still counts"
