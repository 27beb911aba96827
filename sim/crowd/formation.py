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
    """Returns the sizes of the rows of a walking group of n people, front row first; they add up to n.

    Up to 3 people form one row; n = 0 gives [0]. More people form rows of 3 in front and one or two rows of 2 behind if
    n is no multiple of 3: 4 gives [2, 2], 7 gives [3, 2, 2].
    """
    if n <= 3:
        return [n]
    triads = {0: n // 3, 1: (n - 4) // 3, 2: (n - 2) // 3}[n % 3]
    return [3] * triads + [2] * ((n - 3 * triads) // 2)


def walking(n: int, spacing: float) -> Array:
    """Returns the places (n, 2) of a walking group of n ≥ 1 people, m: forward and left of the group's middle.

    Front row first, left to right within a row; the mean is zero. Up to 3 people form one row. Else rows have 3 people,
    and the last one or two rows have 2 if n is no multiple of 3. Neighbours in a row are `spacing` m apart, rows 1.15 ×
    spacing. The middle person of a row of three is 0.3 × spacing behind the two beside.
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


def standing(n: int, spacing: float) -> Array:
    """Returns the places (n, 2) of a group of n ≥ 1 people in conversation, m: forward and left of the group's middle.

    They lie on a circle with neighbours `spacing` m apart, counter-clockwise. The first is half a step (180° / n) left
    of straight ahead. One person stands in the middle.
    """
    if n == 1:
        return np.zeros((1, 2))
    angle = 2 * np.pi * (np.arange(n) + 0.5) / n
    return np.asarray(spacing / (2 * sin(np.pi / n)) * unit(angle))


def to_world(places: Array, middle: Array, heading: Array) -> Array:
    """Returns the world points (n, 2): x, y in m, of places (n, 2): forward and left of a group's middle, m.

    middle (2,): the group's middle in the world, m. heading (2,): unit vector in which the group faces.
    """
    left = np.array([-heading[1], heading[0]])
    return np.asarray(middle + places[:, :1] * heading + places[:, 1:] * left)


def assign(pos: Array, points: Array) -> Ints:
    """Returns for each of n people the index of the point that the person takes, shape (n,), every point once.

    The sum of the squared distances is least. pos (n, 2): people; points (n, 2): places; both in m. With fewer points
    than people the result is too short and means nothing. Raises ValueError if a coordinate is nan.
    """
    from scipy.optimize import linear_sum_assignment

    apart = pos[:, None] - points[None]
    return np.asarray(linear_sum_assignment(dot(apart, apart))[1], dtype=np.int64)


def meeting_point(middles: Array, speeds: Array, goal: Array | None) -> Array:
    """Returns the point (2,), m, at which G groups that walk to each other meet at about the same time.

    middles (G, 2): where the groups are, m. speeds (G,): m/s, above 0. goal (2,): where they go together afterwards, m;
    None if nowhere. The point is the mean of the middles, weighted by 1 / speed. With a goal it is shifted towards the
    goal, but never beyond it. The shift is 1.2 times the mean distance of the middles from the line between that mean
    and the goal.
    """
    weights = (1 / speeds) / np.sum(1 / speeds)
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
    """Returns the number of people in each part of a group of `total` people that divides, in the order of `sizes`.

    sizes: wanted number of people of each part. None in it stands for an equal share of the people left over. If the
    division leaves a remainder r, the first r of these parts get one person more. Without None, `sizes` come back as
    they are. Sizes that do not fit `total` are not checked and may give negative shares.
    """
    open_parts = [k for k, s in enumerate(sizes) if s is None]
    rest = total - sum(s for s in sizes if s is not None)
    out = [s if s is not None else 0 for s in sizes]
    for n, k in enumerate(open_parts):
        out[k] = rest // len(open_parts) + (n < rest % len(open_parts))
    return out


def divide(offsets: Array, ways: Array, sizes: list[int]) -> Ints:
    """Returns the index of the part that each of n members joins when a group divides, shape (n,).

    offsets (n, 2): members' positions relative to the group's middle, m. ways (K, 2): vectors from the middle to each
    part's goal, m. sizes: number of members of each of the K parts. Parts fill up to their sizes so that the sum of the
    members' distances ahead, in the direction of their part, is greatest. Members in excess of the sizes join the last
    part. With too few members, some parts stay smaller. Raises ValueError for nan or a negative size.
    """
    from scipy.optimize import linear_sum_assignment

    seats = np.repeat(np.arange(len(sizes)), sizes)
    along = ways / np.maximum(length(ways)[:, None], 1e-9)
    rows, chosen = linear_sum_assignment(-turned(along, offsets)[:, seats])
    out = np.full(len(offsets), len(sizes) - 1)
    out[rows] = seats[chosen]
    return np.asarray(out, dtype=np.int64)
