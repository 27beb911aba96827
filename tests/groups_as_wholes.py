"""The hand-made sequence's groups as a tracker of groups would answer: unit "group", no members."""

from __future__ import annotations

import numpy as np

from sim.footprints import footprint_hull
from sim.geometry import convex_hull
from sim.types import Array, GroupEvent, Groups, Sequence, Tracks

LATE = 4
KNOWN = {50: ("merge", (1, 2), (1,)), 110: ("split", (1,), (1, 3))}


def wholes(sequence: Sequence, plane: str) -> list[Tracks]:
    """Late by four frames: hulls of footprints on the ground, of boxes in the image; sizes a little off."""
    truth, answers = sequence.truth, []
    assert truth is not None
    for k in range(1, truth.length + 1):
        now, late = truth.at(k), truth.at(max(k - LATE, 1))
        group = dict(zip(late.id.tolist(), late.group.tolist(), strict=True))
        label = np.array([group.get(i, -1) for i in now.id.tolist()])
        names = np.unique(label[label >= 0])
        rows = [np.flatnonzero(label == name) for name in names]
        place = now.pos if plane == "ground" else now.box[:, :2] + now.box[:, 2:] / 2
        vel = now.vel * (1.0 if plane == "ground" else 40.0)
        pos, speed = (np.array([a[r].mean(axis=0) for r in rows]) for a in (place, vel))
        extent = np.array([np.cov(place[r].T, bias=True) for r in rows]) + np.eye(2) * (
            0.02 if plane == "ground" else 9
        )
        hull = tuple(footprint_hull(now.pos[r]) if plane == "ground" else _of_boxes(now.box[r]) for r in rows)
        size = np.array([len(r) + 0.2 * np.sin(k + len(r)) for r in rows])
        groups = Groups(names, (), pos, speed, extent, size, hull)
        cov = np.tile(0.01 * np.eye(4), (len(names), 1, 1))
        known = [KNOWN[k - LATE]] if k - LATE in KNOWN else []
        events = tuple(
            GroupEvent(kind, k - LATE, k, k, before, after, (), (float(pos[0, 0]), float(pos[0, 1])))
            for kind, before, after in known
        )
        score = np.ones(len(names))
        answers.append(Tracks(k, now.t, plane, "group", names, names, pos, speed, cov, None, score, groups, events))
    return answers


def _of_boxes(box: Array) -> Array:
    return convex_hull(
        np.concatenate([box[:, :2] + box[:, 2:] * np.array(c) for c in ((0, 0), (1, 0), (1, 1), (0, 1))])
    )
