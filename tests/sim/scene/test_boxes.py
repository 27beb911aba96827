"""What boxes alone tell: the scale of the image, and who is visible."""

from __future__ import annotations

import numpy as np
import pytest

from sim.scene.visibility import BOXES, image_size_of_boxes, scale_of_first_boxes, with_visibility
from sim.truth.label import bodies
from sim.types import Truth
from tests.reference_sense import crowd, pinhole


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


def stripped(truth: Truth) -> Truth:
    return truth.replace(visible_box=None, visibility=np.ones(len(truth.id)), truncation=None)


def test_boxes_tell_nearly_what_bodies_tell() -> None:
    truth = bodies(crowd(3, people=25, frames=8), pinhole(20, 0, (8, -8, 4)))
    found = with_visibility(stripped(truth), (640, 480))
    hidden = truth.visibility < 0.95
    assert hidden.sum() > 40
    error = np.abs(found.visibility - truth.visibility)[hidden].mean()
    assert error < 0.2 * (1.0 - truth.visibility)[hidden].mean()
    assert (found.visibility[~hidden] > 0.8).all()
    assert found.truncation == pytest.approx(truth.truncation, abs=0.1)
    seen = np.isfinite(found.visible_box).all(axis=1) & np.isfinite(truth.visible_box).all(axis=1)
    assert np.median(np.abs(found.visible_box - truth.visible_box)[seen]) < 1.0


def test_what_is_labelled_is_kept() -> None:
    truth = bodies(crowd(3, frames=2), pinhole())
    assert with_visibility(truth, (640, 480)) is truth
    given = np.linspace(0.1, 0.9, len(truth.id))
    found = with_visibility(truth.replace(visible_box=None, visibility=given), (640, 480))
    assert np.array_equal(found.visibility, given)
    assert found.visible_box is not None
    points = truth.replace(box=None, visible_box=None)
    assert with_visibility(points, None) is points


def test_an_image_of_unknown_size_holds_all_boxes() -> None:
    box = np.array([[10.0, 20.0, 30.2, 40.0], [100.0, 5.0, 10.0, 10.0]])
    assert image_size_of_boxes(box) == (110, 60)
    assert image_size_of_boxes(np.zeros((0, 4))) == image_size_of_boxes() == (1, 1)
