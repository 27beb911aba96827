"""The sample that a belief is fitted to."""

import numpy as np

from tracking.fitting.belief import LEVELS, PairSample, best_thresholds, fit_belief, sample_of
from tracking.fitting.grouping_scenes import pair_scenes
from tracking.grouping.pair_evidence import NAMES


def test_what_is_named_twice_comes_once_and_weighs_twice():
    one, other = (list(pair_scenes([name], [30_000])) for name in ("side-by-side", "pass-by"))
    found = sample_of(list(pair_scenes(["side-by-side", "pass-by", "side-by-side"], [30_000])))
    assert len(found.values) == sum(len(s.values) for s in one + other)
    long = sample_of(one + other + one)
    rows = len(found.values)
    np.testing.assert_allclose(found.weight.sum(), 1)
    repeated = np.append(np.arange(rows), np.arange(sum(len(s.values) for s in one)))
    for quantity in (found.together, found.values[:, 0] < 1):
        assert np.isclose(found.weight[quantity].sum(), long.weight[quantity[repeated]].sum())


def test_the_threshold_is_best_for_the_mean_of_scenes():
    """Of a scene of many rows a low threshold is best, of two small ones a high one; scenes count by their weight."""
    scenes = [(np.array([-3.0, -1.0, 1.0]), 500), *[(np.array([-1.0, 1.0, 3.0]), 2)] * 2]
    log_odds = np.concatenate([np.repeat(x, n) for x, n in scenes])
    together = np.concatenate([np.repeat([False, True, True] if n > 2 else [False, False, True], n) for _, n in scenes])
    scene = np.repeat([0, 1, 2], [3 * n for _, n in scenes])

    def found(weight):
        rows = np.array(weight)[scene] / np.bincount(scene)[scene]
        none, nobody = np.zeros((len(scene), 0)), np.zeros_like(scene)
        sample = PairSample(none, np.full(len(scene), LEVELS[2]), together, rows, nobody, nobody, scene, 9)
        threshold = best_thresholds(sample, log_odds)[2]
        return np.log(threshold / (1 - threshold))

    assert 1 <= found([0.2, 0.4, 0.4]) < 3
    assert -3 <= found([0.8, 0.1, 0.1]) < -1


def test_thresholds_and_tables_depend_on_the_noise():
    """Where positions err the same distance tells less, and a pair counts as together from a lower probability on."""
    r, rows = np.random.default_rng(0), 6000
    noise, together = np.repeat([0.0, 1.5], rows // 2), r.random(rows) < 0.3
    x = np.where(together, 0.8, 2.0) + r.normal(0, np.where(noise > 0, 1.5, 0.3), rows)
    values = np.full((rows, len(NAMES)), np.nan)
    values[:, 0] = x
    number = np.arange(rows)
    sample = PairSample(values, noise, together, np.full(rows, 1 / rows), number, number, 0 * number, rows)
    found = fit_belief(sample)
    (table,) = found.tables
    steep = np.ptp(table.log_odds[0], axis=1)
    assert steep[0] > 2 * steep[-1]
    assert found.threshold[0] > found.threshold[-1]
