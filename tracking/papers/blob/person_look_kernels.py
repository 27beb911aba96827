"""Kernels of people's looks: the colours at points of a person's template, and where a picture shows them (ours).

A template (4,) is x, foot, h, w, px: an upright ellipse that fills a box. Its points are a grid of ROWS rows of COLUMNS
points, each row as wide as the ellipse. A look (POINTS, 5) has for each point the mean blue, green and red, the
variance of a colour channel, and the number of pictures from which they were learned. A pixel of colour c fits a point
by the log-likelihood ratio of the point's Gaussian to the peak of one as broad as the colours of all people,

    max(-|c - mean|^2 / (2 var) - 1.5 ln(var / ANY_VAR), WORST_FIT)

so a point of varying colour, such as a leg, tells little. Points that are unknown, outside the image or hidden by
others count 0. Slow twins for tests: tests/reference_templates.py.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools, Image, Ints
from tracking.papers.blob.person_template_kernels import EXPLAINED, Cover, kernel, near_first, paint, window

ROWS, COLUMNS = 12, 3
POINTS = ROWS * COLUMNS
# Slots of a look's point, after the three colours.
VAR, SEEN = 3, 4
FIRST_VAR = 25.0**2  # variance of a colour before it is learned, which counts as FIRST_COUNT pictures
FIRST_COUNT = 3.0
LEAST_VAR = 15.0**2  # a learned variance is taken to be at least this: light and places vary
ANY_VAR = 60.0**2  # variance of the colours of all people
WORST_FIT = -1.0  # least log-likelihood ratio of a point: something else may be in front of it
LEAST_SEEN = 3  # pictures after which a point of a look is known
LEARN_SHOWN = 0.7  # least visible share of a person whose look is learned
LOOK_TIME = 2.0  # s: time constant with which looks follow people who turn


def unknown(n: int) -> Array:
    """Returns the looks (n, POINTS, 5) of people who were not seen yet."""
    look = np.zeros((n, POINTS, 5))
    look[..., VAR] = FIRST_VAR
    return look


@kernel
def point_offsets(h: float, w: float) -> Array:
    """Returns the places (POINTS, 2) of the points of a template, relative to its x and foot, px."""
    found = np.empty((POINTS, 2))
    for p in range(POINTS):
        down = (p // COLUMNS + 0.5) / ROWS
        aside = (2 * (p % COLUMNS) + 1) / COLUMNS - 1
        found[p, 0] = aside * np.sqrt(1 - (2 * down - 1) ** 2) * w / 2
        found[p, 1] = (down - 1) * h
    return found


@kernel
def covered_in_front(shape: tuple[int, int], templates: Array, k: int) -> Bools:
    """Returns a mask of `shape` (H, W): True where a template that comes before template k in `near_first` covers a
    pixel."""
    cover = np.zeros(shape, np.int16)
    for other in near_first(templates):
        if other == k:
            break
        paint(cover, templates[other], 1)
    return cover > 0


@kernel
def look_fits(image: Image, cover: Cover, templates: Array, k: int, look: Array, steps: int, step: float) -> Array:
    """Returns how well a look fits the picture with template k at each place of a grid round its own: the sum over the
    points, divided by POINTS.

    The grid is that of `worth_when_moved`. image (H, W, 3) BGR; cover (H, W): templates and explained blobs; templates
    (K, 4).
    """
    low, high, left, right = window(templates[k], steps * step, cover.shape)
    part = templates - np.array([left, low, 0.0, 0.0])
    seen, cover, n = image[low:high, left:right], cover[low:high, left:right], 2 * steps + 1
    hidden = covered_in_front(cover.shape, part, k) | (cover >= EXPLAINED)
    x, foot, h, w = part[k]
    offsets, found = point_offsets(h, w), np.zeros((n, n))
    for p in range(POINTS):
        if look[p, SEEN] < LEAST_SEEN:
            continue
        var = min(max(look[p, VAR], LEAST_VAR), ANY_VAR)
        best = -1.5 * np.log(var / ANY_VAR)
        for i in range(n):
            row = int(np.floor(foot + offsets[p, 1] + (i - steps) * step))
            for j in range(n):
                column = int(np.floor(x + offsets[p, 0] + (j - steps) * step))
                if shown(hidden, row, column):
                    away = squared_distance(seen[row, column], look[p])
                    found[i, j] += max(best - away / (2 * var), WORST_FIT)
    return found / POINTS


@kernel
def pair_fits(image: Image, templates: Array, looks: Array, rows: Ints, columns: Ints) -> Array:
    """Returns how well the looks (N, POINTS, 5) fit the picture with the templates (K, 4), (P,), of P pairs of looks
    `rows` and templates `columns`. Points that a template with lower feet covers are hidden. image (H, W, 3) BGR."""
    cover, found = np.zeros(image.shape[:2], np.int16), np.empty(len(rows))
    for pair in range(len(rows)):
        found[pair] = look_fits(image, cover, templates, columns[pair], looks[rows[pair]], 0, 1.0)[0, 0]
    return found


@kernel
def learn(image: Image, templates: Array, looks: Array, rows: Ints, least_gain: float) -> None:
    """Learn, in place, the looks (K, POINTS, 5) at `rows` from the image under the points of the templates (K, 4).

    Hidden points stay as they are. Means and variances are those of all pictures at first, and later follow the last
    ones: the newest picture has at least the weight `least_gain`.
    """
    for k in rows:
        low, high, left, right = window(templates[k], 0.0, image.shape[:2])
        part = templates - np.array([left, low, 0.0, 0.0])
        hidden = covered_in_front((high - low, right - left), part, k)
        x, foot, h, w = part[k]
        offsets = point_offsets(h, w)
        for p in range(POINTS):
            row, column = int(np.floor(foot + offsets[p, 1])), int(np.floor(x + offsets[p, 0]))
            if shown(hidden, row, column):
                update_point(looks[k, p], image[low + row, left + column], least_gain)


@kernel
def shown(hidden: Bools, row: int, column: int) -> bool:
    """Returns True if a pixel is inside the image's part `hidden` and not hidden."""
    inside = 0 <= row < hidden.shape[0] and 0 <= column < hidden.shape[1]
    return bool(inside and not hidden[row, column])


@kernel
def squared_distance(colour: Array, point: Array) -> float:
    """Returns the squared distance of a colour (3,) from the mean colour of a look's point."""
    away = 0.0
    for c in range(3):
        away += (colour[c] - point[c]) ** 2
    return away


@kernel
def update_point(point: Array, colour: Array, least_gain: float) -> None:
    """Update a look's point (5,), in place, with a colour (3,)."""
    count = point[SEEN]
    if count > 0:
        gain = max(1 / (count + FIRST_COUNT), least_gain)
        point[VAR] += gain * (squared_distance(colour, point) / 3 - point[VAR])
    for c in range(3):
        point[c] += max(1 / (count + 1), least_gain) * (colour[c] - point[c])
    point[SEEN] = count + 1
