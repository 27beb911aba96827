import numpy as np
import pytest

from sim.scene.box_visibility import image_size_of_boxes, with_visibility
from sim.truth.label import bodies
from sim.types import Truth
from tests.reference_sense import crowd, pinhole


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
