"""Colours of clothes in scenario files: a name or "#rrggbb", alone or several in a list."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from scenarios.schema.values import problem

COLOURS = {
    "black": 0x1A1A1C, "white": 0xE6E6E6, "grey": 0x808080, "red": 0xC02020, "orange": 0xE07818, "yellow": 0xE8C820,
    "green": 0x208038, "blue": 0x2050B8, "navy": 0x1C2848, "purple": 0x703090, "pink": 0xE080A8, "brown": 0x70482C,
    "beige": 0xC8B898,
}  # fmt: skip


def rgb(colour: str) -> tuple[int, int, int]:
    """Returns red, green and blue, 0 to 255, of a colour's name or "#rrggbb"."""
    number = COLOURS.get(colour)
    number = int(colour[1:], 16) if number is None else number
    return number >> 16, number >> 8 & 255, number & 255


def _colour(word: str) -> str:
    if word not in COLOURS and not re.fullmatch("#[0-9a-fA-F]{6}", word):
        raise problem(repr(word), f"a colour: {', '.join(COLOURS)}, or '#rrggbb'", "correct it")
    return word


Colour = Annotated[str, AfterValidator(_colour)]
Colours = Annotated[
    tuple[Colour, ...],
    Field(min_length=1),
    BeforeValidator(lambda value: (value,) if isinstance(value, str) else value),
]
