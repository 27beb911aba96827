"""Foreground blobs of painted pictures as detections."""

from __future__ import annotations

import numpy as np
import pytest

from sim.types import Context, Frame
from tests import painted
from tests.painted import FPS, TALL
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.point_detections import ForegroundBlobs

APART, BESIDE = [(80.0, 180.0, TALL), (200.0, 200.0, TALL)], [(120.0, 190.0, TALL), (136.0, 191.0, TALL)]


@pytest.mark.parametrize(
    ("people", "more", "count"), [(APART, (), 2), (BESIDE, (), 1), (BESIDE, (False,), 1), (BESIDE, (True,), 2)]
)
def test_people_in_a_picture_are_detections_with_their_boxes(people, more, count):
    r = np.random.default_rng(0)
    sample = np.stack([painted.picture([(40.0 + 16 * k, 190.0, TALL)], r) for k in range(16)])
    context = Context(FPS, TALL / 1.7, image_size=(painted.WIDE, painted.HIGH), background=sample)
    pixels = ForegroundBlobs(BackgroundSettings(), context, *more)
    boxes = np.array([painted.box(person) for person in people])
    found = pixels.detections(Frame(1, 0.0, image=painted.picture(people, r)), boxes)
    assert len(found.pos) == count
    np.testing.assert_allclose(found.pos, found.box[:, :2] + found.box[:, 2:] / 2)
    if count == len(people):
        order = np.argsort(found.pos[:, 0])
        np.testing.assert_allclose(found.pos[order], boxes[:, :2] + boxes[:, 2:] / 2, atol=4)
