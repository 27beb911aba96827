"""Errors of the ground that boxes show, and scores of groups with it, with the camera, and with neither."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.belief.pets import CALIBRATION, known_boxes
from benchmarks.ground.scenes import Tracked
from sim.elementary import length
from sim.scene.standing import standing_points
from sim.types import Array, Camera, Tracks
from sim.types import Sequence as Recording
from tracking.grouping.belief import default_belief
from tracking.grouping.foot_points import completed, ground_below
from tracking.grouping.grouped_tracks import with_groups
from tracking.recordings.source import open_source
from tracking.running.prepare import prepare
from tracking.scoring.evaluation import Scorer

NEAR = (0.3, 4.0)  # m: people so far apart are compared
STEP = 5  # frames


class GroundError(NamedTuple):
    """Tilt, degrees, less that of the camera; height of the camera and distances between people over the true ones,
    less 1, the latter as the median of all pairs."""

    tilt_deg: float
    height: float
    distances: float


def ground_error(scene: Tracked) -> GroundError | None:
    """Returns the error of the ground that the tracks of a scene show; None if they show none."""
    found = ground_below(scene.tracks, None, scene.px_per_m, scene.sequence.image_size).camera
    truth, camera = scene.sequence.truth, scene.sequence.camera
    assert camera is not None
    assert truth.box is not None
    assert truth.pos is not None
    if found is None:
        return None
    shown = standing_points(truth.box, found)
    rows = [truth.rows(frame) for frame in range(1, truth.length + 1, STEP)]
    return _error(found, camera, [(shown[each], truth.pos[each]) for each in rows])


def _error(found: Camera, camera: Camera, places: Sequence[tuple[Array, Array]]) -> GroundError:
    """places: of people in a frame, on the ground that was found, and truly, (P, 2) each."""
    pairs = [np.triu_indices(len(true), 1) for _, true in places]
    shown, true = (
        np.concatenate([length(each[k][i] - each[k][j]) for each, (i, j) in zip(places, pairs, strict=True)])
        for k in range(2)
    )
    near = (true > NEAR[0]) & (true < NEAR[1]) & np.isfinite(shown)
    down = [np.degrees(np.arcsin(-each.rotation[2, 2])) for each in (found, camera)]
    height = float(found.position[2] / camera.position[2])
    distances = float(np.median(shown[near] / true[near])) if near.any() else float("nan")
    return GroundError(float(down[0] - down[1]), height - 1, distances - 1)


def scores(scene: Tracked) -> tuple[float, float, float]:
    """Returns the pairwise F1 of groups with the camera known, with the ground learned, and with one scale."""
    sequence, tracks, belief = scene.sequence, scene.tracks, default_belief()
    scorer = Scorer(sequence.truth.replace(camera=None, scene=None))  # scored in the image
    grouped = [
        completed(
            tracks, sequence.fps, scene.px_per_m, belief, camera=camera, scene=None, image_size=sequence.image_size
        )[0]
        for camera in (sequence.camera, None)
    ]  # fmt: skip
    grouped.append(with_groups(tracks, sequence.fps, scene.px_per_m, belief))
    known, learned, none = (float(scorer.evaluate(each, similarity="boxes")["pairwise_F1"]) for each in grouped)
    return known, learned, none


def pets(folder: Path) -> Iterator[tuple[str, GroundError | None]]:
    """Yields the name of each input, and its error against the calibration, at the labelled people."""
    bare = open_source(folder, background="spread:50")[0]
    camera = open_source(folder, camera=folder / CALIBRATION)[0].camera
    labels, truth = known_boxes(bare), bare.truth
    boxes = [t.box for t in labels[::STEP] if t.box is not None]
    assert camera is not None
    assert truth is not None
    for name in ("labels", "detections", "pixels"):
        tracks, px_per_m = (labels, truth.px_per_m) if name == "labels" else _tracks(bare, name)
        found = ground_below(tracks, None, px_per_m, bare.image_size).camera
        places = [] if found is None else [(standing_points(b, found), standing_points(b, camera)) for b in boxes]
        yield name, None if found is None else _error(found, camera, places)


def _tracks(recording: Recording, source: str) -> tuple[list[Tracks], float]:
    ready = prepare("blob", recording, detections="image" if source == "pixels" else "file")
    ready.reset(0)
    tracks = [ready.step(frame) for frame in ready.frames()]
    return tracks, ready.px_per_m(tracks)
