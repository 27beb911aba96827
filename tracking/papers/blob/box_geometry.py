"""Geometry of boxes as `blob` measures them: conversions.

A centred box is (x, y, h, w): centre, height, width, px. A detection's box is (left, top, width, height), px.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array


def centred_from_ltwh(box: Array) -> Array:
    """Returns centred boxes (M, 4): centre x, y, height, width, px, of boxes (M, 4): left, top, width, height, px."""
    return np.concatenate([box[:, :2] + box[:, 2:] / 2, box[:, :1:-1]], 1)


def ltwh_from_centred(place: Array) -> Array:
    """Returns boxes (N, 4) left, top, width, height, px, of centred boxes `place` (N, 4): centre x, y, height, width,
    px."""
    size = np.maximum(place[:, :1:-1], 1.0)
    return np.concatenate([place[:, :2] - size / 2, size], 1)


def inscribed_ellipses(box: Array) -> Array:
    """Returns the ellipses (N, 5) inscribed in centred boxes (N, 4): centre x, y, height, width, px."""
    tall = box[:, 2] >= box[:, 3]
    axes = np.where(tall[:, None], box[:, 2:], box[:, :1:-1])
    return np.column_stack([box[:, :2], axes, np.where(tall, np.pi / 2, 0.0)])


def standing(box: Array) -> Array:
    """Returns boxes (N, 4): x, foot, height, width, px, of centred boxes (N, 4): centre x, y, height, width, px."""
    return np.asarray(box + box[:, 2:3] * np.array([0.0, 0.5, 0.0, 0.0]))


def centred(standing_box: Array) -> Array:
    """Returns centred boxes (N, 4): centre x, y, height, width, px, of boxes (N, 4): x, foot (row of the lower edge),
    height, width, px."""
    return np.asarray(standing_box - standing_box[:, 2:3] * np.array([0.0, 0.5, 0.0, 0.0]))
