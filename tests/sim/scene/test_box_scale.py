"""The scale of an image from the boxes of its first frames."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.box_scale import BOXES, scale_of_first_boxes


def test_the_frames_that_hold_the_first_boxes_decide():
    frame = np.repeat(np.arange(1, 61), 3)
    height = np.where(frame <= 34, 17.0, 170.0)
    assert scale_of_first_boxes(frame, height) == (pytest.approx(10.0), 34)
    assert -(-BOXES // 3) == 34
    shuffled = np.random.default_rng(0).permutation(len(frame))
    assert scale_of_first_boxes(frame[shuffled], height[shuffled]) == (pytest.approx(10.0), 34)


def test_few_boxes_all_count_and_unknown_ones_do_not():
    frame = np.array([4, 4, 9, 30])
    assert scale_of_first_boxes(frame, np.array([17.0, np.nan, 34.0, 51.0])) == (pytest.approx(20.0), 30)
    scale, last = scale_of_first_boxes(frame, np.full(4, np.nan))
    assert np.isnan(scale)
    assert last == 0


@pytest.mark.parametrize("seed", range(20))
def test_later_frames_change_nothing(seed):
    draw = np.random.default_rng(seed)
    frame = np.sort(draw.integers(1, 200, 400))
    height = draw.uniform(10, 200, 400)
    scale, last = scale_of_first_boxes(frame, height)
    for end in (last, last + 1, 150, 200):
        assert scale_of_first_boxes(frame[frame <= end], height[frame <= end]) == (scale, last)
