"""The labelled people of a sequence as tracks with known ids and without groups, for grouping without a tracker.

Frames, ids, positions, boxes and stated velocities are used. Labels of groups and events are not.
"""

from __future__ import annotations

import numpy as np

from scenarios.errors import InputError
from sim.dataset.replay import on_ground
from sim.types import FrameTruth, Plane, Sequence, Tracks, Truth

# Kinds of sources whose velocities are computed from earlier and later positions.
LOOK_AHEAD = ("mot", "mot text", "people text")


def known_people(sequence: Sequence) -> list[Tracks]:
    """Returns the labelled people as causal tracks without groups, one `Tracks` per frame from 1.

    Velocities that the source does not state are nan. If labels have boxes only and there is a camera, people are
    placed on the ground. Raises InputError if nobody has an id, or if some people have no position on the ground.
    """
    truth, file = sequence.truth, sequence.source.get("path", sequence.name)
    if truth is None:
        raise InputError(
            file=file, got="no people with ids", expected="labelled people, or tracks",
            remedy="track the people first (flockscope track), or give each row an id",
        )  # fmt: skip
    remedy = "complete the row, or leave it out"
    if truth.pos is None and sequence.camera is not None:
        remedy = "its box stands at or above the camera's horizon: correct the calibration, or leave --camera out"
        truth = truth.replace(pos=on_ground(truth, sequence))
    elif sequence.source.get("kind") in LOOK_AHEAD:
        truth = truth.replace(vel=None)
    pos = np.zeros((0, 2)) if truth.pos is None else truth.pos
    unknown = ~np.asarray(np.isfinite(pos).all(axis=1))
    if unknown.any():
        row = int(np.argmax(unknown))
        raise InputError(
            file=file, place=f"frame {truth.frame[row]}, id {truth.id[row]}",
            got=f"no position on the ground, as in {unknown.sum()} of {unknown.size} rows",
            expected="one of every person, or of nobody", remedy=remedy,
        )  # fmt: skip
    return people_as_tracks(truth)


def people_as_tracks(truth: Truth) -> list[Tracks]:
    """Returns the labelled people of every frame as tracks of persons without groups, one `Tracks` per frame from 1."""
    plane: Plane = "image" if truth.pos is None else "ground"
    if truth.pos is not None and truth.box is not None and not np.isfinite(truth.box).all():
        truth = truth.replace(box=None)
    frames, seen = range(1, truth.length + 1), set(truth.frame.tolist())
    # Most frames of a sparse text are empty: they are copies of the first.
    nobody = next((_tracks(truth.at(k), plane) for k in frames if k not in seen), None)
    return [
        _tracks(truth.at(k), plane) if nobody is None or k in seen else nobody.replace(index=k, t=(k - 1) / truth.fps)
        for k in frames
    ]


def _tracks(frame: FrameTruth, plane: Plane) -> Tracks:
    count = len(frame.id)
    if frame.pos is not None:
        pos = frame.pos
    else:
        assert frame.box is not None, "labels have positions or boxes"
        pos = frame.box[:, :2] + frame.box[:, 2:] / 2
    vel = frame.vel if frame.vel is not None else np.full((count, 2), np.nan)
    no_group, cov = np.full(count, -1), np.zeros((count, 4, 4))
    return Tracks(frame.index, frame.t, plane, "person", frame.id, no_group, pos, vel, cov, frame.box, np.ones(count))
