"""Sequences with detected boxes and true people, and what `blob` answers: for benchmarks of trackers of people."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.peers import synthetic
from scenarios import load
from sim.sequence import simulate
from sim.types import Array, Detections, Frame
from sim.types import Sequence as Recording
from tracking.running.prepare import prepare
from tracking.scoring import score_arrays

WARM = 30  # frames tracked before the clock starts
CATALOGUE = ("merge", "split", "cross", "pass-by", "side-by-side", "pillar", "door", "crowd", "clutter", "party")
# Columns frame, id and box of the rows of people.
Table = dict[str, Array]


@dataclass(frozen=True)
class Scene:
    """A sequence with detections, and its true people."""

    sequence: Recording
    truth: Table


def table_of(ids: Iterable[Array], boxes: Iterable[Array]) -> Table:
    """Returns the rows of people by frame."""
    ids, boxes = list(ids), list(boxes)
    frame = np.repeat(np.arange(1, len(ids) + 1), [len(each) for each in ids])
    return {"frame": frame, "id": np.concatenate(ids), "box": np.concatenate(boxes).reshape(-1, 4)}


def of_boxes(boxes: synthetic.Boxes) -> Scene:
    """Returns the detected boxes as a scene."""
    frames = []
    for k, rows in enumerate(boxes.found):
        box = np.ascontiguousarray(rows[:, :4])
        found = Detections(k + 1, k / boxes.fps, "image", box[:, :2] + box[:, 2:] / 2, None, box, rows[:, 4].copy())
        frames.append(Frame(k + 1, k / boxes.fps, detections=found))
    made = Recording(
        boxes.name, boxes.fps, len(frames), lambda: iter(frames), image_size=boxes.size, has_detections=True
    )
    return Scene(made, table_of(boxes.ids, boxes.truth))


def with_truth(sequence: Recording) -> Scene:
    truth = sequence.truth
    return Scene(sequence, {"frame": truth.frame, "id": truth.id, "box": truth.box})


def simulated_scenes(names: Sequence[str], seeds: range, settings: Sequence[str] = ()) -> list[Scene]:
    return [with_truth(simulate(load(name, set=settings), seed, streams=())) for name in names for seed in seeds]


def scores(scene: Scene, answer: Table) -> dict[str, float]:
    """Returns the scores of an answer."""
    return dict(score_arrays(scene.truth, answer, fps=scene.sequence.fps))


def track_blob(sequence: Recording, params: dict | None = None) -> Table:
    """Returns blob's answer."""
    ready = prepare("blob", sequence, params=params)
    ready.reset(0)
    made = [ready.tracker.step(frame, frame.detections) for frame in ready.frames()]
    return table_of([t.id for t in made], [t.box for t in made])


def cpu_seconds(tracker: type, sequence: Recording, checked: bool = False) -> float:
    """Returns the CPU time of all steps of a tracker with its defaults, s, after a first run over WARM frames; checked:
    with the checks of what goes in and comes out."""
    ready = prepare(tracker, sequence, detections="file")
    frames, seconds = list(ready.frames()), 0.0
    for part in (frames[:WARM], frames):
        ready.reset(0)
        begun = time.process_time()
        for frame in part:
            ready.step(frame) if checked else ready.tracker.step(frame, frame.detections)
        seconds = time.process_time() - begun
    return seconds
