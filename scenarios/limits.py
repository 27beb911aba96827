"""Bounds of what is read, each in one place: sizes of files, frames, pictures, crowds, numbers.

A value beyond a bound is refused with an InputError. The bounds lie far above real recordings, so that a mistyped
number is refused before it fills memory.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any, TypeGuard

TEXT_BYTES = 128 * 2**20  # bytes of a text file of rows
JSON_BYTES = 64 * 2**20  # bytes of a JSON file
TOML_BYTES = 2 * 2**20  # bytes of a TOML file
XML_BYTES = 64 * 2**20  # bytes of an XML file
YAML_BYTES = 16_384  # OpenCV's parser overflows the stack where some ten thousand brackets are nested
DEPTH = 32  # tables and lists inside each other in a TOML or JSON file
NESTING = f"at most {DEPTH} tables and lists inside each other"  # words for what DEPTH allows
REPEATS = 10_000  # entries that one row of a suite stands for
INTEGER = 2**63 - 1  # largest whole number in a TOML or JSON file, also with a minus sign

FRAMES = 1_000_000  # frames of a sequence: 11 hours at 25 frames per second
CELLS = 20_000_000  # frames times people of a sequence that is simulated, whose motion is held as an array
FRAME_RATES = (0.01, 1000.0)  # least and greatest number of frames per second
PICTURE_SIDE = 16_384  # width or height of a picture, px
PICTURE_PIXELS = 40_000_000  # width times height of a picture, px; 8K has 33 million
# words for the sizes that `fits_picture` accepts
PICTURE_SIZES = f"1 to {PICTURE_SIDE:,} px a side, at most {PICTURE_PIXELS:,} px in all"
SCALES = (0.01, 100_000.0)  # least and greatest image scale, px per m
SAMPLE_BYTES = 2 * 10**9  # bytes of all pictures of a background sample together
COORDINATE = 1e6  # absolute value of a coordinate or length, m or px
DETECTIONS = 5000  # detections or people in one frame
PEOPLE = 5000  # people in one scenario


def is_number(value: object, low: float = -math.inf, high: float = math.inf) -> TypeGuard[float]:
    """Returns True for a finite real number of Python or numpy from `low` to `high`, but False for a bool."""
    number: Any = value
    return isinstance(value, Real) and not isinstance(value, bool) and low <= number <= high and abs(number) < math.inf


def is_whole(value: object, low: float = -math.inf, high: float = math.inf) -> TypeGuard[int]:
    """Returns True for a whole number of Python or numpy from `low` to `high`, but False for a bool."""
    return isinstance(value, Integral) and is_number(value, low, high)


def fits_picture(width: float, height: float) -> bool:
    """Returns True if a width and height in px are within the bounds PICTURE_SIDE and PICTURE_PIXELS."""
    return 1 <= width <= PICTURE_SIDE and 1 <= height <= PICTURE_SIDE and width * height <= PICTURE_PIXELS
