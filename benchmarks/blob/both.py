"""Mode `both` of `benchmarks.blob`: pictures, a detector's boxes, and both at once.

Columns: HOTA and IDF1 by IoU of boxes, identity switches of a sequence, false groups a minute: reported groups of two
or more tracked people of whom, in most of its frames, no two belong to one true group. Means over sequences with 95 %
intervals; "both - better" is the difference from the better one of the two alone, of each sequence.
pets: PETS09-S2L1-first200 with its det/det.txt; it has no labelled groups.
rendered: the scenes of mode `pixels`, with the boxes of their sensor.
faults: the same with faults of the detector: all boxes 30 % too large; two frames late; only people in the nearer half;
a poster that is always detected; one box round people whose boxes share a third; no box in every second frame.
standing: standing.toml, where people stand from the first frame to the last, with the background spread over it.
evidence: rendered, without one kind of evidence; differences from all.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

import tracking
from benchmarks.blob.pixels import HERE, LONGEST, SCENES, rendered_scene, with_spread_background
from benchmarks.support.in_memory import people_in_view
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Array, DetectionMode, Detections, Frame, Tracks, Truth
from sim.types import Sequence as Recording
from tracking.filters import existence
from tracking.papers.blob import box_evidence, ellipse_tracks
from tracking.papers.blob.tracked_people_kernels import covered_shares
from tracking.recordings.source import open_source
from tracking.running.run import track

MODES: dict[str, DetectionMode] = {"pixels": "image", "boxes": "file", "both": "both"}
KEYS = "HOTA", "IDF1", "IDSW"
COLUMNS = (*KEYS, "false groups a minute")
MERGED = 1 / 3  # share of the smaller box
LARGER, LATE, POSTER = 1.3, 2, np.array([[40.0, 60.0, 24.0, 66.0]])
CALIBRATE, START = box_evidence.BoxEvidence.calibrate, ellipse_tracks.TrackedEllipses.start_tracks


def usual_noise(boxes: box_evidence.BoxEvidence) -> None:
    CALIBRATE(boxes)
    boxes.noise = boxes.people.noise * box_evidence.BOX_NOISE


def person_sizes(boxes: box_evidence.BoxEvidence) -> None:
    CALIBRATE(boxes)
    boxes.over_person = np.ones(2)


def from_pixels_only(people: ellipse_tracks.TrackedEllipses, *new: Any, boxed: bool = False) -> None:
    if not boxed:
        START(people, *new)


def one_sensor(states: Array, shown: Array, lasting: Array, standing: Array, *seen: Any) -> None:
    existence.update(states, *seen)


WITHOUT: dict[str, Sequence[Replacement]] = {
    "no looks": [(box_evidence, "LOOK_EVIDENCE", 0.0)],
    "nobody shares a box": [
        (box_evidence.BoxEvidence, "shared_boxes", lambda *_: (np.zeros((0, 2), int), np.zeros(0, int)))
    ],
    "boxes start no tracks": [(ellipse_tracks.TrackedEllipses, "start_tracks", from_pixels_only)],
    "any size starts tracks": [(box_evidence.BoxEvidence, "size_ratios", lambda self, box: np.ones(len(box)))],
    "offset, size and noise of boxes not learned": [(box_evidence.BoxEvidence, "learn", lambda *_: None)],
    "size of boxes not learned": [(box_evidence.BoxEvidence, "calibrate", person_sizes)],
    "noise of boxes not learned": [(box_evidence.BoxEvidence, "calibrate", usual_noise)],
    "boxes as exact as blobs": [(box_evidence, "BOX_NOISE", 1.0)],
    "scores not learned": [(existence, "LEARNED", 0)],
    "no people whom the detector does not see": [(existence, "update_by_detector", one_sensor)],
    "false boxes do not last": [(existence, "LASTING", 0.0)],
    "nobody stands in the background": [(existence, "STANDING", 0.0)],
}


def both(parts: Sequence[str], pets_folder: Path, seeds: range) -> None:
    """Prints the tables of the chosen parts."""
    if "pets" in parts:
        inputs("PETS", [open_source(pets_folder, images=True)[0]])
    if "standing" in parts:
        inputs("people who stand", [standing_scene(seed) for seed in seeds])
    if {"rendered", "faults", "evidence"}.isdisjoint(parts):
        return
    made = [rendered_scene(name, tilt, seed, False) for name, tilt in SCENES for seed in seeds]
    known = inputs("rendered", made) if "rendered" in parts else {}
    if "faults" in parts:
        alone = known["pixels"] if known else scores_of(made, "image")
        for title, fault in FAULTS.items():
            inputs(title, [with_fault(scene, fault) for scene in made], alone)
    if "evidence" in parts:
        evidence(made, known["both"] if known else scores_of(made, "both"))


def standing_scene(seed: int) -> Recording:
    """Returns a rendered scene in which some people stand all the time, with its pictures in memory."""
    stays = [f"group.{who}.stops.0.until=[600]" for who in ("alone", "talk")]
    live = simulate(load(HERE / "standing.toml", set=stays), seed)
    return with_spread_background(people_in_view(live, LONGEST))


def inputs(title: str, scenes: Sequence[Recording], pixels: Array | None = None) -> dict[str, Array]:
    """Prints a row for each input, and one for the difference of both from the better one alone; pixels (S, 4): scores
    from pixels, if known. Returns the scores (S, 4) by input."""
    head([title, *COLUMNS])
    known = {} if pixels is None else {"pixels": pixels}
    found = {name: known[name] if name in known else scores_of(scenes, mode) for name, mode in MODES.items()}
    for name, values in found.items():
        row([name, *cells(values, mean_cell)])
    best = np.stack([found["pixels"], found["boxes"]])
    better = np.concatenate([best.max(0)[:, :2], best.min(0)[:, 2:]], 1)
    row(["both - better", *cells(found["both"] - better, difference_cell)])
    return found


def evidence(scenes: Sequence[Recording], base: Array) -> None:
    """Prints what each kind of evidence adds. base (S, 4): scores of all evidence."""
    head(["without one kind of evidence", *COLUMNS])
    row(["both", *cells(base, mean_cell)])
    for name, change in WITHOUT.items():
        with replaced_code(change):
            row([name, *cells(scores_of(scenes, "both") - base, difference_cell)])


def scores_of(scenes: Sequence[Recording], mode: DetectionMode) -> Array:
    """Returns the scores (S, 4) of S scenes."""
    return np.array([scores(scene, mode) for scene in scenes])


def cells(values: Array, cell: Callable[..., str]) -> list[str]:
    """Returns the cells of a row for scores (S, 4) of S sequences."""
    return [cell(column, key) for column, key in zip(values.T, (*KEYS, ""), strict=True)]


def scores(scene: Recording, mode: DetectionMode) -> list[float]:
    """Returns HOTA, IDF1, identity switches and false groups a minute of `blob`."""
    run, truth = track("blob", scene, detections=mode), scene.truth
    assert truth is not None
    found = tracking.evaluate(truth, run, similarity="boxes")
    return [*(found[key] for key in KEYS), false_groups(run, truth) / len(run) * scene.fps * 60]


def false_groups(run: Sequence[Tracks], truth: Truth) -> float:
    """Returns the number of false groups of a run; nan if no group is labelled."""
    if truth.group is None or not (truth.group >= 0).any():
        return float("nan")
    frames: dict[int, list[bool]] = {}
    for tracks in run:
        there = truth.at(tracks.index)
        group = groups_of_tracks(tracks, there.box, there.group)
        for one in np.unique(tracks.group[tracks.group >= 0]).tolist():
            members = group[(tracks.group == one)]
            known, count = np.unique(members[members >= 0], return_counts=True)
            frames.setdefault(one, []).append(not len(known) or count.max() < 2)
    return float(sum(np.mean(wrong) > 0.5 for wrong in frames.values()))


def groups_of_tracks(tracks: Tracks, box: Array, group: Array) -> Array:
    """Returns the true group of each track (N,), -1 for nobody's, of true boxes (M, 4) and their groups (M,)."""
    found = np.full(len(tracks.id), -1)
    if not len(found) or not len(box):
        return found
    mine, theirs = (np.column_stack([b[:, :2] + b[:, 2:] / 2, b[:, 3], b[:, 2]]) for b in (tracks.box, box))
    shared = np.minimum(covered_shares(mine, theirs), covered_shares(theirs, mine).T)
    i, j = linear_sum_assignment(-shared)
    near = shared[i, j] >= 0.5
    found[i[near]] = group[j[near]]
    return found


