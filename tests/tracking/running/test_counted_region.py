"""The region that counts: masks as pictures and polygons, of pictures and of boxes."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from sim import simulate
from sim.types import Detections
from tracking.running.counted_region import counted_region, detections_inside, with_masked_pictures
from tracking.running.run import track

SIZE = (40, 30)


def test_a_picture_an_array_and_corners_give_the_same_region(tmp_path: Path) -> None:
    drawn = np.zeros((30, 40), np.uint8)
    drawn[10:30, 20:40] = 255
    cv2.imwrite(str(tmp_path / "mask.png"), drawn)
    for mask in (tmp_path / "mask.png", str(tmp_path / "mask.png"), drawn, "20,10,40,10,40,30,20,30"):
        np.testing.assert_array_equal(counted_region(mask, SIZE), drawn > 0)
    np.testing.assert_array_equal(counted_region([[20, 10], [40, 10], [40, 30], [20, 30]], SIZE), drawn > 0)


@pytest.mark.parametrize(
    ("mask", "size", "words"),
    [
        ("1,2,3", SIZE, "got 1,2,3; expected a picture, or corners"),
        ("a,b,c,d,e,f", SIZE, "corners"),
        ("0,0,nan,0,1,1", SIZE, "corners"),
        ("nowhere.png", SIZE, "no such file"),
        (np.ones((30, 41)), SIZE, "41×30 px; expected 40×30 px"),
        ("50,50,60,50,60,60", SIZE, "no pixel that counts"),
        ("0,0,9,0,9,9", None, "size in px is unknown"),
    ],
)
def test_bad_masks_are_refused(mask: object, size: tuple[int, int] | None, words: str) -> None:
    with pytest.raises(InputError, match=words):
        counted_region(mask, size)


def test_boxes_count_by_their_foot_and_from_above_by_their_centre() -> None:
    region = np.zeros((30, 40), bool)
    region[20:] = True
    box = np.array([[5, 5, 4, 16.0], [5, 2, 4, 10.0], [5, 10, 4, 20.0], [-9, 10, 4, 15.0]])  # feet 21, 12, 30, outside
    found = Detections(1, 0.0, "image", box[:, :2] + box[:, 2:] / 2, None, box, np.array([0.9, 0.8, 0.7, 0.6]))
    assert detections_inside(found, region, above=False).score.tolist() == [0.9, 0.7]
    assert detections_inside(found, region, above=True).score.tolist() == [0.7]
    ground = Detections(1, 0.0, "ground", np.zeros((2, 2)))
    with pytest.raises(InputError, match="points on the ground without boxes"):
        detections_inside(ground, region, above=False)


def test_people_outside_the_region_are_not_tracked() -> None:
    whole = simulate(load("cross", set=["camera.fps=5", "camera.image=[320,240]", "duration=6"]), 40_000)
    region = np.zeros((240, 320), bool)
    region[:, :160] = True
    shown = next(with_masked_pictures(whole, region).frames()).image
    assert not shown[:, 160:].any()
    np.testing.assert_array_equal(shown[:, :160], next(whole.frames()).image[:, :160])
    for mode in ("image", "file"):
        every, left = (track("blob", whole, detections=mode, mask=mask) for mask in (None, region))
        assert left.info["mask"] == "given as an array"
        assert "mask" not in every.info
        everywhere, inside = (np.concatenate([t.box[:, 0] + t.box[:, 2] / 2 for t in run]) for run in (every, left))
        assert (everywhere > 200).any()
        assert not (inside > 200).any()
        assert (inside < 150).any()
