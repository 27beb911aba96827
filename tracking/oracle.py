"""The oracle of a sequence: the detections that a tracker got, with the ids and groups of the people whom they show.

It is the best that any tracker can report from these detections without smoothing: no false alarm, no switch, the true
groups and events of the people who were detected. What it lacks in a score is the detector's, not the tracker's. From
points it has the points, from boxes the boxes, whose places suffer where feet are hidden. From pixels it has the boxes
of what is visible of each person, from stereo pairs the true places of those who are visible.

Simulated detections and labels tell whose they are (`Given.owners`). A detection that lies as far from its person as a
false alarm is none of the oracle's. Detections of a recording are matched with the true people.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from collections.abc import Sequence as SequenceOf
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from sim.types import EVENT_KINDS, Array, DetectionMode, GroupEvent, Groups, Ints, Plane, Sequence, Tracks, Truth
from tracking.grouping.grouped_tracks import groups_in_frames, with_velocities
from tracking.running.detection_mode import choose_mode
from tracking.running.prepare import InputFrames, input_frames
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import Scorer
from tracking.scoring.people import Similarity
from tracking.scoring.similarity import EPS, FOUND

# Returns the input of a sequence by mode, needs and seed.
Inputs = Callable[[DetectionMode, tuple[str, ...], int], InputFrames]


def _tracks(
    index: int, t: float, plane: Plane, who: tuple[Ints, Ints], pos: Array, box: Array | None, score: Array
) -> Tracks:
    count, dims = pos.shape
    vel, cov = np.full((count, dims), np.nan), np.full((count, 2 * dims, 2 * dims), np.nan)
    return Tracks(index, t, plane, "person", *who, pos, vel, cov, box, score, Groups.none(), derived=True)


def oracle(
    sequence: Sequence, given: Mapping[str, Any], similarity: Similarity | None = None, *,
    inputs: Inputs | None = None, scorer: Scorer | None = None,
) -> TrackingRun:  # fmt: skip
    """Returns the oracle's tracks of a sequence with truth.

    given: the content of a run's run.json, of which detections, input, sensor and seed say what input the oracle gets.
    similarity: how detections are compared with true people; None: by the data. inputs, scorer: of the sequence, as
    `prepare` takes it and of its truth, if they are made already. `info["owners"]` of the result is "known", or
    "matched" if the data do not tell whose the detections are.
    """
    truth, mode = _truth(sequence), _mode(sequence, given)
    named, known = _named(sequence, given, similarity, inputs, scorer)
    info = {"tracker": "oracle", "detections": mode, "sensor": given.get("sensor") or {}}
    people = [t.keep(t.id >= 0) for t in named]
    tracks = _with_groups_and_events(with_velocities(people, truth.fps), truth)
    return TrackingRun(tracks, {**info, "owners": "known" if known else "matched"})


def named_detections(
    sequence: Sequence, given: Mapping[str, Any], similarity: Similarity | None = None
) -> list[Tracks]:
    """Returns a run's input as tracks with the ids and groups of the true people that it shows, one `Tracks` per frame.
    The arguments are as in `oracle`. False alarms, and detections far from their person, have ids below 0 and the group
    -1."""
    return _named(sequence, given, similarity)[0]


def _named(
    sequence: Sequence, given: Mapping[str, Any], similarity: Similarity | None, inputs: Inputs | None = None,
    scorer: Scorer | None = None,
) -> tuple[list[Tracks], bool]:  # fmt: skip
    truth, mode = _truth(sequence), _mode(sequence, given)
    if mode in ("image", "both"):
        places = given.get("input") == "stereo"
        return [_visible(truth, index, places) for index in range(1, truth.length + 1)], True
    seed = (given.get("seed") or 0) if given.get("sensor") else 0  # without errors it only shuffles the detections
    needs = ("boxes",) if given.get("input") == "boxes" else ("boxes", "points")
    choose_mode(needs, sequence, mode)
    if inputs is None:
        seen = input_frames(mode, needs, sequence, given.get("sensor") or {}, seed, owned=True)
    else:
        seen = inputs(mode, needs, seed)
    reported = [
        _tracks(f.index, f.t, d.plane, (np.arange(len(d.pos)), np.full(len(d.pos), -1)), d.pos, d.box, d.score)
        for f in (seen.frames or ())[: truth.length] if (d := f.detections) is not None
    ]  # fmt: skip
    (compared,) = (scorer or Scorer(truth)).compare([reported], similarity, None)
    sides, true, pairs = compared.sides, compared.sides.true, compared.people
    mapping = sides.mapping
    if seen.owners is not None and pairs is not None:
        owner = np.concatenate([np.zeros(0, np.int64), *seen.owners[: truth.length]])
        own = pairs.keep((pairs.true.id[pairs.i] == owner[pairs.j]) & (pairs.s >= FOUND - EPS))
        mapping = np.full(len(owner), -1)
        mapping[own.j] = own.i
    cuts = np.cumsum([0, *(len(t.id) for t in sides.tracks)]).tolist()
    id, group = np.append(true.rows.id, -1), np.append(true.group, -1)  # the last: of nobody
    named = [
        t.replace(id=np.where(row >= 0, id[row], -1 - np.arange(len(row))), group=group[row])
        for t, row in zip(sides.tracks, (mapping[a:b] for a, b in pairwise(cuts)), strict=True)
    ]
    return named, seen.owners is not None


def _truth(sequence: Sequence) -> Truth:
    truth = sequence.truth
    assert truth is not None, "an oracle knows the truth"
    return truth


def _mode(sequence: Sequence, given: Mapping[str, Any]) -> DetectionMode:
    return given.get("detections") or ("file" if sequence.has_detections else "truth")


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
