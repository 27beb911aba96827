"""What is true of a sequence's groups, as a tracker of groups would answer: unit "group", no members."""

from __future__ import annotations

import numpy as np

from sim.geometry.hull_kernels import convex_hull
from sim.types import Array, FrameTruth, GroupEvent, Groups, Sequence, Tracks
from tests.reference_polygons import footprint_hull

LATE = 4
# px per metre, for velocities in the image.
PX = 40.0


def wholes(sequence: Sequence, plane: str) -> list[Tracks]:
    """Late by four frames: hulls of footprints on the ground, of boxes in the image; sizes a little off."""
    truth, answers = sequence.truth, []
    for k in range(1, truth.length + 1):
        now, late = truth.at(k), truth.at(max(k - LATE, 1))
        groups = _groups(now, late, plane)
        names, cov = groups.id, np.tile(0.01 * np.eye(4), (len(groups.id), 1, 1))
        known = [e for e in truth.events or () if e.kind in ("merge", "split") and e.start == k - LATE]
        events = tuple(
            GroupEvent(e.kind, e.start, k, k, e.before, e.after, (), _middle(truth.at(e.start), e.members, plane))
            for e in known
        )
        score = np.ones(len(names))
        answers.append(
            Tracks(k, now.t, plane, "group", names, names, groups.pos, groups.vel, cov, None, score, groups, events)
        )
    return answers


def _places(now: FrameTruth, plane: str) -> Array:
    """(N, 2) in the plane's unit."""
    assert now.pos is not None
    return now.pos if plane == "ground" else now.box[:, :2] + now.box[:, 2:] / 2


def _middle(now: FrameTruth, people: tuple[int, ...], plane: str) -> tuple[float, float]:
    x, y = _places(now, plane)[np.isin(now.id, people)].mean(axis=0)
    return float(x), float(y)


def _groups(now: FrameTruth, late: FrameTruth, plane: str) -> Groups:
    """People of this frame in the groups that they had earlier."""
    then = dict(zip(late.id.tolist(), late.group.tolist(), strict=True))
    label = np.array([then.get(i, -1) for i in now.id.tolist()], np.int64)
    names = np.unique(label[label >= 0])
    rows = [np.flatnonzero(label == name) for name in names]
    if not rows:
        return Groups.none()
    ground = plane == "ground"
    place, unit = _places(now, plane), 1.0 if ground else PX
    pos, vel = (np.array([a[r].mean(axis=0) for r in rows]) for a in (place, now.vel * unit))
    extent = np.array([np.cov(place[r].T, bias=True) for r in rows]) + 0.02 * unit**2 * np.eye(2)
    hull = tuple(footprint_hull(now.pos[r]) if ground else _of_boxes(now.box[r]) for r in rows)
    size = np.array([len(r) + 0.2 * np.sin(now.index + len(r)) for r in rows])
    return Groups(names, (), pos, vel, extent, size, hull)


def _of_boxes(box: Array) -> Array:
    corners = [box[:, :2] + box[:, 2:] * np.array(c) for c in ((0, 0), (1, 0), (1, 1), (0, 1))]
    return convex_hull(np.concatenate(corners))
