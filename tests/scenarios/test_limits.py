"""What counts as a number within bounds."""

import math

import numpy as np
import pytest

from scenarios.limits import is_number


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


def test_whole_numbers_beyond_float():
    assert not is_number(10**400, 0, 1)
