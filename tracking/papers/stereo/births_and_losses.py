"""Initial grouping, births, confirmation and deletion of `stereo`'s groups; ours, except for the initial grouping.

Points in space whose spheres of radius r overlap are linked (eq. 12, sec. 3.4): those at most 2 r apart. The groups are
the connected components with enough points.

A new group is tentative, without an id, until it has been measured for `confirm_time`. A group that has not been
measured for `coast_time`, a tentative one for `confirm_time`, is deleted.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from sim.types import Array, Ints
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.measurement import Measurement
from tracking.papers.stereo.space_group import Motion3D, SpaceGroup, newborn


def born(points: SpacePoints, group: Ints, measurement: Measurement, motion: Motion3D, t: float) -> list[SpaceGroup]:
    """Returns the tentative groups that free points form (sec. 3.4)."""
    return [newborn(points.at(group == k), measurement, motion, t) for k in range(int(group.max(initial=-1)) + 1)]


def confirm(groups: list[SpaceGroup], config: StereoConfig, t: float, ids: GroupIds) -> list[WholeGroupEvent]:
    """Give ids to tentative groups that have been measured for `confirm_time`, and return the events."""
    events, alive = [], {g.id for g in groups if g.confirmed}
    for g in groups:
        if g.confirmed or g.last_seen < t or g.measured_time < config.confirm_time - 1e-9:
            continue
        g.id = ids.new()
        pos = (float(g.pos[0]), float(g.pos[1]))
        if g.parent in alive:
            events.append(WholeGroupEvent("split", g.first_seen, (g.parent,), tuple(sorted((g.parent, g.id))), pos))
        else:
            events.append(WholeGroupEvent("enter", g.first_seen, (), (g.id,), pos))
    return events


def remove_lost(groups: list[SpaceGroup], config: StereoConfig, t: float) -> list[WholeGroupEvent]:
    """Delete groups without measurements for too long, in place, and return the leave events of confirmed ones."""
    events, kept = [], []
    for g in groups:
        if t - g.last_seen <= (config.coast_time if g.confirmed else config.confirm_time) + 1e-9:
            kept.append(g)
        elif g.id != NO_ID:
            events.append(WholeGroupEvent("leave", t, (g.id,), (), (float(g.pos[0]), float(g.pos[1]))))
    groups[:] = kept
    return events


def sphere_groups(pos: Array, radius: float, least: int) -> Ints:
    """Returns the group of each point, (M,), numbered 0, 1, … in the order of the groups' first points; -1 for none."""
    M = len(pos)
    if not M:
        return np.zeros(0, np.int64)
    if np.square(np.ptp(pos, axis=0)).sum() <= (2 * radius) ** 2:  # all of them are linked
        return np.full(M, 0 if least <= M else -1)
    i, j = cKDTree(pos).query_pairs(2 * radius, output_type="ndarray").T
    label = connected_components(coo_array((np.ones(len(i)), (i, j)), (M, M)), directed=False)[1]
    large = np.bincount(label) >= least
    _, first = np.unique(label, return_index=True)
    rank = np.full(len(large), -1)
    order = np.argsort(first)
    rank[order[large[order]]] = np.arange(large.sum())
    return np.asarray(rank[label], np.int64)
