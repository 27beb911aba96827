"""Places where people are counted: lines and zones, who passes them, and who is inside.

A place is a polygon of K corners in the plane of the positions, in m or px. Two corners are the ends of a line. More
are a zone, whose edges do not cross. The two sides of a line are left and right of somebody who stands at the first end
and looks at the second one; those of a zone are inside and outside.

A position is on one of the sides only if it is farther than a margin from the line, or from the edges of the zone:

    side = +1 if d > margin, -1 if d < -margin, else 0        d: signed distance, above 0 to the left or inside

A person passes the place when the side becomes the opposite one, whatever the positions between (a Schmitt trigger). A
line is passed only if the way between the two sides leads through it and not past one of its ends. So somebody who
stands on a line, walks along it or turns back on it does not pass it, and noise below the margin counts nobody twice.
Who is seen on one side only, since it appears or disappears within the margin, does not pass either.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from scenarios.errors import reject
from scenarios.limits import COORDINATE
from sim.geometry.polygons import cross
from sim.store.numeric_text import number_or_nan
from sim.types import Array, Bools, Ints

LINE = 2  # corners of a line
THIN = 1e-6  # m or px: shorter lines have no length, and thinner zones no area
Places = Mapping[str, Array]  # by name the corners (K, 2), m or px
NOWHERE: Places = {}


def parse_places(lines: Iterable[str], zones: Iterable[str]) -> Places:
    """Returns the corners (K, 2) of each place, by name.

    lines: texts of two corners, such as "door=2,5,4,5". zones: texts of three or more corners, such as
    "hall=0,0,9,0,9,6". Raises InputError if a text has another form, a name is repeated, a line has no length, or a
    zone has no area or edges that cross.
    """
    found: dict[str, Array] = {}
    forms = {"--line": "NAME=x1,y1,x2,y2", "--zone": "NAME=x1,y1,x2,y2,x3,y3,…"}
    for option, text in [*(("--line", text) for text in lines), *(("--zone", text) for text in zones)]:
        name, _, cells = text.partition("=")
        values = list(map(number_or_nan, cells.split(",")))
        count = len(values) == 4 if option == "--line" else len(values) >= 6 and len(values) % 2 == 0
        form = f"{forms[option]}, each name once, of letters, digits and _"
        remedy = "write --line door=2,5,4,5 or --zone hall=0,0,9,0,9,6; in px for tracks in the image"
        right = name.isidentifier() and name not in found and count and np.max(np.abs(values)) <= COORDINATE
        reject(not right, "", repr(text), form, remedy, option)
        found[name] = np.reshape(values, (-1, 2))
        fault, expected = _fault(found[name]), "two ends apart" if option == "--line" else "corners in order round it"
        reject(fault, "", f"{text!r}, {fault}", expected, remedy, option)
    return found


def _fault(corners: Array) -> str:
    """Returns why corners (K, 2) are no line or zone, "" if they are one."""
    size = float(np.ptp(corners, axis=0).max())
    if len(corners) == LINE:
        return "" if size > THIN else "of length 0"
    a, b = corners, np.roll(corners, -1, axis=0)
    sides = [cross(b - a, point - a) for point in corners]  # of corner j from edge i: above 0 if it lies to the left
    left = np.array(sides).T
    apart = left * np.roll(left, -1, axis=1) < 0  # edge i has the ends of edge j on its two sides
    if (apart & apart.T).any():
        return "whose edges cross"
    return "" if abs(cross(a, b).sum()) > 2 * THIN * size else "of area 0"


@dataclass(frozen=True, eq=False)
class Passages:
    """Who passes a place, and who is on which side of it. Rows are those of people, sorted by (id, frame).

    Attributes:
        row: The first row (P,) on the new side, for each passage.
        forward: Flags (P,): True for passages to the left side of a line, or into a zone.
        inside: Flags (R,), one for each row: True to the left of a line, or inside a zone. Within the margin it is the
            side before; at first the side that follows; without any, that of the first position.
    """

    row: Ints
    forward: Bools
    inside: Bools


def passages(id: Ints, pos: Array, corners: Array, margin: Array, downwards: bool) -> Passages:
    """Returns who passes a place.

    Args:
        id: Ids (R,) of people, sorted; rows of the same id are in the order of frames.
        pos: Positions (R, 2 or more), m or px; only x and y count.
        corners: Corners (K, 2) of the place.
        margin: Margin (R,) of each row, in the unit of the positions.
        downwards: True if y points down, as in the image: left and right of lines are as one sees them.
    """
    line = len(corners) == LINE
    distance = line_distance(pos, corners) if line else zone_distance(pos, corners)
    distance = -distance if line and downwards else distance
    side = (distance > margin).astype(np.int64) - (distance < -margin)
    known = np.flatnonzero(side)
    a, b = known[:-1], known[1:]
    passed = (id[a] == id[b]) & (side[a] != side[b])
    if line:
        through = steps_through(id, pos, corners) * (-1 if downwards else 1)
        net = np.append(0, np.cumsum(through))
        passed &= (net[b] - net[a]) * side[b] > 0
    row = b[passed]
    return Passages(row, side[row] > 0, _filled(id, side, distance) > 0)


def _filled(id: Ints, side: Ints, distance: Array) -> Ints:
    """Returns sides (R,) without 0: that of the last row of the same person with a side, else of the next one, else
    the sign of the person's first distance."""
    rows = np.arange(len(id))
    first = np.searchsorted(id, id)
    before = np.maximum.accumulate(np.where(side != 0, rows, -1))
    after = np.minimum.accumulate(np.where(side != 0, rows, len(id))[::-1])[::-1]
    ends = np.searchsorted(id, id, side="right")
    alone = np.where(distance > 0, 1, -1)[first]
    wrapped = np.append(side, 0)
    return np.where(before >= first, wrapped[before], np.where(after < ends, wrapped[after], alone))


