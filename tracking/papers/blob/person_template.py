"""People as templates over a foreground mask: where a given number of people explain the foreground best (ours).

A template is an upright ellipse in a box x (its middle), foot (row of the lower edge), h, w, px. A pixel that at least
one template covers counts 1 if it is foreground and -1/2 if it is background, however many templates cover it. So a
partly hidden person is measured by the visible part, and a gap in the mask (a lamp post, clothes in the background's
colour) costs less than a second person.
    support       of a template: the sum over the pixels that it alone covers, divided by its area; at most 1
    fit_places    each template in turn moves to the place of largest evidence * support - d^2 / 2, d^2 the squared
                  distance from its expected place in standard deviations; templates that touch others also by how
                  well the person's look fits the picture there (person_look_kernels)
While one template moves and the others stay, only sums over its own rows are needed (person_template_search_kernels).

New people are found in the foreground that no track explains. Each unexplained region is tried with 1, 2, … templates
of a person's size at its place. They start side by side, each where its columns of the region reach down to (from
straight above: in a row along the region's longer axis). Then they move in turn to where they explain most. The number
is chosen whose templates together explain most: the sum over covered pixels (foreground 1, background -1/2), where each
template costs the share `support` of a person's area. No template may have less support than that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from sim.types import Array, Bools, Ints
from tracking.detect import blobs
from tracking.detect.person_size import SLIM, SMALLEST, PersonSize
from tracking.papers.blob import new_people_kernels as new
from tracking.papers.blob import person_template_kernels as kernels
from tracking.papers.blob.person_template_kernels import ELLIPSE, Cover

LEAST = 0.3  # a region smaller than this share of a person's area is ignored
MOST = 6  # most people found in one region in a frame
LOWEST = 0.98  # quantile of the rows of a part's pixels at which its foot is guessed
ROAM = 0.25  # standard deviation of a first guess, of a person's height


def template_mask(shape: tuple[int, ...], templates: Array) -> Bools:
    """Returns an (H, W) bool mask, True where an ellipse of the templates (K, 4) x, foot, h, w, px, covers a pixel's
    centre."""
    cover = np.zeros(shape, np.int16)
    kernels.paint_all(cover, templates, 1)
    return cover > 0


def find_new_people(foreground: Bools, cover: Cover, size: PersonSize, support: float) -> Array:
    """Returns the templates (K, 4) x, foot, h, w, px, of new people in the foreground (H, W) that no template and no
    blob explains; paints them into `cover` (H, W)."""
    found = blobs.find(foreground & (cover == 0), LEAST * SMALLEST**2 * SLIM * ELLIPSE)
    box = found.box
    h, w = size.at(np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)).T
    person = ELLIPSE * h * w
    rows = np.flatnonzero(found.area >= LEAST * person)
    if not len(rows):
        return np.zeros((0, 4))
    most = np.minimum((found.area[rows] / person[rows]).astype(int) + 2, MOST)
    guesses = [_guesses(found, row, n, size) for row, n in zip(rows.tolist(), most.tolist(), strict=True)]
    regions = zip(guesses, person[rows], strict=True)
    return np.concatenate([_in_region(foreground, cover, *region, support) for region in regions])


def _in_region(foreground: Bools, cover: Cover, guesses: Array, person: float, support: float) -> Array:
    known = np.asarray(np.isfinite(guesses).all(1))
    sure = len(known) if known.all() else int(known.argmin())
    most = int((np.sqrt(8 * sure + 1) - 1) / 2)  # 1 + 2 + ... + most <= sure
    guesses = guesses[: most * (most + 1) // 2]
    spread = np.maximum(ROAM * guesses[:, 2:3], 1.0) * np.ones(2)
    return new.fit_new_people(foreground, cover, guesses, most, person, support, spread)


def _guesses(found: blobs.Blobs, row: int, most: int, size: PersonSize) -> Array:
    """Returns first places of 1, 2, … `most` people in a region, who stand in parts of as many pixels each."""
    inside, corner = found.label[found.window(row)] == row + 1, found.box[row, :2].astype(int)
    if size.above:
        at = np.argwhere(inside)[:, ::-1] + corner + 0.5
        along = at @ np.linalg.eigh(np.cov(at.T - 0.5))[1][:, -1]
        middle = np.array([part.mean(0) for part in _parts(at[np.argsort(along, kind="stable")], most)])
        extent = size.at(middle)
        return np.column_stack([middle[:, 0], middle[:, 1] + extent[:, 0] / 2, extent])
    at = np.argwhere(inside.T) + corner  # column by column
    stand = np.array([[part[:, 0].mean() + 0.5, _lowest(part[:, 1]) + 1] for part in _parts(at, most)])
    return np.column_stack([stand, size.at(stand)])


def _parts(at: Any, most: int) -> list[Any]:
    return [part for n in range(1, most + 1) for part in np.array_split(at, n)]


def _lowest(rows: Ints) -> float:
    """Returns numpy's quantile LOWEST of rows (N,), in a tenth of its time."""
    last = LOWEST * (len(rows) - 1)
    ends = int(last), min(int(last) + 1, len(rows) - 1)
    low, high = np.partition(rows, ends)[list(ends)].tolist()
    part = last - ends[0]
    return float(low + (high - low) * part if part < 0.5 else high - (high - low) * (1 - part))
