"""Parameters in the unit of the points: metres on the ground, px in the image."""

from __future__ import annotations

import numpy as np

from tracking.papers.group_pda.config import GroupPdaConfig
from tracking.papers.group_pda.scaled_parameters import scale_parameters


def test_variances_grow_with_the_square_of_the_scale() -> None:
    ground, image = (scale_parameters(GroupPdaConfig(accel_noise=0.7), 10.0, scale) for scale in (1.0, 40.0))
    np.testing.assert_allclose(image.Q, 1600 * ground.Q)
    twice = scale_parameters(GroupPdaConfig(accel_noise=1.4), 10.0, 1.0)
    np.testing.assert_allclose(twice.Q, 4 * ground.Q)
