"""Reads tracks from MOTChallenge text that any program has written, and adds groups from a groups.csv.

The result is one Tracks per frame, from frame 1. Positions are on the ground (m) if the file has them, else the centres
of the boxes (px). Velocities are differences of positions over the last 0.5 s.
"""

from __future__ import annotations

import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np

from scenarios.errors import InputError
from sim.io.formats.box_columns import BoxScale, require_pixels
from sim.io.formats.mot_ground import ground_positions, require_metres
from sim.io.formats.mot_people import of_class
from sim.io.formats.mot_table import MotTable, read_table
from sim.io.formats.mot_text import reject_duplicate_ids
from sim.io.formats.unit_scores import unit_scores
from sim.io.formats.velocity import chords
from sim.io.store.group_files import read_groups_csv
from sim.types import Array, Ints, Plane, Tracks


def read_track_text(
    path: Path, fps: float, length: int | None, person_class: int | None = None, box_scale: BoxScale | None = None
) -> list[Tracks]:
    """Returns the tracks of a MOTChallenge text, one Tracks per frame from 1 to `length`, sorted by id.

    length: None: to the last frame in the file. person_class, box_scale: as of `read_detections`.
    """
    table = read_table(path, length=length, boxless=True, box_scale=box_scale)
    require_pixels(table.rows, table.boxes())
    _reject_empty(table, length)
    table.rows.reject(
        table.id < 0, "ids from 0", "give each track an id", "these are detections: `flockscope track` them first"
    )
    people = of_class(table, np.ones(len(table.id), bool), person_class)
    reject_duplicate_ids(table, people)
    order = np.lexsort((table.id, table.frame))
    order = order[people[order]]
    frame, id = table.frame[order], table.id[order]
    require_metres(table, fps)
    ground = ground_positions(table)
    if ground is not None:
        remedy = "complete the line, or write z = -1 in all"
        table.rows.reject(np.isnan(ground[:, 0]), "a ground position (z other than -1), as in other lines", remedy)
    pos = _centres(table)[order] if ground is None else ground[order][:, :2]
    box = None if table.without_box().any() else table.box[order]
    score = unit_scores(table.rest[:, 0] if table.rest.shape[1] else np.ones(len(table.id)))[0][order]
    plane: Plane = "image" if ground is None else "ground"
    vel, count = chords(frame, id, pos, fps), length or int(frame.max(initial=0))
    cuts = np.searchsorted(frame, np.arange(1, count + 2)).tolist()

    def arrays(a: int, b: int) -> tuple[Array | Ints | None, ...]:
        some = (id[a:b], np.full(b - a, -1, np.int64), pos[a:b], vel[a:b], np.full((b - a, 4, 4), np.nan))
        return *some, None if box is None else box[a:b], score[a:b]

    # Most frames of sparse texts are empty: they share their arrays.
    nobody = Tracks(0, 0.0, plane, "person", *arrays(0, 0))  # type: ignore[arg-type]
    none = (nobody.id, nobody.group, nobody.pos, nobody.vel, nobody.cov, nobody.box, nobody.score)
    return [
        Tracks(k + 1, k / fps, plane, "person", *(none if a == b else arrays(a, b)))  # type: ignore[arg-type]
        for k, (a, b) in enumerate(pairwise(cuts))
    ]


def _reject_empty(table: MotTable, length: int | None) -> None:
    if len(table.frame):
        return
    if length is None:
        raise InputError(file=table.rows.file, got="no row", expected="tracks", remedy="check that it was written")
    warnings.warn(f"{table.rows.file}: no row, so nobody was tracked", stacklevel=4)


def _centres(table: MotTable) -> Array:
    table.rows.reject(table.without_box(), "a box, or a ground position in every line", "complete the lines")
    return table.box[:, :2] + table.box[:, 2:] / 2


def with_groups(found: list[Tracks], path: Path) -> list[Tracks]:
    """Returns copies of one tracker's tracks with the groups of a groups.csv.

    A person in two groups gets the one with the higher id. Members without a track stay in the groups.
    """
    every = read_groups_csv(path, len(found))
    answers = []
    for tracks, groups in zip(found, every, strict=True):
        group = tracks.group.copy()
        for k, members in zip(groups.id, groups.members, strict=True):
            group[np.isin(tracks.id, members)] = k
        answers.append(tracks.replace(group=group, groups=groups))
    return answers
