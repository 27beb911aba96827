"""Groups in the image: hulls of their members' silhouettes, mean positions, extents, all frames at once.

They are computed from the groups on the ground, the people's bodies and the camera. A silhouette is two polygons of
POINTS (24) vertices, inscribed in the ellipses of body and head. The hull of these polygons is exact.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from sim.scene.body import Ellipsoids, Outlines, contour, outlines
from sim.scene.camera import project
from sim.types import Array, Camera, Groups, Ints, Truth

POINTS = 24  # vertices of each polygon
INSTANT = 0.02  # s: half the step by which ground velocities become image velocities


def image_groups(truth: Truth, ground: tuple[Groups, ...], camera: Camera, shapes: Ellipsoids) -> tuple[Groups, ...]:
    """Returns the Groups of each frame as the camera sees them, with the ids, members and sizes of the ground groups.

    shapes: ellipsoids of body and head, in the order of the truth's rows. pos and extent: of the boxes' middles, px.
    hull: of the silhouettes, empty if a member is not wholly in front of the camera.
    """
    assert truth.box is not None
    assert truth.vel is not None
    rows, cuts = _members(truth, ground)
    centre = (truth.box[:, :2] + truth.box[:, 2:] / 2)[rows]
    vel = image_velocities(camera, shapes.centre[rows, 0], truth.vel[rows])
    pos, speed = _means(centre, cuts), _means(vel, cuts)
    off = centre - np.repeat(pos, np.diff(cuts), axis=0)
    extent = _means(off[:, :, None] * off[:, None, :], cuts)
    hull = hulls(outlines(camera, Ellipsoids(shapes.centre[rows], shapes.shape[rows])), cuts)
    ends = np.cumsum([0, *(len(groups.id) for groups in ground)])
    return tuple(
        groups.replace(pos=pos[a:b], vel=speed[a:b], extent=extent[a:b], hull=tuple(hull[a:b]))
        for groups, (a, b) in zip(ground, pairwise(ends), strict=True)
    )


def _members(truth: Truth, ground: tuple[Groups, ...]) -> tuple[Ints, Ints]:
    """Returns the truth's rows of all groups' members, and where each of the G groups begins in them (G + 1,)."""
    starts = np.searchsorted(truth.frame, np.arange(1, len(ground) + 1))
    rows, sizes = [np.zeros(0, np.int64)], [0]
    for index, (start, groups) in enumerate(zip(starts, ground, strict=True), start=1):
        if len(groups.id):
            sizes += [len(members) for members in groups.members]
            rows.append(start + np.searchsorted(truth.id[truth.rows(index)], np.concatenate(groups.members)))
    return np.concatenate(rows), np.cumsum(sizes)


def _means(values: Array, cuts: Ints) -> Array:
    count = np.diff(cuts).reshape(-1, *[1] * (values.ndim - 1))
    return np.asarray(np.add.reduceat(values, cuts[:-1], axis=0) / count) if len(count) else values[:0]


def hulls(ellipses: Outlines, cuts: Ints) -> list[Array]:
    """Returns the convex hull (V, 2) px of each group of silhouettes. cuts (G + 1,): where each group begins."""
    from sim.geometry import hull_kernels

    edge = contour(ellipses, POINTS)[: cuts[-1]]
    sets = np.split(edge.reshape(-1, 2), edge.shape[1] * cuts[1:])
    return list(hull_kernels.convex_hulls(sets[:-1]))


def image_velocities(camera: Camera, middle: Array, vel: Array) -> Array:
    """Returns the velocities (N, 2) px/s in the image of points middle (N, 3) m that move at vel (N, 2) m/s."""
    step = INSTANT * np.column_stack([vel, np.zeros(len(vel))])
    return np.asarray((project(camera, middle + step)[0] - project(camera, middle - step)[0]) / (2 * INSTANT))
