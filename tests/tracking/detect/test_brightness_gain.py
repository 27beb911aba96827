"""The gain's median is numpy's, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.detect import background_training


@pytest.mark.parametrize("n", [1, 2, 3, 8, 50, 51, 5000])
def test_median_is_numpys(n):
    values = np.random.default_rng(n).normal(1, 0.2, n).astype(np.float32)
    assert background_training._median(values) == float(np.median(values))
