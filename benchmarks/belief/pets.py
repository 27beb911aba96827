"""Mode `pets` of `benchmarks.belief`: the couples of PETS09-S2L1-first200, from pixels and from boxes.

Two couples were found by eye in the pictures and in the labelled places (`COUPLES`); the other labelled people walk
alone. Precision and recall of pairs of one frame, people compared by the overlap of boxes. gt: labelled boxes with
their ids; det: the detector's boxes, tracked by `blob`; pixels: tracked by `blob`. Camera: known (the calibration of
the recording), learned (from the boxes), or none (one scale for near and far).
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from benchmarks.support.options import PETS
from benchmarks.support.tables import head, number, row
from scenarios.errors import InputError
from sim.types import Sequence as Recording
from sim.types import Tracks, Truth
from tracking.grouping.belief import Belief
from tracking.grouping.foot_points import completed
from tracking.grouping.grouped_tracks import groups_in_frames, with_groups
from tracking.grouping.known_people import people_as_tracks
from tracking.recordings.source import open_source
from tracking.running.prepare import prepare
from tracking.scoring.evaluation import evaluate

# Labelled ids, first and last frame: 11 and 12 enter together and stay; 9 and 15 meet, turn, and walk on together.
COUPLES = ((11, 12, 22, 200), (9, 15, 24, 200))
CALIBRATION = "View_001.xml"


def with_couples(truth: Truth) -> Truth:
    """Returns the labelled people in the image, with the couples as their groups. Raises InputError if a person of a
    couple is not labelled."""
    group = np.full(len(truth.id), -1)
    for couple, (a, b, first, last) in enumerate(COUPLES, 1):
        for id in (a, b):
            own = (truth.id == id) & (truth.frame >= first) & (truth.frame <= last)
            if not own.any():
                raise InputError(
                    file=truth.name, got=f"no person {id} in frames {first} to {last}", expected="the labels of PETS09",
                    remedy=f"give the folder with {PETS} by --data",
                )  # fmt: skip
            group[own] = couple
    none = dict.fromkeys(("pos", "vel", "camera", "scene", "groups", "events", "near"))
    in_image = truth.replace(group=group, labelled=np.ones(truth.length, bool), **none)
    labels = [group[truth.rows(index)] for index in range(1, truth.length + 1)]
    shapes = groups_in_frames(people_as_tracks(in_image), labels=labels)
    return in_image.replace(groups_px=tuple(shapes))


def known_boxes(recording: Recording) -> list[Tracks]:
    """Returns the labelled boxes with their ids, in the image."""
    truth = recording.truth
    assert truth is not None
    return people_as_tracks(truth.replace(pos=None, vel=None))


def tracked(recording: Recording, mode: str) -> list[Tracks]:
    """Returns the people that `blob` reports."""
    ready = prepare("blob", recording, detections="image" if mode == "pixels" else "file")
    ready.reset(0)
    return [ready.step(frame) for frame in ready.frames()]


def runs(folder: Path) -> Iterator[tuple[str, str, Recording, Sequence[Tracks]]]:
    """Yields input, camera, recording and tracks of people without groups."""
    for camera in ("known", "learned", "none"):
        calibration = folder / CALIBRATION if camera == "known" else None
        recording = open_source(folder, camera=calibration, background="spread:50")[0]
        yield "gt", camera, recording, known_boxes(recording)
        yield "det", camera, recording, tracked(recording, "det")
        yield "pixels", camera, recording, tracked(recording, "pixels")


def pets(data: Path, belief: Belief, before: Belief | None) -> None:
    """Prints the table."""
    beliefs: Mapping[str, Belief] = {"belief": belief, **({} if before is None else {"before": before})}
    columns = [f"{name}, {what}" for name in beliefs for what in ("precision", "recall")]
    head(["input", "camera", *columns])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        for source, camera, recording, people in runs(data / PETS):
            cells = [number(x) for b in beliefs.values() for x in pair_scores(camera, recording, people, b)]
            row([source, camera, *cells])


def pair_scores(camera: str, recording: Recording, people: Sequence[Tracks], belief: Belief) -> tuple[float, float]:
    """Returns precision and recall of the pairs that a belief finds among tracked people."""
    truth = recording.truth
    assert truth is not None
    truth = with_couples(truth)
    if camera == "none":
        tracks = with_groups(people, recording.fps, truth.px_per_m, belief)
    else:
        tracks, _ = completed(
            people, recording.fps, truth.px_per_m, belief, camera=recording.camera, scene=recording.scene,
            image_size=recording.image_size,
        )  # fmt: skip
    found = evaluate(truth, tracks, similarity="boxes")
    return float(found["pairwise_precision"]), float(found["pairwise_recall"])
