"""Boxes as measurements (x, y, h, w) of `blob`: conversion, pieces of one person, one box over several people."""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Ints


def from_boxes(box: Array) -> Array:
    """(M, 4) centre x, y, height, width of (M, 4) left, top, width, height."""
    z = np.empty_like(box)
    np.multiply(box[:, 2:], 0.5, out=z[:, :2])
    z[:, :2] += box[:, :2]
    z[:, 2], z[:, 3] = box[:, 3], box[:, 2]
    return z


def to_boxes(place: Array) -> Array:
    """(N, 4) left, top, width, height of (N, 4) centre x, y, height, width; at least 1 px wide and high."""
    box = np.empty_like(place)
    np.maximum(place[:, :1:-1], 1.0, out=box[:, 2:])
    np.multiply(box[:, 2:], -0.5, out=box[:, :2])
    box[:, :2] += place[:, :2]
    return box


def lying(box: Array) -> Array:
    """(N, 5) ellipses x, y, h, w, theta inscribed in boxes (N, 4) x, y, h, w: h the longer axis."""
    tall = box[:, 2] >= box[:, 3]
    axes = np.where(tall[:, None], box[:, 2:], box[:, :1:-1])
    return np.column_stack([box[:, :2], axes, np.where(tall, np.pi / 2, 0.0)])


def fused(pieces: Array) -> Array:
    """One box with the area-weighted first and second moments of several (K, 4) boxes.

    A filled box of side L has variance L^2 / 12 along it; the pieces' spread is added, so that two halves of a box give
    the box itself.
    """
    centre, side = pieces[:, :2], pieces[:, :1:-1]
    w = np.prod(side, 1)
    w = w / w.sum()
    mean = w @ centre
    var = w @ (side**2 / 12 + (centre - mean) ** 2)
    return np.concatenate([mean, np.sqrt(12 * var)[::-1]])


def covered(place: Array, others: Array) -> Array:
    """(N, M) share of each box of `place` that lies in each box of `others`; both (., 4) x, y, h, w."""
    shared = np.ones((len(place), len(others)))
    for centre, side in ((0, 3), (1, 2)):
        half, other_half = place[:, side, None] / 2, others[:, side] / 2
        low = np.maximum(place[:, centre, None] - half, others[:, centre] - other_half)
        high = np.minimum(place[:, centre, None] + half, others[:, centre] + other_half)
        shared *= np.maximum(high - low, 0.0)
    return np.asarray(shared / np.maximum(place[:, 2] * place[:, 3], 1e-9)[:, None])


def inside(points: Array, boxes: Array) -> Bools:
    """(N, M) does point (x, y) lie in box (x, y, h, w)?"""
    away = np.abs(points[:, None, :2] - boxes[:, :2]) <= boxes[:, :1:-1] / 2
    return np.asarray(away[..., 0] & away[..., 1])


def hull_overlap(places: Array, box: Array) -> float:
    """IoU of the bounding box of several boxes (K, 4) with another (4,), all x, y, h, w."""
    low = (places[:, :2] - places[:, :1:-1] / 2).min(0)
    high = (places[:, :2] + places[:, :1:-1] / 2).max(0)
    whole = np.concatenate([(low + high) / 2, (high - low)[::-1]])[None]
    shared = float(covered(whole, box[None])[0, 0]) * float(np.prod(whole[0, 2:]))
    return shared / float(np.prod(whole[0, 2:]) + np.prod(box[2:]) - shared)


def best_pieces(rows: Ints, columns: Ints, cost: Array) -> tuple[Ints, Ints]:
    """Of (track, measurement) pairs the cheapest of each track."""
    order = np.lexsort((columns, cost[rows, columns], rows))
    rows, columns = rows[order], columns[order]
    first = np.ones(len(rows), bool)
    first[1:] = rows[1:] != rows[:-1]
    return rows[first], columns[first]
