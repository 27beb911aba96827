"""Splitting of `stereo`'s groups (ours: the paper has no split).

A group splits if its points are two or more groups by eq. 12 for `split_time`, and if these would not all merge again
at once by eq. 13. All parts are newborn from their points, with the velocity of the group and its covariance. The part
with most points (then the one nearest to the group's position) keeps the id; the others are its children.
"""

from __future__ import annotations

import numpy as np

from sim.types import Ints
from tracking.detect.features import SpacePoints
from tracking.papers.stereo.measurement import VEL, Measurement
from tracking.papers.stereo.merging import connected
from tracking.papers.stereo.space_group import Motion3D, SpaceGroup, newborn


def split(
    group: SpaceGroup, points: SpacePoints, part: Ints, measurement: Measurement, motion: Motion3D, t: float
) -> list[SpaceGroup]:
    """Returns the children of a group whose M points have been in parts for `split_time`, [] if it does not split."""
    count = int(part.max(initial=-1)) + 1
    if count < 2 or not motion.config.split:
        group.apart_since = float("nan")
        return []
    if np.isnan(group.apart_since):
        group.apart_since = t
    if t - group.apart_since < motion.config.split_time - 1e-9:
        return []
    away = [float(np.linalg.norm(points.pos[part == k].mean(0) - group.pos)) for k in range(count)]
    largest = int(np.lexsort((np.array(away), -np.bincount(part[part >= 0])))[0])
    born = [newborn(points.at(part == k), measurement, motion, t) for k in range(count)]
    for child in born:
        child.ekf.x[VEL] = group.ekf.x[VEL]
        child.ekf.P[np.ix_(VEL, VEL)] = group.ekf.P[np.ix_(VEL, VEL)]
        child.first_seen, child.measured_time = group.apart_since, group.measured_time
    if [len(parts) for parts in connected(born, motion.config.merge_gate)] == [count]:
        return []
    own = born.pop(largest)
    group.ekf, group.spread, group.count, group.members = own.ekf, own.spread, own.count, own.members
    group.apart_since = float("nan")
    for child in born:
        child.parent = group.id
    return born
