"""Kernels of tracking.papers.blob.person_template: sums over upright ellipses, row by row.

Slow twins for tests: tests/reference_templates.py. A template (4,) is x, foot, h, w, px: an ellipse that fills a box of
h x w px round column x with its lower edge at row `foot`. foreground (H, W) bool. cover (H, W) int16: the number of
templates painted over each pixel, plus EXPLAINED where a blob of one person explains the pixel. Sums count in halves of
a foreground pixel: they are whole numbers, and exact in any order.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sim.compiler import njit
from sim.types import Array, Bools, Ints

Cover = NDArray[np.int16]
# Slots of a template.
X, FOOT, HEIGHT, WIDTH = range(4)
HALVES, EMPTY = 2, -1  # halves that a covered foreground pixel and a covered background pixel count
EXPLAINED = 1000  # added to the cover of an explained pixel; more than the number of templates in a frame
ELLIPSE = np.pi / 4  # share of its box that an ellipse fills
LEAST_INSIDE = 0.3  # a template of which a smaller share is inside the image counts as if this share were
BARE = 0.1  # a template of which less than this share is free of others is hidden: it has no piece support

kernel = njit(cache=True)


@kernel
def column_range(x: float, half: float, low: np.int32, high: np.int32) -> tuple[np.int32, np.int32]:
    """Returns first column and last column + 1, counted from `low`, of the pixels whose centre is at most `half` px
    from x.

    Only columns low to high - 1 count; both results are equal if there is no such column.
    """
    left, right = np.int32(np.ceil(x - half - 0.5)), np.int32(np.floor(x + half - 0.5)) + np.int32(1)
    left = min(max(left, low), high)
    return left - low, min(max(right, left), high) - low


@kernel
def half_width(row: int, foot: float, h: float, w: float) -> float:
    """Returns half the width, px, of an upright ellipse at the centre of a row; -1 outside the ellipse.

    The ellipse fills a box of h x w px with its lower edge at row `foot`.
    """
    t = 2 * (row + 0.5 - foot) / h + 1
    return 0.5 * w * np.sqrt(1 - t * t) if abs(t) < 1 else -1.0


@kernel
def row_range(foot: float, h: float, high: int) -> tuple[int, int]:
    """Returns the first row and last row + 1, cut to the image, in which a template can have pixels.

    foot: row of its lower edge; h: its height, px; high: rows of the image. Without such a row the second is not above
    the first.
    """
    return max(int(foot - h), 0), min(int(foot) + 1, high)


@kernel
def window(template: Array, reach: float, shape: tuple[int, int]) -> tuple[int, int, int, int]:
    """Returns first row, last row + 1, first column, last column + 1, cut to an image of `shape` (H, W), that a
    template (4,) x, foot, h, w can cover while it moves by at most `reach` px in both directions."""
    x, foot, h, w = template
    low, high = max(int(foot - h - reach) - 1, 0), min(int(foot + reach) + 2, shape[0])
    left, right = max(int(x - w / 2 - reach) - 1, 0), min(int(x + w / 2 + reach) + 2, shape[1])
    return low, max(high, low), left, max(right, left)


@kernel
def area(template: Array, high: int, wide: int) -> float:
    """Returns the area, px^2, of a template (4,) x, foot, h, w (px; upright ellipse, lower edge at row foot) inside an
    image of high x wide px.

    The share inside is taken to be that of the template's box. It is at least LEAST_INSIDE = 0.3 of the whole ellipse.
    """
    x, foot, h, w = template
    across = min(x + w / 2, wide) - max(x - w / 2, 0.0)
    down = min(foot, high) - max(foot - h, 0.0)
    return float(ELLIPSE * h * w * max(max(across / w, 0.0) * max(down / h, 0.0), LEAST_INSIDE))


@kernel
def paint(cover: Cover, template: Array, more: int) -> None:
    """Add `more` to the cover (H, W), in place, at each pixel whose centre lies in the ellipse of a template (4,) x,
    foot, h, w.

    1 paints the template, -1 erases it. Pixels outside the image are ignored.
    """
    x, foot, h, w = template
    low, high = row_range(foot, h, cover.shape[0])
    for row in range(low, high):
        half = half_width(row, foot, h, w)
        if half > 0:
            left, right = column_range(x, half, np.int32(0), np.int32(cover.shape[1]))
            for column in range(left, right):
                cover[row, column] += more


@kernel
def paint_all(cover: Cover, templates: Array, more: int) -> None:
    """Add `more` to the cover (H, W), in place, at the pixels of each of the templates (K, 4) x, foot, h, w, px.

    1 paints, -1 erases. A pixel under several templates is counted for each.
    """
    for k in range(len(templates)):
        paint(cover, templates[k], more)


@kernel
def count_pixels(foreground: Bools, cover: Cover, template: Array, covered: int) -> tuple[int, int]:
    """Returns how many pixels of a template (4,) x, foot, h, w have a cover of `covered`, and how many of these are
    foreground.

    foreground, cover (H, W). covered: 1 for pixels that only a painted template covers, 0 for pixels that nothing
    covers.
    """
    x, foot, h, w = template
    low, high = row_range(foot, h, cover.shape[0])
    bare, seen = 0, 0
    for row in range(low, high):
        half = half_width(row, foot, h, w)
        if half > 0:
            left, right = column_range(x, half, np.int32(0), np.int32(cover.shape[1]))
            for column in range(left, right):
                own = cover[row, column] == covered
                bare += own
                seen += own & foreground[row, column]
    return bare, seen


@kernel
def support(foreground: Bools, cover: Cover, template: Array, covered: int, by_pieces: bool = False) -> float:
    """Returns the support of a template (4,) x, foot, h, w, px: at most 1, may be negative.

    It is the sum over its pixels whose cover (H, W), the number of templates there, is `covered`: 1 for foreground and
    -1/2 for background, divided by its area. covered: 1 for a painted template, 0 for one that is not painted. If
    `by_pieces`: the share of foreground among these pixels, 0 if they are less than BARE = 0.1 of the template's area,
    as the template is hidden then.
    """
    bare, seen = count_pixels(foreground, cover, template, covered)
    whole = area(template, cover.shape[0], cover.shape[1])
    if by_pieces:
        return seen / whole / (bare / whole) if bare / whole >= BARE else 0.0
    return (HALVES * seen + EMPTY * (bare - seen)) / HALVES / whole


@kernel
def supports(foreground: Bools, cover: Cover, templates: Array, covered: int, by_pieces: bool = False) -> Array:
    """Returns the support (K,) of each of the templates (K, 4) x, foot, h, w, px, as `support`."""
    found = np.zeros(len(templates))
    for k in range(len(templates)):
        found[k] = support(foreground, cover, templates[k], covered, by_pieces)
    return found


@kernel
def near_first(templates: Array) -> Ints:
    """Returns the rows (K,) of templates (K, 4) x, foot, h, w, sorted by foot, the lowest in the image (nearest) first.

    Equal feet keep their order (insertion sort).
    """
    order = np.empty(len(templates), np.int64)
    for k in range(len(order)):
        order[k] = k
        while k > 0 and templates[order[k], FOOT] > templates[order[k - 1], FOOT]:
            order[k], order[k - 1] = order[k - 1], order[k]
            k -= 1
    return order


@kernel
def visible_share(cover: Cover, templates: Array) -> Array:
    """Returns the share (K,), 0 to 1, of each template that no template with a lower foot and no explained pixel
    covers.

    templates (K, 4): x, foot, h, w, px. Of equal feet the earlier one hides the later. cover (H, W): at least EXPLAINED
    = 1000 where a pixel is explained; not changed. The share is of the area inside the image, but at least of 0.3 of
    the ellipse.
    """
    hidden = np.zeros(cover.shape, np.bool_)
    share = np.zeros(len(templates))
    for k in near_first(templates):
        x, foot, h, w = templates[k]
        low, high = row_range(foot, h, cover.shape[0])
        bare = 0
        for row in range(low, high):
            half = half_width(row, foot, h, w)
            if half > 0:
                left, right = column_range(x, half, np.int32(0), np.int32(cover.shape[1]))
                for column in range(left, right):
                    bare += not (hidden[row, column] or cover[row, column] >= EXPLAINED)
                    hidden[row, column] = True
        share[k] = min(bare / area(templates[k], cover.shape[0], cover.shape[1]), 1.0)
    return share


@kernel
def prune(foreground: Bools, cover: Cover, templates: Array, least: float, by_pieces: bool) -> Bools:
    """Returns flags (K,): True for each painted template (x, foot, h, w, px) that stays; erases the others from `cover`
    (H, W), in place.

    The weakest template is erased, and the support of its neighbours computed anew, until the weakest has `least`.
    Support: the pixels that it alone covers, 1 for foreground, -1/2 for background, over its area. If `by_pieces`: the
    share of foreground among these pixels. Without templates the flags are empty.
    """
    stays = np.ones(len(templates), np.bool_)
    worth = supports(foreground, cover, templates, 1, by_pieces)
    for _ in range(len(stays)):
        k = 0
        for other in range(1, len(stays)):
            if worth[other] < worth[k]:
                k = other
        if worth[k] >= least:
            break
        stays[k], worth[k] = False, np.inf
        paint(cover, templates[k], -1)
        for other in range(len(stays)):
            if stays[other] and boxes_touch(templates[k], templates[other]):
                worth[other] = support(foreground, cover, templates[other], 1, by_pieces)
    return stays


@kernel
def boxes_touch(one: Array, other: Array) -> bool:
    """Returns True if the boxes of two templates (4,) x, foot, h, w, px, overlap or are at most 1 px apart in both
    directions."""
    aside = abs(one[X] - other[X]) <= (one[WIDTH] + other[WIDTH]) / 2 + 1
    top, other_top = one[FOOT] - one[HEIGHT], other[FOOT] - other[HEIGHT]
    return bool(aside and top <= other[FOOT] + 1 and other_top <= one[FOOT] + 1)
