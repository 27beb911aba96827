"""Points from pairs of pictures: what the background model learns, and from surfaces to the middle of people."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Context
from tests.sim.scene.test_camera_stereo import rig
from tracking.detect.features import SpacePoints
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.picture_points import PicturePoints, moved_away

FPS = 10.0


@pytest.mark.filterwarnings("ignore:.*mostly foreground:UserWarning")
def test_a_picture_that_stays_bright_becomes_background(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of it is foreground at first."""
    monkeypatch.setattr("tracking.detect.background.FOREGROUND_SLOWER", 1.0)
    monkeypatch.setattr("tracking.detect.background.Background._estimate_gain", lambda self, *_: self.gain)
    camera, r = rig(40.0), np.random.default_rng(0)
    width, height = camera.image

    def picture(grey: float) -> np.ndarray:
        return np.clip(grey + 3 * r.standard_normal((height, width, 3)), 0, 255).astype(np.uint8)

    context = Context(FPS, 30.0, camera=camera, background=np.stack([picture(80) for _ in range(20)]))
    config = StereoConfig(background_time=1.0)
    source = PicturePoints(config, context)
    assert not source.foreground.segment(picture(180)).plausible
    for _ in range(80):
        assert not len(source.points(picture(180), picture(180)))
    assert source.foreground.segment(picture(180)).plausible


def test_points_move_away_from_the_camera_along_the_ground() -> None:
    camera = rig(40.0)
    away = np.array([[3.0, 4.0, 0.5], [-6.0, 8.0, 1.0], [0.0, -2.0, 1.5]])
    pos = away + np.append(camera.position[:2], 0.0)
    zero, cov = np.zeros((3, 3)), np.zeros((3, 3, 3))
    moved = moved_away(SpacePoints(np.arange(3), pos, cov, zero, cov), camera, 0.2).pos
    np.testing.assert_allclose(moved - pos, [[0.12, 0.16, 0.0], [-0.12, 0.16, 0.0], [0.0, -0.2, 0.0]], atol=1e-12)
