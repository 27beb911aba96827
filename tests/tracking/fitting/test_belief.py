"""The sample that a belief is fitted to."""

import numpy as np

from tracking.fitting.belief import sample_of
from tracking.fitting.grouping_scenes import pair_scenes


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