def line_distance(pos: Array, line: Array) -> Array:
    """Returns the signed distances (R,) of points from the straight line through two ends, above 0 to its left where y
    points up."""
    along = line[1] - line[0]
    return np.asarray(cross(along, pos[:, :2] - line[0]) / length(along))


def steps_through(id: Ints, pos: Array, line: Array) -> Ints:
    """Returns for each step between successive rows (R - 1,) of one person 1 if it leads through the line to its left,
    -1 if to its right, else 0. The line ends at its two ends."""
    a, b = pos[:-1, :2], pos[1:, :2]
    along, step = line[1] - line[0], b - a
    before, after = cross(along, a - line[0]) > 0, cross(along, b - line[0]) > 0
    # The ends of the line are on different sides of the step, too.
    between = (cross(step, line[0] - a) > 0) != (cross(step, line[1] - a) > 0)
    return np.asarray((after.astype(np.int64) - before) * (between & (id[:-1] == id[1:])))


def zone_distance(pos: Array, zone: Array) -> Array:
    """Returns the distances (R,) of points from the nearest edge of a polygon (K, 2), above 0 inside."""
    start, edge = zone, np.roll(zone, -1, axis=0) - zone
    square = np.maximum((edge**2).sum(axis=1), THIN**2)  # of a corner that is repeated, the edge is a point
    nearest = np.full(len(pos), np.inf)
    for a, along, size in zip(start, edge, square, strict=True):
        offset = pos[:, :2] - a
        share = np.clip((offset * along).sum(axis=1) / size, 0.0, 1.0)
        nearest = np.minimum(nearest, length(offset - share[:, None] * along))
    return np.where(inside(pos, zone), nearest, -nearest)


def length(vector: Array) -> Array:
    """Returns the lengths (…) of vectors (…, 2); square roots are rounded alike on all processors."""
    return np.asarray(np.sqrt(vector[..., 0] ** 2 + vector[..., 1] ** 2))


def inside(pos: Array, zone: Array) -> Bools:
    """Returns flags (R,): True for points inside the polygon `zone` (K, 2): a ray to the right from there crosses an
    odd number of its edges."""
    start, end, point = zone, np.roll(zone, -1, axis=0), pos[:, None, :2]
    passed = (start[:, 1] > point[..., 1]) != (end[:, 1] > point[..., 1])
    to_the_right = (cross(end - start, point - start) > 0) == (end[:, 1] > start[:, 1])
    return np.asarray((passed & to_the_right).sum(axis=1) % 2 == 1)


def depth(zone: Array) -> float:
    """Returns area / perimeter of a polygon (K, 2), at most the distance of its innermost point from the edges.

    Bonnesen (see Osserman 1979): r * perimeter >= area + pi r^2 for the inradius r of any simple closed curve.
    """
    after = np.roll(zone, -1, axis=0)
    return float(abs(cross(zone, after).sum()) / 2 / length(after - zone).sum())
