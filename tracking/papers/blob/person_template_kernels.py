"""Kernels of tracking.papers.blob.person_template: sums over upright ellipses, row by row;
twins: tests/reference_templates.

A template is an ellipse filling a box of h x w px that stands on the row `foot` at column x. `foreground` (H, W) bool:
the frame, `cover` (H, W) the number of templates painted over each pixel, EXPLAINED more where it is explained already.
Worth is counted in halves of a foreground pixel, so that all sums are of whole numbers and exact in any order.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from sim.types import Array, Bools, Ints
from tracking.detect.blobs import Labels

Cover = NDArray[np.int16]
HALVES, EMPTY = 2, -1  # what a foreground pixel is worth and a background pixel costs
EXPLAINED = 1000
ELLIPSE = np.pi / 4  # share of its box that an ellipse fills
LEAST_INSIDE = 0.3  # a template further out of the image than this counts as so large
BARE = 0.1  # share of a template that no other covers below which he is hidden, not seen

kernel = njit(cache=True, error_model="numpy")


@kernel
def column_range(x: float, half: float, width: int) -> tuple[int, int]:
    """Columns whose middle lies within `half` of x, clipped to the image: left, right (excluded)."""
    left, right = int(np.ceil(x - half - 0.5)), int(np.floor(x + half - 0.5)) + 1
    return min(max(left, 0), width), min(max(right, 0), width)


@kernel
def half_width(row: int, foot: float, h: float, w: float) -> float:
    """Half the ellipse's width in the middle of a row; negative outside."""
    t = 2 * (row + 0.5 - foot) / h + 1
    return 0.5 * w * np.sqrt(1 - t * t) if abs(t) < 1 else -1.0


@kernel
def row_range(foot: float, h: float, high: int) -> tuple[int, int]:
    """Rows in which a template may have pixels: first, last + 1."""
    return max(int(foot - h), 0), min(int(foot) + 1, high)


@kernel
def area(template: Array, high: int, wide: int) -> float:
    """px of a template inside the image."""
    x, foot, h, w = template
    across = min(x + w / 2, wide) - max(x - w / 2, 0.0)
    down = min(foot, high) - max(foot - h, 0.0)
    return float(ELLIPSE * h * w * max(max(across / w, 0.0) * max(down / h, 0.0), LEAST_INSIDE))


@kernel
def paint(cover: Cover, template: Array, more: int) -> None:
    """Add `more` to the pixels of a template."""
    x, foot, h, w = template
    low, high = row_range(foot, h, cover.shape[0])
    for row in range(low, high):
        half = half_width(row, foot, h, w)
        if half > 0:
            left, right = column_range(x, half, cover.shape[1])
            for column in range(left, right):
                cover[row, column] += more


@kernel
def paint_all(cover: Cover, templates: Array, more: int) -> None:
    """Add `more` to the pixels of templates (K, 4), for each of them."""
    for k in range(len(templates)):
        paint(cover, templates[k], more)


@kernel
def mark_explained(cover: Cover, label: Labels, which: Bools) -> None:
    """Add EXPLAINED to the pixels whose label k has which[k]; labels beyond have not."""
    for row in range(cover.shape[0]):
        for column in range(cover.shape[1]):
            k = label[row, column]
            if 0 < k < len(which) and which[k]:
                cover[row, column] += EXPLAINED


@kernel
def count_pixels(foreground: Bools, cover: Cover, template: Array, covered: int) -> tuple[int, int]:
    """PixelUpdater of a template that so many templates cover, and those of them that are foreground."""
    x, foot, h, w = template
    low, high = row_range(foot, h, cover.shape[0])
    bare, seen = 0, 0
    for row in range(low, high):
        half = half_width(row, foot, h, w)
        if half > 0:
            left, right = column_range(x, half, cover.shape[1])
            for column in range(left, right):
                own = cover[row, column] == covered
                bare += own
                seen += own & foreground[row, column]
    return bare, seen


@kernel
def support(foreground: Bools, cover: Cover, template: Array, covered: int) -> float:
    """Support of a template by the pixels that so many cover: 0 if it is not painted, 1 if it is."""
    bare, seen = count_pixels(foreground, cover, template, covered)
    halves = HALVES * seen + EMPTY * (bare - seen)
    return halves / HALVES / area(template, cover.shape[0], cover.shape[1])


@kernel
def supports(foreground: Bools, cover: Cover, templates: Array, covered: int) -> Array:
    """(K,) support of each of the templates (K, 4)."""
    found = np.zeros(len(templates))
    for k in range(len(templates)):
        found[k] = support(foreground, cover, templates[k], covered)
    return found


@kernel
def piece_support(foreground: Bools, cover: Cover, template: Array) -> float:
    """Share of foreground in the pixels of a painted template that no other covers; 0 where these are few."""
    bare, seen = count_pixels(foreground, cover, template, 1)
    whole = area(template, cover.shape[0], cover.shape[1])
    return seen / whole / (bare / whole) if bare / whole >= BARE else 0.0


@kernel
def piece_supports(foreground: Bools, cover: Cover, templates: Array) -> Array:
    """(K,) the same of each of the templates (K, 4)."""
    found = np.zeros(len(templates))
    for k in range(len(templates)):
        found[k] = piece_support(foreground, cover, templates[k])
    return found


@kernel
def near_first(templates: Array) -> Ints:
    """(K,) rows of templates, near people (low feet) first; these are few."""
    order = np.arange(len(templates))
    for k in range(1, len(order)):
        while k > 0 and templates[order[k], 1] > templates[order[k - 1], 1]:
            order[k], order[k - 1] = order[k - 1], order[k]
            k -= 1
    return order


@kernel
def visible_share(cover: Cover, templates: Array) -> Array:
    """(K,) share of each template that none of these with a lower foot, and nothing explained, covers."""
    hidden = np.zeros(cover.shape, np.bool_)
    share = np.zeros(len(templates))
    for k in near_first(templates):
        x, foot, h, w = templates[k]
        low, high = row_range(foot, h, cover.shape[0])
        bare = 0
        for row in range(low, high):
            half = half_width(row, foot, h, w)
            if half > 0:
                left, right = column_range(x, half, cover.shape[1])
                for column in range(left, right):
                    bare += not (hidden[row, column] or cover[row, column] >= EXPLAINED)
                    hidden[row, column] = True
        share[k] = min(bare / area(templates[k], cover.shape[0], cover.shape[1]), 1.0)
    return share


@kernel
def prune(foreground: Bools, cover: Cover, templates: Array, least: float, by_pieces: bool) -> Bools:
    """(K,) which painted templates have `least` when the others are taken away, the weakest first."""
    stays = np.ones(len(templates), np.bool_)
    worth = piece_supports(foreground, cover, templates) if by_pieces else supports(foreground, cover, templates, 1)
    while stays.any():
        k = worth.argmin()
        if worth[k] >= least:
            break
        stays[k], worth[k] = False, np.inf
        paint(cover, templates[k], -1)
        for other in np.flatnonzero(stays):
            if boxes_touch(templates[k], templates[other]):
                one = templates[other]
                worth[other] = (
                    piece_support(foreground, cover, one) if by_pieces else support(foreground, cover, one, 1)
                )
    return stays


@kernel
def boxes_touch(one: Array, other: Array) -> bool:
    """Do the boxes of two templates touch?"""
    aside = abs(one[0] - other[0]) <= (one[3] + other[3]) / 2 + 1
    return bool(aside and one[1] - one[2] <= other[1] + 1 and other[1] - other[2] <= one[1] + 1)
