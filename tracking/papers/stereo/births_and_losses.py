"""Births, confirmation and deletion of `stereo`'s groups (ours, except for the initial grouping).

A new group is tentative, without an id, until it has been measured for `confirm_time`. A group that has not been
measured for `coast_time`, a tentative one for `confirm_time`, is deleted.
"""

from __future__ import annotations

from sim.types import Ints
from tracking.detect.features import SpacePoints
from tracking.grouping.whole_groups import NO_ID, GroupIds, WholeGroupEvent
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.measurement import Measurement
from tracking.papers.stereo.space_group import Motion3D, SpaceGroup, newborn


def born(points: SpacePoints, group: Ints, measurement: Measurement, motion: Motion3D, t: float) -> list[SpaceGroup]:
    """Return the tentative groups that free points form (sec. 3.4)."""
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
