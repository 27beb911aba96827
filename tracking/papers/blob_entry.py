"""Who is new in the foreground that no track explains, and how many they are: for `blob` from pixels (ours).

A region left over is tried with 1, 2, ... templates of the size that a person has there, side by side to begin with,
each where its columns reach down to, then moved in turn to where they explain most. The number is the one whose
templates together explain most, each costing `support` of a whole person; none may have less.
"""

from __future__ import annotations

import numpy as np

from sim.types import Array, Bools
from tracking.detect import blobs as detect
from tracking.papers.blob_size import PersonSize
from tracking.papers.blob_template import ELLIPSE, Mask

LEAST = 0.3  # of a person's area: a smaller region is nobody
MOST = 6  # people found in one region and frame
ROAM = 0.25  # of a person's height, the deviation of a first guess
EVIDENCE = 1000.0  # nats of full support: so many that a first guess holds nobody back


def newcomers(scene: Mask, size: PersonSize, support: float) -> Array:
    """(K, 4) templates of new people, painted; `support` is what each needs."""
    left = (scene.gain > 0) & (scene.cover == 0)
    found = detect.find(left, 1.0) if left.any() else None
    made = [np.zeros((0, 4))]
    for k in range(0 if found is None else len(found)):
        assert found is not None
        made.append(_in_region(scene, found.label == k + 1, found.box[k], float(found.area[k]), size, support))
    return np.concatenate(made)


def _in_region(scene: Mask, region: Bools, box: Array, area: float, size: PersonSize, support: float) -> Array:
    left, top, wide, high = box
    h, w = size.at(np.array([[left + wide / 2, top + high]]))[0]
    person = ELLIPSE * h * w
    if not area >= LEAST * person:
        return np.zeros((0, 4))
    best, worth = np.zeros((0, 4)), 0.0
    rows, columns = np.nonzero(region[int(top) : int(top + high), int(left) : int(left + wide)])
    for count in range(1, min(int(area / person) + 2, MOST) + 1):
        at = _guess(rows + top, columns + left, count, size)
        at = scene.settle(at, np.maximum(ROAM * at[:, 2:3], 1.0) * np.ones(2), EVIDENCE)
        alone = scene.alone(at)
        scene.paint(at, -1)
        value = _explained(scene, at) / person - count * support
        if value > worth and alone.min() >= support:
            best, worth = at, value
    scene.paint(best)
    return best


def _guess(rows: Array, columns: Array, count: int, size: PersonSize) -> Array:
    """(count, 4) templates side by side over a region's pixels, each with as many, standing where these end."""
    order = np.argsort(columns, kind="stable")
    parts = np.array_split(order, count)
    foot = np.array([[columns[p].mean() + 0.5, np.quantile(rows[p], 0.98) + 1] for p in parts])
    return np.column_stack([foot, size.at(foot)])


def _explained(scene: Mask, at: Array) -> float:
    """Sum of what pixels are worth that these templates cover; none of them painted."""
    total = 0.0
    for k in range(len(at)):
        total += float((scene.support(at[k : k + 1]) * scene.area(at[k : k + 1]))[0])
        scene.paint(at[k : k + 1])
    scene.paint(at, -1)
    return total
