"""Makes the truth of a motion: bodies as the camera sees them, and groups and events as they are measured.

`bodies` gives the part that sensors need; `label` adds groups, events and hard negatives (strangers who walk like a
group). The times of orders are not used; sim.truth.order_fulfilment checks afterwards whether the orders came true.
Hulls of groups in the image are those of their members' silhouettes: polygons of POINTS (24) vertices inscribed in the
ellipses of body and head, or of POINTS_OF_LIMB (8) in each of more parts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import astuple, replace

import numpy as np

from sim.clock import FrameTicks
from sim.scene.body import Ellipsoids, Outlines, RecordedBodies, contour, outlines, recorded_bodies, recorded_things
from sim.scene.camera import project, px_per_m_at_centre, scale_of_all_boxes
from sim.scene.camera_motion import MovingCamera, View, by_frame, camera_at
from sim.scene.visibility import BodyVisibility, measure_visibility
from sim.truth.group_hulls import groups_in_hulls, groups_over_time
from sim.truth.merge_split_events import GroupsAndEvents
from sim.truth.motion_rows import MotionRows
from sim.truth.order_fulfilment import fulfilment
from sim.types import Array, Bools, Camera, GroupEvent, Groups, Ints, Motion, Near, Order, Truth

POINTS, POINTS_OF_LIMB = 24, 8  # vertices of each polygon
INSTANT = 0.02  # s: half the step by which ground velocities become image velocities


def image_groups(truth: Truth, view: View, shapes: Ellipsoids) -> tuple[Groups, ...]:
    """Returns the Groups of each frame as the camera sees them.

    shapes: ellipsoids of body and head, one row for each row of the truth. Of the result, pos and extent are those of
    the middles of the members' boxes, px; hull is the convex hull of their silhouettes, empty if a member is not wholly
    in front of the camera.
    """
    assert truth.box is not None
    assert truth.vel is not None

    def silhouettes(rows: Ints, starts: Ints) -> list[Array]:
        seen = [
            outlines(camera, Ellipsoids(shapes.centre[rows[r]], shapes.shape[rows[r]]))
            for camera, r in by_frame(view, truth.frame[rows], truth.fps)
        ]
        return hulls(Outlines(*(np.concatenate(part) for part in zip(*map(astuple, seen), strict=True))), starts)

    middle = truth.box[:, :2] + truth.box[:, 2:] / 2
    vel = np.concatenate([np.zeros((0, 2)), *_image_velocities(truth, view, shapes.centre[:, 0])])
    rows = truth.frame, truth.id, truth.group
    return tuple(groups_in_hulls(*rows, middle, vel, silhouettes, 1, truth.length))


def hulls(ellipses: Outlines, starts: Ints) -> list[Array]:
    """Returns the convex hull (V, 2) px of each of G groups. starts (G,): the first row of each in `ellipses`."""
    from sim.geometry import hull_kernels

    points = contour(ellipses, POINTS if ellipses.centre.shape[1] == 2 else POINTS_OF_LIMB)
    return list(hull_kernels.convex_hulls([p.reshape(-1, 2) for p in np.split(points, starts[1:])]))


def _image_velocities(truth: Truth, view: View, middle: Array) -> Iterator[Array]:
    assert truth.vel is not None
    for camera, r in by_frame(view, truth.frame, truth.fps):
        t = 0.0 if not len(truth.frame) else (int(truth.frame[r][0]) - 1) / truth.fps
        near = (camera, camera) if view is camera else (camera_at(view, t - INSTANT), camera_at(view, t + INSTANT))
        yield image_velocities(near[0], middle[r], truth.vel[r], near[1])


def image_velocities(camera: Camera, middle: Array, vel: Array, after: Camera | None = None) -> Array:
    """Returns the velocities (N, 2) px/s in the image of points middle (N, 3) m that move at vel (N, 2) m/s.

    camera, after: INSTANT before and after; None: the same camera.
    """
    step = INSTANT * np.column_stack([vel, np.zeros(len(vel))])
    after = camera if after is None else after
    return np.asarray((project(after, middle + step)[0] - project(camera, middle - step)[0]) / (2 * INSTANT))


def bodies(motion: Motion, view: View | None, people: RecordedBodies | None = None) -> Truth:
    """Returns a Truth with positions, boxes and visibility of everybody in every frame, but without groups.

    view: the camera. Without one, boxes are None and visibility is 1. people: the bodies of the motion; None: they are
    computed.
    """
    people = recorded_bodies(motion) if people is None else people
    t, p = people.frame - 1, people.id - 1
    box, visibility, truncation, visible_box = (None, np.ones(len(p)), None, None) if view is None else (
        _seen(motion, view, people)
    )  # fmt: skip
    return Truth(
        name=motion.name, fps=motion.fps, length=len(motion.present),
        px_per_m=float("nan") if view is None else _scale(view, box), frame=people.frame, id=people.id,
        group=np.full(len(p), -1, np.int64), subgroup=_subgroups(motion, t, p),
        pos=motion.pos[t, p], vel=motion.vel[t, p],
        box=box, visibility=visibility, z=people.pos3[:, 2], heading=motion.heading[t, p], height=motion.height[p],
        truncation=truncation, visible_box=visible_box, orders=motion.orders,
    )  # fmt: skip


def _seen(motion: Motion, view: View, people: RecordedBodies) -> BodyVisibility:
    parts = []
    for camera, r in by_frame(view, people.frame, motion.fps):
        shapes = Ellipsoids(people.shapes.centre[r], people.shapes.shape[r])
        first = int(people.frame[r][0]) if view is not camera and len(people.frame) else 1
        things = recorded_things(motion, first, None if view is camera else first + 1)
        known = people.frame[r], people.pos3[r], motion.height[people.id[r] - 1], shapes
        parts.append(measure_visibility(camera, motion.scene, *known, things))
    return BodyVisibility(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _scale(view: View, box: Array | None) -> float:
    """Returns the image scale, px per m; of a moving camera that of the boxes whose whole bodies are known."""
    if isinstance(view, Camera) or box is None:
        return px_per_m_at_centre(camera_at(view, 0.0))
    return scale_of_all_boxes(box[np.isfinite(box).all(axis=1), 3])


def _subgroups(motion: Motion, t: Ints, p: Ints) -> Ints | None:
    """Returns the number of the sub-group (R,), from 1 in the order of the script, of persons p in frames t.

    -1 for a person without, or who is alone in it in this frame; None if no group has sub-groups. t, p (R,): from 0.
    """
    if motion.subgroup is None:
        return None
    own, people = motion.subgroup[t, p], np.zeros((len(motion.present), int(motion.subgroup.max(initial=0)) + 1), int)
    inside = own >= 0
    np.add.at(people, (t[inside], own[inside]), 1)
    first = motion.subgroup[motion.subgroup >= 0].min(initial=len(people[0]))
    return np.where(inside & (people[t, own] > 1), own - first + 1, -1)


def label(motion: Motion, view: View | None) -> Truth:
    """Returns the whole Truth of a motion: that of `bodies`, with groups, events and hard negatives added.

    A moving camera loses people for good, as in recordings: people who are wholly outside the image have no row in that
    frame, and groups are of those who are left. `events_in_view` leaves out what it does not show.
    """
    from sim.truth.merge_split_events import groups_and_events

    people = recorded_bodies(motion)
    truth = bodies(motion, view, people)
    s = motion.states()
    rows = MotionRows.of_table(s.pos, s.vel, s.present, s.intent)
    rows = replace(rows, walls=s.walls or ((0, motion.scene.walls),))
    found, group = groups_and_events(rows, s.rate), np.full(s.present.shape, -1)
    group[rows.frame, rows.column] = found.group
    shown = FrameTicks.of(truth.length, motion.fps, s.rate, s.present)
    truth, shapes = truth.replace(group=group[shown.tick[people.frame - 1], people.id - 1]), people.shapes
    if isinstance(view, MovingCamera):
        inside = in_view(truth)
        truth, shapes = truth.keep(inside), Ellipsoids(shapes.centre[inside], shapes.shape[inside])
    assert truth.pos is not None
    assert truth.vel is not None
    ground = tuple(groups_over_time(truth.frame, truth.id, truth.group, truth.pos, truth.vel, 1, truth.length))
    events, orders = _events_in_frames(_events(rows, found, s.rate, motion), motion, group, shown)
    return truth.replace(
        groups=ground, groups_px=None if view is None else image_groups(truth, view, shapes),
        labelled=np.ones(truth.length, dtype=np.bool_), events=events, near=_near_in_frames(found.near, shown),
        orders=orders,
    )  # fmt: skip


def in_view(truth: Truth) -> Bools:
    """Returns which rows (R,) of a truth with boxes are people who are at least partly in the image."""
    assert truth.truncation is not None
    return np.asarray(truth.truncation < 1.0)


def events_in_view(truth: Truth) -> Truth:
    """Returns the truth with the events and hard negatives whose people all have rows in their first and last frame.

    An order whose event is left out has none.
    """
    assert truth.events is not None
    assert truth.near is not None

    def seen(frame: int) -> set[int]:
        return set(truth.id[truth.rows(frame)].tolist())

    kept = [k for k, e in enumerate(truth.events) if seen(e.start) & seen(e.end) >= set(e.members)]
    place, near = {k: n for n, k in enumerate(kept)}, truth.near
    pairs = zip(near.start.tolist(), near.end.tolist(), near.a.tolist(), near.b.tolist(), strict=True)
    both = np.array([seen(start) & seen(end) >= {a, b} for start, end, a, b in pairs], np.bool_)
    orders = (replace(o, event=None if o.event is None else place.get(o.event)) for o in truth.orders)
    return truth.replace(events=tuple(truth.events[k] for k in kept), orders=tuple(orders), near=near.keep(both))


def _events(rows: MotionRows, found: GroupsAndEvents, rate: float, motion: Motion) -> list[GroupEvent]:
    from sim.truth.crossing_events import crossings
    from sim.truth.queue_detection import queues

    rows = replace(rows, group=found.group)
    return [*found.events, *crossings(rows, rate), *queues(_moving(rows, motion, rate), rate)]


def _moving(rows: MotionRows, motion: Motion, rate: float) -> MotionRows:
    """Returns the rows without those of people who are in no queue: who are stuck, or wait for a door to open."""
    waiting = motion.states().waiting
    kept = np.ones(len(rows.frame), np.bool_) if waiting is None else ~waiting[rows.frame, rows.column]
    for one in motion.immobile:
        first, last = round(one.start * rate), round(one.end * rate)
        kept[int(rows.find(one.person - 1, first)) : int(rows.find(one.person - 1, last + 1))] = False
    if kept.all():
        return rows
    return MotionRows(
        rows.frame[kept], rows.column[kept], rows.pos[kept], rows.vel[kept], rows.group[kept], rows.length
    )


def _events_in_frames(
    events: list[GroupEvent], motion: Motion, group: Ints, shown: FrameTicks
) -> tuple[tuple[GroupEvent, ...], tuple[Order, ...]]:
    """Returns the events with frames in place of ticks, sorted, and the orders with the events that fulfil them."""
    ticks = sorted(events, key=_sorting)
    converted = [_in_frames(event, shown) for event in ticks]
    every = sorted((e for e in converted if e is not None), key=_sorting)
    place = {id(e): k for k, e in enumerate(every)}
    index = [None if e is None else place[id(e)] for e in converted]
    fulfilled = [fulfilment(order, ticks, group, motion.states()) for order in motion.orders]
    orders = (
        replace(order, event=None if k is None else index[k]) for order, k in zip(motion.orders, fulfilled, strict=True)
    )
    return tuple(every), tuple(orders)


def _sorting(e: GroupEvent) -> tuple[int, int, str, tuple[int, ...], tuple[int, ...]]:
    return e.start, e.end, e.kind, e.members, e.after


def _in_frames(event: GroupEvent, shown: FrameTicks) -> GroupEvent | None:
    last = len(shown.tick) - 1
    if event.kind in ("enter", "leave"):  # a leave is in the last frame before the change
        start = shown.first(event.start - 1) if event.kind == "enter" else shown.first(event.start) - 1
        # Groups that enter or leave between two frames of which none shows it have no such event.
        seen = 0 <= start <= last and not (event.kind == "leave" and start == last)
        return replace(event, start=start + 1, end=start + 1) if seen else None
    start = min(shown.first(event.start - 1), last)
    return replace(event, start=start + 1, end=max(shown.last(event.end - 1), start) + 1)


def _near_in_frames(near: Near, shown: FrameTicks) -> Near:
    start = np.searchsorted(shown.tick, near.start - 1) + 1
    end = np.searchsorted(shown.tick, near.end - 1, side="right")
    kept = start <= end
    return Near(start[kept], end[kept], near.a[kept], near.b[kept])
