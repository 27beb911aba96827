"""What is true of a simulated crowd: bodies as the camera sees them, groups and events as they are measured.

`bodies` is the part that sensors need; `label` adds groups, events and hard negatives. Nothing here knows when an
order was given; whether orders came true is asked afterwards, by sim.orders.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sim.camera import project, px_per_m_at_centre
from sim.orders import check_orders
from sim.people import contour, outlines
from sim.types import Array, Camera, GroupEvent, Groups, Ints, Motion, Truth
from sim.viewpoint import Bodies, recorded
from sim.visibility import look

__all__ = ["bodies", "check_orders", "image_velocities", "label"]

INSTANT = 0.02  # s: half the step that turns ground velocities into image velocities


def bodies(motion: Motion, camera: Camera | None) -> Truth:
    """Places, boxes, visibility of everybody in every frame; no groups and no events (group is -1 throughout)."""
    return _bodies(motion, camera, recorded(motion))


def _bodies(motion: Motion, camera: Camera | None, people: Bodies) -> Truth:
    t, p = people.frame - 1, people.id - 1
    seen = None if camera is None else look(
        camera, motion.scene, people.frame, people.pos3, motion.height[p], people.shapes
    )  # fmt: skip
    return Truth(
        name=motion.name,
        fps=motion.fps,
        length=len(motion.present),
        px_per_m=float("nan") if camera is None else px_per_m_at_centre(camera),
        frame=people.frame,
        id=people.id,
        group=np.full(len(p), -1, np.int64),
        pos=motion.pos[t, p],
        vel=motion.vel[t, p],
        box=None if seen is None else seen.box,
        visibility=np.ones(len(p)) if seen is None else seen.visibility,
        z=people.pos3[:, 2],
        heading=motion.heading[t, p],
        height=motion.height[p],
        truncation=None if seen is None else seen.truncation,
        visible_box=None if seen is None else seen.visible_box,
        orders=motion.orders,
    )


def label(motion: Motion, camera: Camera | None) -> Truth:
    """All that is true: `bodies`, and groups, events and hard negatives measured from motion and intent."""
    from sim.groups import memberships

    people = recorded(motion)
    truth = _bodies(motion, camera, people)
    found = memberships(motion.pos, motion.vel, motion.present, motion.intent, motion.fps)
    truth = truth.replace(group=found.group[people.frame - 1, people.id - 1])
    ground = tuple(_ground_groups(truth))
    return truth.replace(
        groups=ground,
        groups_px=None if camera is None else tuple(_image_groups(truth, ground, camera, people)),
        labelled=np.ones(truth.length, dtype=np.bool_),
        events=_events(motion, found.group, found.events),
        near=found.near,
    )


def _events(motion: Motion, group: Ints, changes: tuple[GroupEvent, ...]) -> tuple[GroupEvent, ...]:
    from sim.events import crossings, queues

    crossed = crossings(motion.pos, motion.vel, motion.present, group, motion.fps)
    queued = queues(motion.pos, motion.vel, motion.present, motion.fps)
    every = [*changes, *crossed, *queued]
    return tuple(sorted(every, key=lambda e: (e.start, e.end, e.kind, e.members, e.after)))


def _ground_groups(truth: Truth) -> Iterator[Groups]:
    from sim.groups import frame_groups

    assert truth.pos is not None
    assert truth.vel is not None
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        yield frame_groups(truth.id[r], truth.group[r], truth.pos[r], truth.vel[r])


def _image_groups(truth: Truth, ground: tuple[Groups, ...], camera: Camera, people: Bodies) -> Iterator[Groups]:
    """The same groups in the image: hulls of silhouettes, middles of boxes; who is behind the camera is left out."""
    assert truth.box is not None
    edge = contour(outlines(camera, people.shapes))
    centre = truth.box[:, :2] + truth.box[:, 2:] / 2
    vel = image_velocities(camera, people.shapes.centre[:, 0], truth.vel)
    for index, groups in enumerate(ground, start=1):
        r = truth.rows(index)
        yield _in_image(groups, truth.id[r], edge[r], centre[r], vel[r])


def image_velocities(camera: Camera, middle: Array, vel: Array | None) -> Array:
    """px/s (N, 2) of points (N, 3) that move at vel (N, 2) m/s over level ground."""
    assert vel is not None
    step = INSTANT * np.column_stack([vel, np.zeros(len(vel))])
    return np.asarray((project(camera, middle + step)[0] - project(camera, middle - step)[0]) / (2 * INSTANT))


def _in_image(groups: Groups, id: Ints, edge: Array, centre: Array, vel: Array) -> Groups:
    from sim.geometry import convex_hull

    if not len(groups.id):
        return Groups.none()
    pos, speed, extent, hull = [], [], [], []
    for members in groups.members:
        k = np.searchsorted(id, members)
        k = k[np.isfinite(centre[k]).all(axis=1)]
        pos.append(_mean(centre[k]))
        speed.append(_mean(vel[k]))
        extent.append(np.cov(centre[k].T, bias=True) if len(k) else np.full((2, 2), np.nan))
        hull.append(convex_hull(edge[k].reshape(-1, 2)) if len(k) else np.zeros((0, 2)))
    return groups.replace(pos=np.array(pos), vel=np.array(speed), extent=np.array(extent), hull=tuple(hull))


def _mean(rows: Array) -> Array:
    return rows.mean(axis=0) if len(rows) else np.full(2, np.nan)
