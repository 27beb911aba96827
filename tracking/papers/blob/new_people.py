"""Who is new in the foreground that no track explains, and how many they are: for `blob` from pixels (ours).

A region left over is tried with 1, 2, ... templates of the size that a person has there, side by side to begin with,
each where its columns reach down to (from above: in a row along the region's longer axis), then moved in turn to where
they explain most. The number is the one whose templates together explain most, each costing `support` of a whole
person; none may have less.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.detect import blobs as detect
from tracking.detect.person_size import SLIM, SMALLEST, PersonSize
from tracking.papers.blob import new_people_kernels as kernels
from tracking.papers.blob.person_template import ELLIPSE, ExplainedForeground

LEAST = 0.3  # of a person's area: a smaller region is nobody
MOST = 6  # people found in one region and frame
ROAM = 0.25  # of a person's height, the deviation of a first guess
EVIDENCE = 1000.0  # nats of full support: so many that a first guess holds nobody back


def find_new_people(scene: ExplainedForeground, size: PersonSize, support: float) -> Array:
    """(K, 4) templates of new people, painted; `support` is what each needs."""
    found = detect.find(scene.unexplained(), LEAST * SMALLEST**2 * SLIM * ELLIPSE)
    box = found.box
    h, w = size.at(np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)).T
    person = ELLIPSE * h * w
    rows = np.flatnonzero(found.area >= LEAST * person)
    if not len(rows):
        return np.zeros((0, 4))
    most = np.minimum((found.area[rows] / person[rows]).astype(int) + 2, MOST)
    guesses = _guesses(found, rows, most, size)
    return np.concatenate([_in_region(scene, g, p, support) for g, p in zip(guesses, person[rows], strict=True)])


def _in_region(scene: ExplainedForeground, guesses: Array, person: float, support: float) -> Array:
    """(K, 4) as many of a region's newcomers as explain most, out of guesses for 1, 2, ... of them, painted."""
    known = np.asarray(np.isfinite(guesses).all(1))
    sure = len(known) if known.all() else int(known.argmin())
    most = int((np.sqrt(8 * sure + 1) - 1) / 2)  # 1 + 2 + ... + most <= sure
    guesses = guesses[: most * (most + 1) // 2]
    spread = np.maximum(ROAM * guesses[:, 2:3], 1.0) * np.ones(2)
    return kernels.fit_new_people(scene.foreground, scene.cover, guesses, most, person, support, spread, EVIDENCE)


def _guesses(found: detect.Blobs, rows: Ints, most: Ints, size: PersonSize) -> list[Array]:
    """For each of these regions (1 + 2 + ... + most, 4) templates: 1, 2, ... `most` that share its pixels evenly."""
    if size.above:
        return [_from_above(found, row, n, size) for row, n in zip(rows.tolist(), most.tolist(), strict=True)]
    box = found.box.astype(int)
    feet = [kernels.part_feet(found.label, k + 1, box[k], n) for k, n in zip(rows.tolist(), most.tolist(), strict=True)]
    stand = np.concatenate(feet)
    return np.split(np.column_stack([stand, size.at(stand)]), np.cumsum([len(f) for f in feet])[:-1])


def _from_above(found: detect.Blobs, row: int, most: int, size: PersonSize) -> Array:
    """The same along the longer axis of a region's pixels, each template in the middle of as many."""
    left, top, wide, high = found.box[row].astype(int)
    at = np.argwhere(found.label[top : top + high, left : left + wide] == row + 1)[:, ::-1] + (left, top) + 0.5
    axis = np.linalg.eigh(np.cov(at.T))[1][:, -1]
    order = np.argsort(at @ axis, kind="stable")
    middle = np.array([at[p].mean(0) for n in range(1, most + 1) for p in np.array_split(order, n)])
    extent = size.at(middle)
    return np.column_stack([middle[:, 0], middle[:, 1] + extent[:, 0] / 2, extent])
