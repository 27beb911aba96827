"""Truth of recordings with labelled groups: hulls and events, measured as for simulated crowds.

A label says who belongs together. When such people form a group, and their events, are measured from the motion. The
rules are in metres, so a recording in px is divided by its px_per_m and the result multiplied by it.
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from scenarios.limits import COORDINATE
from sim.geometry.boxes import centres
from sim.truth.velocities import CHORD, differentiate
from sim.types import Array, GroupEvent, Groups, Ints, Truth

NEAR = 0.15  # m: bodies do not come so near, from middle to middle
SAMPLE, LEAST = 1000, 10  # frames in which neighbours are sought, and rows that are needed for it

SOME = 4  # people who are not all within one metre, on one line along an axis, or in haste
# m/s: a median speed above it is no crowd's. It is 0.6 to 1.4 in seq_hotel, zara01, mwt1gt, PETS09, TownCentre and
# TUD-Campus.
RUN = 3.0


def warn_of_places(file: Path, truth: Truth) -> None:
    """Warns if a file's positions and velocities can hardly be on the ground in m and m/s."""
    doubt = "" if truth.pos is None or truth.vel is None else _doubt(truth.frame, truth.id, truth.pos, truth.vel)
    if doubt:
        warnings.warn(f"{file}: positions of people: {doubt}", stacklevel=4)


def _doubt(frame: Ints, id: Ints, pos: Array, vel: Array) -> str:
    known = np.isfinite(pos + vel).all(axis=1)
    near = _distance_of_neighbours(frame[known], pos[known])
    if near < NEAR:
        return f"half are within {near:.2g} m of another: write metres, or name the unit, as x_km,y_km"
    if len(np.unique(id[known])) < SOME:
        return ""
    span, speed = np.ptp(pos[known], axis=0), np.median(np.hypot(*vel[known].T))
    if span.max() <= 1:
        return "all are within 1 m: write metres, if they are shares of a picture or degrees"
    if span.min() == 0:
        return f"all have the same {'xy'[span.argmin()]}: give x and y on the ground, if it is the height"
    return f"their median speed is {speed:.3g} m/s: check their unit, and the frame rate" if speed > RUN else ""


def _distance_of_neighbours(frame: Ints, pos: Array) -> float:
    """Returns the median distance (m) from people to the nearest person of the frame, in at most SAMPLE frames."""
    from scipy.spatial import cKDTree

    frames = np.unique(frame)
    if len(frame) < LEAST or len(frames) == len(frame):
        return np.inf
    some = np.isin(frame, frames[:: -(-len(frames) // SAMPLE)])
    # Frames are so far apart that the nearest point is one of the same frame, if it has one.
    place = np.column_stack([frame[some] * 4 * COORDINATE, pos[some]])
    return float(np.median(cKDTree(place).query(place, 2)[0][:, 1]))


def labelled_truth_fields(
    frame: Ints, id: Ints, label: Ints, pos: Array, vel: Array, *, fps: float, length: int, px_per_m: float = 1.0
) -> dict[str, Any]:
    """Returns by name the fields groups, events, near and labelled of the Truth of a recording with group labels.

    frame (from 1), id, label (R,): rows sorted by (frame, id); label is the person's group, -1 for alone. pos, vel (R,
    2): m and m/s, or px and px/s if `px_per_m` is given; results have the same unit. Crossings and queues are those of
    the labelled groups, other events those of the groups that are measured from motion and labels.
    """
    from sim.truth.crossing_events import crossings
    from sim.truth.group_hulls import groups_over_time
    from sim.truth.merge_split_events import groups_and_events
    from sim.truth.motion_rows import MotionRows
    from sim.truth.queue_detection import queues

    metres, speed = pos / px_per_m, vel / px_per_m
    people = np.unique(id)
    column = np.searchsorted(people, id)
    intent = np.where(label >= 0, label, label.max(initial=0) + 1 + column)
    meant, rows = (MotionRows.of(frame - 1, column, metres, speed, g, length) for g in (intent, label))
    measured = groups_and_events(meant, fps)
    distinct = zip(*np.unique(measured.group[meant.find(column, frame - 1)], return_index=True), strict=True)
    names = {int(g): int(label[k]) for g, k in distinct if g >= 0}
    found = [_named(e, names, people, px_per_m) for e in measured.events]
    met = crossings(rows, fps) + queues(rows, fps)
    found += [_named(e, {}, people, px_per_m) for e in met]
    events = tuple(sorted(found, key=lambda e: (e.start, e.end, e.kind, e.members, e.after)))
    near = replace(measured.near, a=people[measured.near.a - 1], b=people[measured.near.b - 1])
    groups = tuple(scale_groups(g, px_per_m) for g in groups_over_time(frame, id, label, metres, speed, 1, length))
    return {"groups": groups, "events": events, "near": near, "labelled": np.ones(length, bool)}


def with_labels(truth: Truth, label: Ints) -> Truth:
    """Returns a truth with the group labels (R,) of its rows, -1 for alone, and the groups and events that follow.

    They are measured on the ground if all positions are known, else from the centres of the boxes (px).
    """
    from sim.truth.group_hulls import box_groups

    truth = truth.replace(group=label)
    rows, pos, vel, fps, length = (truth.frame, truth.id, label), truth.pos, truth.vel, truth.fps, truth.length
    if not len(label):
        return truth
    steps = np.diff(np.unique(truth.frame))
    if len(steps) and steps.min() > 1:
        words = "people come and go in each: number the frames 1, 2, 3, … for groups and events"
        warnings.warn(f"{truth.name}: labels are {steps.min()} frames apart or more; {words}", stacklevel=2)
    if pos is not None and vel is not None and np.isfinite(pos).all():
        return truth.replace(**labelled_truth_fields(*rows, pos, vel, fps=fps, length=length))
    assert truth.box is not None, "a row without box has a position"
    pos = centres(truth.box)
    vel = differentiate(truth.frame, truth.id, pos, fps, CHORD)
    known = labelled_truth_fields(*rows, pos, vel, fps=fps, length=length, px_per_m=truth.px_per_m)
    shapes = box_groups(*rows, pos, vel, truth.box, 1, length)
    return truth.replace(**{**known, "groups": None}, groups_px=tuple(shapes))


def _named(event: GroupEvent, names: dict[int, int], people: Ints, px_per_m: float) -> GroupEvent:
    """Returns the event with the recording's person ids, group labels and unit."""
    before, after = (tuple(sorted(names.get(g, g) for g in ids)) for ids in (event.before, event.after))
    members, (x, y) = tuple(int(people[m - 1]) for m in event.members), event.pos
    return replace(event, before=before, after=after, members=members, pos=(x * px_per_m, y * px_per_m))


def scale_groups(groups: Groups, factor: float) -> Groups:
    """Returns groups with positions, velocities and hulls multiplied by `factor`, and extents by its square."""
    if factor == 1 or not len(groups.id):
        return groups
    hull, extent = tuple(h * factor for h in groups.hull), groups.extent * factor**2
    return groups.replace(pos=groups.pos * factor, vel=groups.vel * factor, extent=extent, hull=hull)