def larger(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    box = boxes_of(frames[k])
    return np.concatenate([box[:, :2] - (LARGER - 1) / 2 * box[:, 2:], box[:, 2:] * LARGER], 1)


def late(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    return boxes_of(frames[max(k - LATE, 0)])


def near(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    box = boxes_of(frames[k])
    return box[box[:, 1] + box[:, 3] > size[1] / 2]


def poster(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    return np.concatenate([boxes_of(frames[k]), POSTER])


def merged(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    found: list[Array] = []  # left, top, right, lower edge
    for left, top, wide, high in boxes_of(frames[k]):
        box = np.array([left, top, left + wide, top + high])
        near = next((j for j, other in enumerate(found) if shared_area(box, other) >= MERGED), None)
        if near is None:
            found.append(box)
        else:
            both = np.stack([box, found[near]])
            found[near] = np.concatenate([both[:, :2].min(0), both[:, 2:].max(0)])
    box = np.reshape(found, (-1, 4))
    return np.concatenate([box[:, :2], box[:, 2:] - box[:, :2]], 1)


def shared_area(one: Array, other: Array) -> float:
    """Returns the area that two boxes (4,) left, top, right, lower edge share, over that of the smaller one."""
    side = np.maximum(np.minimum(one[2:], other[2:]) - np.maximum(one[:2], other[:2]), 0.0)
    return float(side.prod() / min((one[2:] - one[:2]).prod(), (other[2:] - other[:2]).prod()))


def half_rate(frames: list[Frame], k: int, size: tuple[int, int]) -> Array:
    return boxes_of(frames[k])[: 0 if k % 2 else None]


Fault = Callable[[list[Frame], int, tuple[int, int]], Array]
FAULTS: dict[str, Fault] = {
    "boxes 30 % too large": larger, "two frames late": late, "only the nearer half": near, "a poster": poster,
    "one box for people who overlap": merged, "no box in every second frame": half_rate,
}  # fmt: skip


def boxes_of(frame: Frame) -> Array:
    """Returns the boxes (M, 4) of a frame: left, top, width, height, px."""
    assert frame.detections is not None
    assert frame.detections.box is not None
    return frame.detections.box


def with_fault(scene: Recording, fault: Fault) -> Recording:
    """Returns the scene with other boxes, all with the score 1."""
    frames, size = list(scene.frames()), scene.image_size
    assert size is not None
    made = []
    for k, frame in enumerate(frames):
        box = fault(frames, k, size)
        found = Detections(frame.index, frame.t, "image", box[:, :2] + box[:, 2:] / 2, None, box, np.ones(len(box)))
        made.append(frame.replace(detections=found))
    return replace(scene, frames=lambda: iter(made))
