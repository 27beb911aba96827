"""Where groups meet and how a group shares itself out: geometry of merge and split orders."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints

SIDEWAYS_LEAD = 0.6  # groups side by side meet this share of their distance further on


def meeting_point(middles: Array, speeds: Array, goal: Array | None) -> Array:
    """Where groups that walk to each other meet: all at about the same time, further on the more they walk abreast."""
    weights = (1 / speeds) / np.sum(1 / speeds)
    centre = np.asarray(weights @ middles)
    if goal is None:
        return centre
    ahead = goal - centre
    far = float(np.linalg.norm(ahead))
    if far < 1e-6:
        return centre
    apart = middles - centre
    across = np.abs(apart[:, 0] * ahead[1] - apart[:, 1] * ahead[0]) / far
    return np.asarray(centre + ahead / far * min(far, 2 * SIDEWAYS_LEAD * float(across.mean())))


def part_sizes(sizes: list[int | None], total: int) -> list[int]:
    """Sizes of all parts: the given ones, and the rest shared evenly (the first get one more); none below 1."""
    open_parts = [k for k, s in enumerate(sizes) if s is None]
    rest = total - sum(s for s in sizes if s is not None)
    out = [s if s is not None else 0 for s in sizes]
    for n, k in enumerate(open_parts):
        out[k] = rest // len(open_parts) + (n < rest % len(open_parts))
    return out


def share_out(offsets: Array, ways: Array, sizes: list[int]) -> Ints:
    """Which part each member joins: those stand nearest to a part's way who are furthest that way."""
    from scipy.optimize import linear_sum_assignment

    seats = np.repeat(np.arange(len(sizes)), sizes)
    unit = ways / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), 1e-9)
    rows, chosen = linear_sum_assignment(-(offsets @ unit.T)[:, seats])
    out = np.full(len(offsets), len(sizes) - 1)
    out[rows] = seats[chosen]
    return np.asarray(out, dtype=np.int64)
