"""The oracle of a sequence: the detections that a tracker got, with the ids and groups of the true people they match.

It is the best that any tracker can report from these detections without smoothing: no false alarm, no switch, the true
groups and events of the people who were detected. What it lacks in a score is the detector's, not the tracker's. From
points it has the points, from boxes the boxes, whose foot points suffer where feet are hidden. From pixels it has the
boxes of what is visible of each person, from stereo pairs the true places of those who are visible.
"""

from __future__ import annotations

from collections.abc import Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from sim.types import (
    EVENT_KINDS,
    Array,
    Bools,
    Context,
    DetectionMode,
    Detections,
    Frame,
    GroupEvent,
    Groups,
    Ints,
    Plane,
    Sequence,
    Tracks,
    Truth,
)
from tracking.grouping.grouped_tracks import groups_in_frames, with_velocities
from tracking.running.prepare import prepare
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import Scorer
from tracking.scoring.people_comparison import Similarity, in_one_plane


class _Detections:
    """A tracker that reports each detection as a track of one frame: the box if it needs only boxes, else the point."""

    def __init__(self, needs: tuple[str, ...]) -> None:
        self.needs = needs

    def reset(self, context: Context, seed: int) -> None:
        pass

    def step(self, frame: Frame, detections: Detections | None) -> Tracks:
        assert detections is not None, "a tracker of boxes or points gets detections"
        pos, plane, box = detections.pos, detections.plane, detections.box
        if self.needs == ("boxes",) and box is not None:
            pos, plane = box[:, :2] + box[:, 2:] / 2, "image"
        who = (np.arange(len(pos)), np.full(len(pos), -1))
        return _tracks(frame.index, frame.t, plane, who, pos, box, detections.score)


def _tracks(
    index: int, t: float, plane: Plane, who: tuple[Ints, Ints], pos: Array, box: Array | None, score: Array
) -> Tracks:
    count, dims = pos.shape
    vel, cov = np.full((count, dims), np.nan), np.full((count, 2 * dims, 2 * dims), np.nan)
    return Tracks(index, t, plane, "person", *who, pos, vel, cov, box, score, Groups.none(), derived=True)


def oracle(sequence: Sequence, given: Mapping[str, Any], similarity: Similarity | None = None) -> TrackingRun:
    """Returns the oracle's tracks of a sequence with truth.

    given: the content of a run's run.json, of which detections, input, sensor and seed say what input the oracle gets.
    similarity: how detections are matched with true people; None: by the data.
    """
    truth, mode = _truth(sequence), _mode(sequence, given)
    info = {"tracker": "oracle", "detections": mode, "sensor": given.get("sensor") or {}}
    people = [_rows(t, t.id >= 0) for t in named_detections(sequence, given, similarity)]
    return TrackingRun(_with_groups_and_events(with_velocities(people, truth.fps), truth), info)


def named_detections(
    sequence: Sequence, given: Mapping[str, Any], similarity: Similarity | None = None
) -> list[Tracks]:
    """Returns a run's input as tracks with the ids and groups of the true people that it shows, one `Tracks` per frame.
    The arguments are as in `oracle`. False alarms have ids below 0 and the group -1."""
    truth, mode = _truth(sequence), _mode(sequence, given)
    if mode == "image":
        return [_visible(truth, index, given.get("input") == "stereo") for index in range(1, truth.length + 1)]
    seed = (given.get("seed") or 0) if given.get("sensor") else 0  # without errors it only shuffles the detections
    boxes = given.get("input") == "boxes" and sequence.camera is not None  # without a camera boxes have no foot points
    needs = ("boxes",) if boxes else ("boxes", "points")
    prepared = prepare(_Detections(needs), sequence, detections=mode, sensor=given.get("sensor"), seed=seed)
    prepared.reset(seed)
    reported = [prepared.tracker.step(f, f.detections) for f in prepared.frames() if f.index <= truth.length]
    scorer = Scorer(truth)
    # Boxes are moved first: then they are matched with the true places, with which trackers on the ground are compared.
    moved, _ = in_one_plane(scorer.truth, [reported], [None], similarity)
    (compared,) = scorer.compare(moved, similarity, None)
    sides, true = compared.sides, compared.sides.true
    cuts = np.cumsum([0, *(len(t.id) for t in sides.tracks)]).tolist()
    rows = [sides.mapping[a:b] for a, b in pairwise(cuts)]
    id, group = np.append(true.rows.id, -1), np.append(true.group, -1)  # the last: of nobody
    return [
        t.replace(id=np.where(row >= 0, id[row], -1 - np.arange(len(row))), group=group[row])
        for t, row in zip(sides.tracks, rows, strict=True)
    ]


def _truth(sequence: Sequence) -> Truth:
    truth = sequence.truth
    assert truth is not None, "an oracle knows the truth"
    return truth


def _mode(sequence: Sequence, given: Mapping[str, Any]) -> DetectionMode:
    return given.get("detections") or ("file" if sequence.has_detections else "truth")


def _rows(t: Tracks, kept: Bools) -> Tracks:
    box = None if t.box is None else t.box[kept]
    return t.replace(
        id=t.id[kept], group=t.group[kept], pos=t.pos[kept], vel=t.vel[kept], cov=t.cov[kept], box=box,
        score=t.score[kept] if len(t.score) else t.score, seen=t.seen[kept] if len(t.seen) else t.seen,
    )  # fmt: skip


def _visible(truth: Truth, index: int, places: bool) -> Tracks:
    """Returns the people of a frame who are visible at all: their true places, or the boxes of what is visible."""
    rows = np.arange(len(truth.id))[truth.rows(index)]
    rows = rows[truth.visibility[rows] > 0]
    plane: Plane = "ground" if places else "image"
    if places:
        assert truth.pos is not None, "people before a calibrated pair have places"
        box, pos = None, truth.pos[rows]
    else:
        boxes = truth.box if truth.visible_box is None else truth.visible_box
        assert boxes is not None, "people in pictures have boxes"
        rows = rows[np.isfinite(boxes[rows]).all(axis=1)]
        box = boxes[rows]
        pos = box[:, :2] + box[:, 2:] / 2
    who = (truth.id[rows], truth.group[rows])
    return _tracks(index, (index - 1) / truth.fps, plane, who, pos, box, np.ones(len(rows)))


def _with_groups_and_events(tracks: SequenceOf[Tracks], truth: Truth) -> tuple[Tracks, ...]:
    starting: dict[int, list[GroupEvent]] = {}
    for e in truth.events or ():
        starting.setdefault(e.start, []).append(replace(e, emitted=e.start))
    return tuple(
        t.replace(groups=groups, events=tuple(starting.get(t.index, ())), own_events=EVENT_KINDS, derived=True)
        for t, groups in zip(tracks, groups_in_frames(tracks), strict=True)
    )
