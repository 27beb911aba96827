"""New people in the foreground that no track explains, and how many they are: for `blob` from pixels (ours).

Each unexplained region is tried with 1, 2, … templates of a person's size at its place. They start side by side, each
where its columns of the region reach down to (from straight above: in a row along the region's longer axis). Then they
move in turn to where they explain most (person_template). The number is chosen whose templates together explain most:
the sum over covered pixels (foreground 1, background -1/2), where each template costs the share `support` of a person's
area. No template may have less support than that.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Ints
from tracking.detect import blobs
from tracking.detect.person_size import SLIM, SMALLEST, PersonSize
from tracking.papers.blob import new_people_kernels as kernels
from tracking.papers.blob.person_template import ExplainedForeground
from tracking.papers.blob.person_template_kernels import ELLIPSE

LEAST = 0.3  # a region smaller than this share of a person's area is ignored
MOST = 6  # most people found in one region in a frame
ROAM = 0.25  # standard deviation of a first guess, of a person's height
EVIDENCE = 1000.0  # log-likelihood of full support: so large that the first guess hardly restrains a template


def find_new_people(scene: ExplainedForeground, size: PersonSize, support: float) -> Array:
    """Returns the templates (K, 4) x, foot (row of the lower edge), h, w, px, of new people, and paints them into
    `scene`."""
    found = blobs.find(scene.unexplained(), LEAST * SMALLEST**2 * SLIM * ELLIPSE)
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
    known = np.asarray(np.isfinite(guesses).all(1))
    sure = len(known) if known.all() else int(known.argmin())
    most = int((np.sqrt(8 * sure + 1) - 1) / 2)  # 1 + 2 + ... + most <= sure
    guesses = guesses[: most * (most + 1) // 2]
    spread = np.maximum(ROAM * guesses[:, 2:3], 1.0) * np.ones(2)
    return kernels.fit_new_people(scene.foreground, scene.cover, guesses, most, person, support, spread, EVIDENCE)


def _guesses(found: blobs.Blobs, rows: Ints, most: Ints, size: PersonSize) -> list[Array]:
    if size.above:
        return [_from_above(found, row, n, size) for row, n in zip(rows.tolist(), most.tolist(), strict=True)]
    box = found.box.astype(int)
    feet = [kernels.part_feet(found.label, k + 1, box[k], n) for k, n in zip(rows.tolist(), most.tolist(), strict=True)]
    stand = np.concatenate(feet)
    return np.split(np.column_stack([stand, size.at(stand)]), np.cumsum([len(f) for f in feet])[:-1])


def _from_above(found: blobs.Blobs, row: int, most: int, size: PersonSize) -> Array:
    left, top, wide, high = found.box[row].astype(int)
    at = np.argwhere(found.label[top : top + high, left : left + wide] == row + 1)[:, ::-1] + (left, top) + 0.5
    axis = np.linalg.eigh(np.cov(at.T))[1][:, -1]
    order = np.argsort(at @ axis, kind="stable")
    middle = np.array([at[p].mean(0) for n in range(1, most + 1) for p in np.array_split(order, n)])
    extent = size.at(middle)
    return np.column_stack([middle[:, 0], middle[:, 1] + extent[:, 0] / 2, extent])
