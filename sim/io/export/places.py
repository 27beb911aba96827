"""Lines that people cross, and zones in which they are, counted per minute.

A place is a polygon of K corners in the plane of the positions: of two corners, a line; of more, a zone, whose edges do
not cross. Who goes from one side of a line to the other between two sightings has crossed it, however long the gap.
Left and right are those of somebody who stands at the first corner and looks at the second one. Who walks up and down
on a line is counted each time; the difference of both directions holds all the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from scenarios.errors import InputError
from scenarios.limits import COORDINATE
from sim.geometry.polygons import cross
from sim.io.files.numeric_text import is_number_text
from sim.types import Array, Bools, Ints

Places = Mapping[str, Array]  # by name the corners (K, 2), m or px


def parse_places(lines: Iterable[str], zones: Iterable[str]) -> Places:
    """Returns the places of texts such as "door=2,5,4,5", of two corners, and "hall=0,0,9,0,9,6", of three or more.

    Raises InputError if a text is none.
    """
    found: dict[str, Array] = {}
    expected = {"--line": "NAME=x1,y1,x2,y2", "--zone": "NAME=x1,y1,x2,y2,x3,y3,…"}
    for option, text in [*(("--line", text) for text in lines), *(("--zone", text) for text in zones)]:
        name, _, cells = text.partition("=")
        values = [float(cell) if is_number_text(cell) else np.inf for cell in cells.split(",")]
        count = len(values) == 4 if option == "--line" else len(values) >= 6 and len(values) % 2 == 0
        if not name.isidentifier() or name in found or not count or not np.max(np.abs(values)) <= COORDINATE:
            raise InputError(
                place=option, got=repr(text), expected=f"{expected[option]}, each name once",
                remedy="write --line door=2,5,4,5 or --zone hall=0,0,9,0,9,6; in px for tracks in the image",
            )  # fmt: skip
        found[name] = np.reshape(values, (-1, 2))
    return found


def crossings(frame: Ints, id: Ints, pos: Array, line: Array, downwards: bool) -> tuple[Ints, Ints]:
    """Returns the frames (C,) in which people cross a line to its left, and those to its right.

    frame, id (N,), pos (N, 2) of people; downwards: y points down, as in the image.
    """
    order = np.lexsort((frame, id))
    frame, pos = frame[order], pos[order, :2]
    same = np.diff(id[order]) == 0
    a, b = pos[:-1][same], pos[1:][same]
    first, along = line[0], line[1] - line[0]
    before, after = cross(along, a - first) > 0, cross(along, b - first) > 0
    # The ends of the line are on different sides of the step, too.
    step = b - a
    hits = (before != after) & ((cross(step, line[0] - a) > 0) != (cross(step, line[1] - a) > 0))
    left = after != downwards
    when = frame[1:][same]
    return when[hits & left], when[hits & ~left]


def inside(pos: Array, zone: Array) -> Bools:
    """Returns which points (N, 2) are in a zone: to their right they have an odd number of its edges."""
    x, y = pos[:, 0, None], pos[:, 1, None]
    a, b = zone, np.roll(zone, -1, axis=0)
    level = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])
    beyond = x < a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise
    return np.asarray((level & beyond).sum(axis=1) % 2 == 1)
