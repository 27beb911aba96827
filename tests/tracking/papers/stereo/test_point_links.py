"""Detections linked from frame to frame: ids, velocities and how sure these are."""

from __future__ import annotations

import numpy as np
import pytest

from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.point_links import SPEED, PointLinks

FPS = 10.0


def test_a_new_point_may_have_any_velocity_and_a_linked_one_has_its_own() -> None:
    config, links = StereoConfig(point_noise=0.05, window_time=0.5), PointLinks(FPS)
    walk = np.array([[0.1, 0.0, 0.0], [0.0, -0.1, 0.0]])
    for k in range(6):
        found = links.step(np.array([[0.0, 0, 0], [3.0, 0, 0]])[:: (-1) ** k] + k * walk[:: (-1) ** k], config)
        assert found.id.tolist() == [1, 2][:: (-1) ** k]
        if not k:
            np.testing.assert_allclose(found.vel_cov, np.tile(SPEED**2 * np.eye(3), (2, 1, 1)))
    np.testing.assert_allclose(found.vel[::-1], FPS * walk, atol=1e-12)
    # the slope of a line through six times: variance point_noise^2 over the sum of their squared deviations
    spread = np.square(np.arange(6) / FPS - 0.25).sum()
    np.testing.assert_allclose(found.vel_cov[0], 0.05**2 / spread * np.eye(3))
    np.testing.assert_allclose(found.cov[0], 0.05**2 * np.eye(3))


@pytest.mark.parametrize(("step", "ids"), [(0.34, [1]), (0.36, [2])])
def test_a_point_moves_no_faster_than_2_m_per_s_and_three_deviations(step: float, ids: list[int]) -> None:
    config, links = StereoConfig(point_noise=0.05), PointLinks(FPS)
    links.step(np.zeros((1, 3)), config)
    assert links.step(np.array([[step, 0.0, 0.0]]), config).id.tolist() == ids
