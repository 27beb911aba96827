"""What counts as a number within bounds, and as the size of a picture that is read and drawn."""

import math

import numpy as np
import pytest

from scenarios import load
from scenarios.errors import InputError
from scenarios.limits import PICTURE_PIXELS, PICTURE_SIDE, fits_picture, is_number


@pytest.mark.parametrize("value", [0, 1, 0.5, np.float32(0.5), np.float64(1), np.int16(1), np.uint8(0)])
def test_numbers_of_any_kind(value):
    assert is_number(value)
    assert is_number(value, 0, 1)
    assert not is_number(value, 2, 3)


@pytest.mark.parametrize(
    "value", [True, np.True_, None, "1", 1j, math.nan, math.inf, -math.inf, np.float32("nan"), np.ones(1), [1]]
)
def test_anything_else(value):
    assert not is_number(value)
    assert not is_number(value, 0, 1)


def test_sizes_of_pictures():
    assert fits_picture(1, 1)
    assert fits_picture(PICTURE_SIDE, PICTURE_PIXELS // PICTURE_SIDE)
    for width, height in ((0, 1), (1, 0), (-1, -1), (PICTURE_SIDE + 1, 1), (1, PICTURE_SIDE + 1), (8192, 8192)):
        assert not fits_picture(width, height)


def test_a_scenario_has_pictures_of_any_size_that_is_read():
    assert load("merge", set=[f"camera.image=[{PICTURE_SIDE}, 16]"]).camera.image == (PICTURE_SIDE, 16)
    for size in (f"[{PICTURE_SIDE + 1}, 16]", "[8192, 8192]"):
        with pytest.raises(InputError, match="image"):
            load("merge", set=[f"camera.image={size}"])
