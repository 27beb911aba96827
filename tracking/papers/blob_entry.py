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
from tracking.papers.blob_size import SLIM, SMALLEST, PersonSize
from tracking.papers.blob_template import ELLIPSE, Mask

LEAST = 0.3  # of a person's area: a smaller region is nobody
MOST = 6  # people found in one region and frame
ROAM = 0.25  # of a person's height, the deviation of a first guess
EVIDENCE = 1000.0  # nats of full support: so many that a first guess holds nobody back


def newcomers(scene: Mask, size: PersonSize, support: float) -> Array:
    """(K, 4) templates of new people, painted; `support` is what each needs."""
    left = (scene.gain > 0) & (scene.cover == 0)
    found = detect.find(left, LEAST * SMALLEST**2 * SLIM * ELLIPSE) if left.any() else None
    made = [np.zeros((0, 4))]
    if found is not None:
        box = found.box
        h, w = size.at(np.stack([box[:, 0] + box[:, 2] / 2, box[:, 1] + box[:, 3]], 1)).T
        person = ELLIPSE * h * w
        for k in np.flatnonzero(found.area >= LEAST * person).tolist():
            x, y, wide, high = box[k].astype(int)
            rows, columns = np.nonzero(found.label[y : y + high, x : x + wide] == k + 1)
            made.append(_in_region(scene, rows + y, columns + x, float(person[k]), size, support))
    return np.concatenate(made)


def _in_region(scene: Mask, rows: Ints, columns: Ints, person: float, size: PersonSize, support: float) -> Array:
    best, worth = np.zeros((0, 4)), 0.0
    for count in range(1, min(int(len(rows) / person) + 2, MOST) + 1):
        at = _guess(rows, columns, count, size)
        if not np.isfinite(at).all():
            break
        at = scene.settle(at, np.maximum(ROAM * at[:, 2:3], 1.0) * np.ones(2), EVIDENCE)
        alone = scene.alone(at)
        scene.paint(at, -1)
        value = _explained(scene, at) / person - count * support
        if value > worth and alone.min() >= support:
            best, worth = at, value
    scene.paint(best)
    return best


def _guess(rows: Ints, columns: Ints, count: int, size: PersonSize) -> Array:
    """(count, 4) templates side by side over a region's pixels, each with as many, standing where these end."""
    if size.above:
        return _from_above(rows, columns, count, size)
    order = np.argsort(columns, kind="stable")
    parts = np.array_split(order, count)
    foot = np.array([[columns[p].mean() + 0.5, np.quantile(rows[p], 0.98) + 1] for p in parts])
    return np.column_stack([foot, size.at(foot)])


def _from_above(rows: Ints, columns: Ints, count: int, size: PersonSize) -> Array:
    """(count, 4) templates along the longer axis of a region's pixels, each in the middle of as many."""
    at = np.column_stack([columns, rows]) + 0.5
    axis = np.linalg.eigh(np.cov(at.T))[1][:, -1]
    parts = np.array_split(np.argsort(at @ axis, kind="stable"), count)
    found = np.array([at[p].mean(0) for p in parts])
    extent = size.at(found)
    return np.column_stack([found[:, 0], found[:, 1] + extent[:, 0] / 2, extent])


def _explained(scene: Mask, at: Array) -> float:
    """Sum of what pixels are worth that these templates cover; none of them painted."""
    total = 0.0
    for k in range(len(at)):
        total += float((scene.support(at[k : k + 1]) * scene.area(at[k : k + 1]))[0])
        scene.paint(at[k : k + 1])
    scene.paint(at, -1)
    return total
