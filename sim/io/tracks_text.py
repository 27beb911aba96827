"""Anybody's MOTChallenge text, and groups.csv beside it, as Tracks."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sim.io.groups import read_groups_csv
from sim.io.mot import MotTable, read_table, refuse_twice, unit_scores
from sim.io.velocity import differentiate
from sim.types import Array, Tracks


def from_text(path: Path, fps: float, length: int | None) -> list[Tracks]:
    """Tracks of frames 1 … length; velocity the chord over 0.5 s, covariance nan, nobody in a group."""
    table = read_table(path, length=length, boxless=True)
    table.rows.refuse(table.id < 0, "ids from 0", "give each track an id")
    refuse_twice(table, np.ones(len(table.id), bool))
    order = np.lexsort((table.id, table.frame))
    frame, id = table.frame[order], table.id[order]
    ground = table.ground()
    grounded = ground is not None and bool(np.isfinite(ground).all())
    pos = ground[order][:, :2] if grounded and ground is not None else _centres(table)[order]
    box = None if table.boxless().any() else table.box[order]
    score = unit_scores(table.rest[:, 0] if table.rest.shape[1] else np.ones(len(order)))[order]
    vel, count = differentiate(frame, id, pos, fps), length or int(frame.max(initial=0))
    cuts = np.searchsorted(frame, np.arange(1, count + 2))
    found = []
    for k in range(count):
        r = slice(int(cuts[k]), int(cuts[k + 1]))
        n = int(cuts[k + 1] - cuts[k])
        found.append(
            Tracks(
                k + 1, k / fps, "ground" if grounded else "image", "person", id[r], np.full(n, -1, np.int64), pos[r],
                vel[r], np.full((n, 4, 4), np.nan), None if box is None else box[r], score[r],
            )
        )  # fmt: skip
    return found


def _centres(table: MotTable) -> Array:
    """Middles of the boxes, where the ground position is not known throughout."""
    table.rows.refuse(table.boxless(), "a box, or a ground position in every line", "complete the lines")
    return table.box[:, :2] + table.box[:, 2:] / 2


def with_groups(found: list[Tracks], path: Path) -> list[Tracks]:
    """The tracks with the groups of a groups.csv."""
    every = read_groups_csv(path, len(found))
    answers = []
    for tracks, groups in zip(found, every, strict=True):
        group = tracks.group.copy()
        for k, members in zip(groups.id, groups.members, strict=True):
            group[np.isin(tracks.id, members)] = k
        answers.append(tracks.replace(group=group, groups=groups))
    return answers
