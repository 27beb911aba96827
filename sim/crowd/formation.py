"""Where the members of a group walk and stand, where groups meet, and how a group divides into parts.

Places in a formation are (forward, left) of the group's middle in metres; their mean is zero. Walking: pairs abreast,
triads in a V whose middle member is slightly behind, larger groups in rows of triads, then pairs (Zanlungo & Kanda
2013). Standing: a circle.
"""

from __future__ import annotations

import numpy as np

from sim.elementary import dot, length, sin, turned, unit
from sim.types import Array, Ints

V_DEPTH = 0.3  # how far the middle of a triad falls behind, in neighbour distances
ROW_GAP = 1.15  # distance of rows, in neighbour distances: feet need a little more room ahead than aside
SIDEWAYS_LEAD = 0.6  # groups side by side meet this share of their distance further on


def rows_of(n: int) -> list[int]:
    """Returns the sizes of the rows of a walking group of n people, front row first.

    Up to 3 people form one row. More people form rows of 3, followed by as few rows of 2 as possible.
    """
    if n <= 3:
        return [n]
    triads = {0: n // 3, 1: (n - 4) // 3, 2: (n - 2) // 3}[n % 3]
    return [3] * triads + [2] * ((n - 3 * triads) // 2)


def walking(n: int, spacing: float) -> Array:
    """Returns the places (n, 2) of a walking group in m: forward and left of the group's middle.

    They are listed front row first, from left to right. Neighbours in a row are `spacing` m apart.
    """
    rows = []
    for k, size in enumerate(rows_of(n)):
        left = (np.arange(size)[::-1] - (size - 1) / 2) * spacing
        ahead = np.full(size, -k * ROW_GAP * spacing)
        if size == 3:
            ahead[1] -= V_DEPTH * spacing
            left *= np.sqrt(1 - V_DEPTH * V_DEPTH)
        rows.append(np.stack([ahead, left], axis=1))
    places = np.concatenate(rows)
    return np.asarray(places - places.mean(axis=0))


def procession(sizes: list[int], spacing: float) -> tuple[list[Array], list[float]]:
    """Returns the places (n, 2) m of walking groups of these sizes behind each other, and the gap before each of them.

    Places are forward and left of the middle of all people. A gap is the distance of the group's middle from that of
    the one ahead, m, 0 for the first; rows of two groups are as far apart as rows of one.
    """
    places, gaps = [walking(n, spacing) for n in sizes], [0.0]
    for k in range(1, len(places)):
        gaps.append(float(places[k][:, 0].max() - places[k - 1][:, 0].min()) + ROW_GAP * spacing)
    back = np.cumsum(gaps)
    ahead = dot(np.array(sizes, float), back) / sum(sizes) - back
    return [own + np.array([shift, 0.0]) for own, shift in zip(places, ahead, strict=True)], gaps


def standing(n: int, spacing: float) -> Array:
    """Returns the places (n, 2) m of a standing group: on a circle, neighbours `spacing` m apart."""
    if n == 1:
        return np.zeros((1, 2))
    angle = 2 * np.pi * (np.arange(n) + 0.5) / n
    return np.asarray(spacing / (2 * sin(np.pi / n)) * unit(angle))


def to_world(places: Array, middle: Array, heading: Array) -> Array:
    """Returns the world points (n, 2) m of places (n, 2), which are m forward and left of a group's middle.

    middle (2,) m: the group's middle in the world. heading (2,): unit vector in which the group faces.
    """
    left = np.array([-heading[1], heading[0]])
    return np.asarray(middle + places[:, :1] * heading + places[:, 1:] * left)


def assign(pos: Array, points: Array) -> Ints:
    """Returns the index of the point that each of n people takes, (n,); every point is taken once.

    pos, points (n, 2), m. The sum of the squared distances is the least possible.
    """
    from scipy.optimize import linear_sum_assignment

    apart = pos[:, None] - points[None]
    return np.asarray(linear_sum_assignment(dot(apart, apart))[1], dtype=np.int64)


def meeting_point(middles: Array, speeds: Array, goal: Array | None) -> Array:
    """Returns the point (2,) at which groups that walk to each other meet at about the same time.

    middles (G, 2): m. speeds (G,): m/s. goal (2,) m: where they walk together afterwards; None if they
    stay. With a goal the point lies further towards it, so that groups side by side do not walk into each other.
    """
    weights = (1 / speeds) / np.sum(1 / speeds)
    # Further on the slower ones, and towards the common goal: groups side by side do not walk into each other.
    centre = dot(weights, middles.T)
    if goal is None:
        return centre
    ahead = goal - centre
    far = float(length(ahead))
    if far < 1e-6:
        return centre
    apart = middles - centre
    across = np.abs(apart[:, 0] * ahead[1] - apart[:, 1] * ahead[0]) / far
    return np.asarray(centre + ahead / far * min(far, 2 * SIDEWAYS_LEAD * float(across.mean())))


def part_sizes(sizes: list[int | None], total: int) -> list[int]:
    """Returns the number of people in each part of a group of `total` people that divides.

    sizes: the number for each part. Parts with None share the rest equally; the first of them get one more if needed.
    """
    open_parts = [k for k, s in enumerate(sizes) if s is None]
    rest = total - sum(s for s in sizes if s is not None)
    out = [s if s is not None else 0 for s in sizes]
    for n, k in enumerate(open_parts):
        out[k] = rest // len(open_parts) + (n < rest % len(open_parts))
    return out


def divide(offsets: Array, ways: Array, sizes: list[int]) -> Ints:
    """Returns the index of the part that each of n members joins when a group divides, (n,).

    offsets (n, 2) m: each member's position less the group's middle. ways (K, 2) m: each part's goal less the group's
    middle. sizes: the number of people in each of the K parts. The members' distances from the middle towards their
    parts' goals have the greatest possible sum.
    """
    from scipy.optimize import linear_sum_assignment

    seats = np.repeat(np.arange(len(sizes)), sizes)
    along = ways / np.maximum(length(ways)[:, None], 1e-9)
    rows, chosen = linear_sum_assignment(-turned(along, offsets)[:, seats])
    out = np.full(len(offsets), len(sizes) - 1)
    out[rows] = seats[chosen]
    return np.asarray(out, dtype=np.int64)
