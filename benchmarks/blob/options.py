"""Mode `options` of `benchmarks.blob`: what the parts of `blob` are worth on boxes.

Scenes: with occlusion (benchmarks/peers/synthetic.py, seeds from 400 on), the same with a second box beside one of ten,
as detectors report them, the catalogue with its own sensor (training seeds 11 and 12), and the recordings TownCentre,
PETS and TUD-Campus with their det/det.txt. Each row changes one
parameter, or replaces one part. HOTA is the difference from the defaults: with 95 % intervals paired over scenes, on
each recording as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.blob.boxes import (
    CATALOGUE,
    Scene,
    of_boxes,
    scores,
    simulated_scenes,
    track_blob,
    with_truth,
)
from benchmarks.peers import synthetic
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import difference_cell, head, row
from tracking.filters import existence
from tracking.papers.blob import tracked_people, update_from_boxes
from tracking.papers.blob import tracked_people_kernels as kernels
from tracking.recordings.source import open_source

DOUBLED = 0.1
RECORDINGS = (TOWN_CENTRE, PETS, CAMPUS)
CHANGES: dict[str, dict[str, object]] = {
    "managed by ρ": {"management": "rho"},
    "`hidden_time` 1 s": {"hidden_time": 1.0},
    "`detect_prob` 0.7": {"detect_prob": 0.7},
    "`clutter_rate` 2 /frame": {"clutter_rate": 2.0},
}
REPORTED, SURE = kernels.reported, np.array([1.0, 1.0, 0.0, 1.0, 1.0])[:, None, None]  # without variance of places
PARTS: dict[str, Replacement] = {
    "scores not learned": (existence, "LEARNED", 0),
    "no spells without detection": (existence, "SHOWN_TIME", 1e9),
    "false boxes last 0.15 s": (existence, "CLUTTER_TIME", 0.15),
    "nobody hides anybody": (kernels, "visible_shares", lambda boxes, *_: np.ones(len(boxes))),
    "no second boxes": (tracked_people, "DOUBLES", 0.0),
    "sizes change on": (update_from_boxes, "SIZE_RATE_TIME", 1e9),
    "reported while they exist": (kernels, "reported", lambda boxes, bank, *more: REPORTED(boxes, bank * SURE, *more)),
}


def options(count: int, data: Path) -> None:
    """Prints what each change is worth, with `count` scenes with occlusion."""
    walks = [synthetic.walk(seed, seconds=20) for seed in range(400, 400 + count)]
    made = [[of_boxes(walk) for walk in walks], [of_boxes(doubled(walk, seed)) for seed, walk in enumerate(walks)]]
    made += [simulated_scenes(CATALOGUE, range(11, 13))]
    made += [[with_truth(open_source(data / path, images=False)[0])] for path in RECORDINGS]
    base = [hota(scenes, {}) for scenes in made]
    head(["", "scenes with occlusion", "with second boxes", "the catalogue", *(Path(path).name for path in RECORDINGS)])
    row(["`blob`", *(f"{values.mean():.3f}" for values in base)])
    for name, change in CHANGES.items():
        row([name, *differences(made, base, change)])
    for name, part in PARTS.items():
        with replaced_code([part]):
            row([name, *differences(made, base, {})])


def doubled(walk: synthetic.Boxes, seed: int) -> synthetic.Boxes:
    """Returns the boxes with second ones: of DOUBLED of them, edges off by DOUBLED of the height."""
    r, found = np.random.default_rng(seed), []
    for rows in walk.found:
        second = rows[r.random(len(rows)) < DOUBLED]
        second[:, :4] += DOUBLED * second[:, 3:4] * r.normal(size=(len(second), 4))
        found.append(np.concatenate([rows, second]))
    return replace(walk, found=found)


def differences(made: Sequence[list[Scene]], base: Sequence[np.ndarray], change: dict[str, object]) -> list[str]:
    """Returns the cells of a row: HOTA minus `base`, with an interval where there are several scenes."""
    cells = []
    for scenes, before in zip(made, base, strict=True):
        cells.append(difference_cell(hota(scenes, change) - before))
    return cells


def hota(scenes: list[Scene], change: dict[str, object]) -> np.ndarray:
    """Returns HOTA of each scene."""
    return np.array([scores(s, track_blob(s.sequence, change))["HOTA"] for s in scenes])
