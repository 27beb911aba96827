"""Which detections a tracker gets, and what cannot be."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError
from sim.types import Detections, Sequence
from tracking.running.detection_mode import check_detections, choose_mode, input_kind


def source(**has):
    return Sequence("s", 10.0, 1, lambda: iter(()), **has)


DEFAULT_MODES = [
    (("boxes",), {"has_detections": True, "load_truth": lambda: None}, "file"),
    (("boxes",), {"has_images": True, "load_truth": lambda: None}, "truth"),
    (("pixels", "boxes"), {"has_images": True, "has_detections": True}, "image"),
    (("pixels", "boxes"), {"has_detections": True}, "file"),
    (("stereo", "points"), {"has_images": True, "load_truth": lambda: None}, "truth"),
    (("stereo",), {"has_images": True, "has_right": True}, "image"),
    (("pixels and boxes",), {"has_images": True, "has_detections": True}, "both"),
]


@pytest.mark.parametrize(("needs", "has", "expected"), DEFAULT_MODES)
def test_default_mode(needs, has, expected):
    assert choose_mode(needs, source(**has), None) == expected


USES_BOTH = ("pixels", "boxes", "pixels and boxes")


def test_a_tracker_that_can_do_without_gets_both_only_if_asked_for():
    sequence = source(has_images=True, has_detections=True)
    assert choose_mode(USES_BOTH, sequence, None) == "image"
    assert choose_mode(USES_BOTH, sequence, "both") == "both"
    assert input_kind(USES_BOTH, "both", sequence, ()) == "pixels and boxes"


IMPOSSIBLE_MODES = [
    (("pixels", "boxes"), {"has_images": True, "has_detections": True}, "both"),
    (USES_BOTH, {"has_images": True, "load_truth": lambda: None}, "both"),
    (USES_BOTH, {"has_detections": True}, "both"),
    (("boxes",), {"has_images": True}, None),
    (("boxes",), {"has_detections": True}, "truth"),
    (("boxes",), {"has_images": True, "has_detections": True}, "image"),
    (("stereo",), {"has_images": True, "load_truth": lambda: None}, None),
]


@pytest.mark.parametrize(("needs", "has", "asked"), IMPOSSIBLE_MODES)
def test_what_cannot_work_names_both_sides(needs, has, asked):
    with pytest.raises(InputError) as caught:
        choose_mode(needs, source(**has), asked)
    assert needs[0] in str(caught.value)
    assert "images" in str(caught.value) or "detections" in str(caught.value)


def test_nan_names_frame_and_row():
    box = np.ones((3, 4))
    box[1, 2] = np.nan
    with pytest.raises(InputError, match="frame 7: detection 2"):
        check_detections(Detections(7, 0.6, "image", np.ones((3, 2)), None, box, np.ones(3)), ("boxes",))
    with pytest.raises(InputError, match="got points; expected boxes"):
        check_detections(Detections(7, 0.6, "ground", np.ones((3, 2))), ("boxes",))
