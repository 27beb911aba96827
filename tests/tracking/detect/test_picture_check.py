"""The warning of pictures from which people cannot be measured."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from tracking.detect import blobs
from tracking.detect.picture_check import FEWEST, PictureCheck

QUIET, NOISY = np.full(3, 2.0, np.float32), np.full(3, 12.0, np.float32)


def test_usual_pictures_and_a_few_bad_ones_are_not_mentioned() -> None:
    made = PictureCheck()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for k in range(200):
            made.add(k % 5 > 0, k % 7 > 0, lambda: QUIET)


@pytest.mark.parametrize(
    ("plausible", "complete", "noise", "words"),
    [
        (False, True, QUIET, "mostly foreground.*the camera moves"),
        (True, False, NOISY, "more pieces.*noisy .standard deviation 12 grey levels"),
    ],
)
def test_bad_pictures_are_mentioned_once_with_their_cause(plausible, complete, noise, words) -> None:
    made = PictureCheck()
    for _ in range(FEWEST - 1):
        made.add(plausible, complete, lambda: noise)
    with pytest.warns(UserWarning, match=words):
        made.add(plausible, complete, lambda: noise)
    for _ in range(3 * FEWEST):  # a second warning would be an error
        made.add(plausible, complete, lambda: noise)


def test_of_very_many_regions_the_largest_are_looked_at() -> None:
    mask = np.zeros((80, 80), bool)
    mask[::2, ::2] = True
    mask[40:60, 40:60] = True
    found = blobs.find(mask, 1)
    assert len(found) == found.label.max() == blobs.MOST < 1500
    assert found.area[0] >= 400
