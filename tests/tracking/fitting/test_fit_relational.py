"""The fit of `relational`: known weights are found again, and the command writes a file that is read."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from tracking.fitting.relational import fit_relational, logistic
from tracking.papers.relational.config import RelationalConfig

ENDS = RelationalConfig().speed_ends


def test_logistic_regression_finds_its_weights():
    rng = np.random.default_rng(0)
    design = np.stack([np.ones(40_000), -rng.exponential(2, 40_000), -rng.exponential(0.5, 40_000)], axis=1)
    true = np.array([3.0, 1.5, 4.0])
    same = rng.random(40_000) < 1 / (1 + np.exp(-design @ true))
    np.testing.assert_allclose(logistic(design, same), true, rtol=0.05)


def test_pairs_that_a_line_separates_have_finite_weights():
    distance = np.linspace(0, 4, 400)
    weights = logistic(np.stack([np.ones(400), -distance, np.zeros(400)], axis=1), distance < 1.5)
    assert weights[0] / weights[1] == pytest.approx(1.5, abs=0.05)
    assert weights[2] == 0
    assert 3 < weights[1] < 30


def test_without_scenes_nothing_is_fitted():
    with pytest.raises(InputError, match="0 changes of velocity"):
        fit_relational([], ENDS)
