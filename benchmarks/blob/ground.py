"""Mode `ground` of `benchmarks.blob`: what the ground that boxes show is worth to groups, with the camera withheld.

`blob` tracks the simulated boxes of the suite standard once, from several cameras. Its people are then grouped with
each part of the estimate left out or replaced, and scored in the image. `with its camera`: the true camera is given.
The first row is the pairwise F1, the others are differences from it, paired over sequences.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import tracking
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.loading.resolve import Entry, resolve
from sim.sequence import simulate
from sim.types import Array, Sequence
from tracking.grouping import foot_points, ground_of_boxes
from tracking.grouping.ground_of_boxes import Ground
from tracking.running.run import TrackingRun
from tracking.scoring.evaluation import Scorer

CAMERAS: Mapping[str, tuple[str, ...]] = {
    "the suite's camera": (),
    "low": ("camera.tilt_deg=5", "camera.height=2"),
    "25 degrees": ("camera.tilt_deg=25", "camera.focal_px=900", "sensor.detect_prob=0.7", "camera.fps=5"),
    "65 degrees": ("camera.tilt_deg=65",),
}
PARTS: Mapping[str, Replacement] = {
    "one scale for near and far": (foot_points, "ground_of_boxes", lambda *_: Ground()),
    "by 100 boxes": (ground_of_boxes, "BOXES", 100),
    "by all boxes": (ground_of_boxes, "BOXES", 10**9),
    "boxes that agree less, too": (ground_of_boxes, "SURE", 1.0),
    "lone deviations not bounded": (ground_of_boxes, "FARTHEST", 100.0),
}


Tracked = tuple[Sequence, TrackingRun]


def tracked(entry: Entry, seed: int) -> Tracked:
    """Returns a simulated sequence, and blob's tracks of it without its camera."""
    sequence = simulate(entry.scenario, seed, entry.repeat, streams=())
    return sequence, tracking.track("blob", _bare(sequence), detections="file")


def pairwise(scenes: list[Tracked], known: bool = False) -> Array:
    """Returns the pairwise F1 of each sequence, (S,); known: the camera is known."""
    found = []
    for sequence, run in scenes:
        assert sequence.truth is not None
        grouped = tracking.group(sequence if known else _bare(sequence), run)
        truth = sequence.truth.replace(camera=None, scene=None)  # scored in the image
        found.append(Scorer(truth).evaluate(grouped, similarity="boxes")["pairwise_F1"])
    return np.array(found)


def _bare(sequence: Sequence) -> Sequence:
    return replace(sequence, camera=None, scene=None, px_per_m=float("nan"))


def ground(seeds: range) -> None:
    """Prints the table."""
    warnings.simplefilter("ignore", UserWarning)  # of what a part that is left out makes of its tracks
    made = {name: [tracked(entry, s) for entry in resolve("standard", settings) for s in seeds]
            for name, settings in CAMERAS.items()}  # fmt: skip
    head(["", *CAMERAS])
    base = {name: pairwise(scenes) for name, scenes in made.items()}
    row(["`blob`", *(mean_cell(values) for values in base.values())])
    for name, part in PARTS.items():
        with replaced_code([part]):
            row([name, *(difference_cell(pairwise(scenes) - base[key]) for key, scenes in made.items())])
    row(["with its camera", *(difference_cell(pairwise(s, known=True) - base[key]) for key, s in made.items())])
