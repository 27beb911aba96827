"""What does the second eye earn? `stereo` beside `group-pda` and `blob` on the left pictures alone.

In the crowded scene of the suite, with more or fewer groups, and on its stairs, where a single eye that takes everybody
to stand on z = 0 is wrong. `people`: mean number of people in a frame. `group-pda` tracks whole groups; the people of
`blob` are grouped by the default belief. Group scores are by hulls, as `stereo` names no members: `group F1`
(group_F1_hull), `1-FP`, `1-FN` and `MOTA` of groups, in strict frames. `ground`: mean position error on the ground, m,
and `found`, as in the mode `scenes`, for tracks in the world.

Hulls of `stereo` and `blob` are compared on the ground, those of `group-pda` in the image, where errors of depth hardly
count. So `stereo, in the image` has the hulls of its groups projected to the image. `stereo - this`: paired differences
of group F1 on the same surface, `stereo, in the image` for `group-pda` and `stereo` for the others; * if 0 lies outside
the interval. 95 % intervals over sequences are Student's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from benchmarks.stereo.scenes import Row, entries, position_errors, recordings
from benchmarks.support.tables import difference_cell, head, mean_cell, row
from scenarios.loading.resolve import Entry, load
from sim.geometry.hull_kernels import convex_hull
from sim.scene.camera import project
from sim.types import Camera, Tracks
from sim.types import Sequence as Recording
from tracking.running.run import track
from tracking.scoring import evaluate

SCENE = "scenarios/suites/subtraction-stereo/crowded.toml"
# Groups from each side; two fifths as many come towards the camera, at least one.
CROWDS = (2, 8)
# Wider spheres and trackers of one picture, and what they are compared with.
RIVALS = {"stereo, radius 0.8": "stereo", "blob": "stereo", "group-pda": "stereo, in the image"}
ROWS = ("stereo", "stereo, radius 0.8", "blob", "stereo, in the image", "group-pda")
# m: people's feet and heads are so far from the height of their group, the middle of their bodies.
HALF = 0.85
KEYS = {"group F1": "group_F1_hull", "1-FP": "group_1-FP", "1-FN": "group_1-FN", "MOTA": "group_MOTA",
        "ground, m": "ground", "found": "found"}  # fmt: skip

ALIKE = {"ground": "RMSE_pos", "found": "HOTA"}  # scores of the catalogue with the same range


def density(args: argparse.Namespace) -> dict[str, dict[str, list[Row]]]:
    """Prints the table, and returns the rows by scene and tracker."""
    head(("scene", "people", "sequences", "tracker", *KEYS, "stereo - this, group F1"))
    made: dict[str, dict[str, list[Row]]] = {}
    for scene, entry in {**{f"crowd {n}": _crowd(n) for n in CROWDS}, "stairs": entries()["stairs"]}.items():
        by = made.setdefault(scene, {name: [] for name in ROWS})
        people = []
        for sequence in recordings(entry, args.seeds):
            assert sequence.truth is not None
            people.append(len(sequence.truth.id) / sequence.truth.length)
            for name, found in _rows(sequence).items():
                by[name].append(found)
            print(f"{scene} {len(people)}", file=sys.stderr, flush=True)
        for name, rows in by.items():
            own = by[RIVALS.get(name, name)]
            less = [a["group_F1_hull"] - b["group_F1_hull"] for a, b in zip(own, rows, strict=True)]
            cells = [mean_cell([r.get(key, np.nan) for r in rows], ALIKE.get(key, key)) for key in KEYS.values()]
            difference = difference_cell(less) if name in RIVALS else "–"
            row([scene, f"{np.mean(people):.1f}", str(len(rows)), name, *cells, difference])
    return made


def _crowd(count: int) -> Entry:
    """Returns the crowded scene with `count` groups from each side."""
    counts = {"east": count, "west": count, "near": max(2 * count // 5, 1)}
    settings = [f"group.{id}.repeat={n}" for id, n in counts.items()]
    return Entry(f"crowd {count}", load(SCENE, settings))


def _rows(sequence: Recording) -> dict[str, Row]:
    """Returns the scores of one sequence by row of the table."""
    truth, camera = sequence.truth, sequence.camera
    assert truth is not None
    assert camera is not None
    runs: dict[str, Iterable[Tracks]] = {
        name: track(name, sequence, detections="image") for name in ("stereo", "blob", "group-pda")
    }
    runs["stereo, radius 0.8"] = track("stereo", sequence, params={"radius": 0.8}, detections="image")
    runs["stereo, in the image"] = [in_image(t, camera) for t in runs["stereo"]]
    made = {}
    for name in ROWS:
        on_ground = not any(t.plane == "image" for t in runs[name])
        made[name] = {**evaluate(truth, runs[name]), **(position_errors(sequence, runs[name]) if on_ground else {})}
    return made


def in_image(tracks: Tracks, camera: Camera) -> Tracks:
    """Returns tracks of groups in space as tracks in the image: the hulls of upright bodies on their ground hulls.

    A body reaches HALF below and above the height of its group, which must be in front of the camera. A group's
    position is the mean of its hull's corners. Velocities are 0; events have no positions any more.
    """
    groups = tracks.groups
    assert groups is not None
    hulls = []
    for (_, _, z), hull in zip(groups.pos, groups.hull, strict=True):
        ends = [np.column_stack([hull, np.full(len(hull), height)]) for height in (z - HALF, z + HALF)]
        hulls.append(convex_hull(project(camera, np.concatenate(ends))[0]))
    pos = np.array([hull.mean(0) for hull in hulls]).reshape(-1, 2)
    moved = groups.replace(pos=pos, vel=np.zeros_like(pos), hull=tuple(hulls))
    events = tuple(replace(e, pos=(np.nan, np.nan)) for e in tracks.events)
    return tracks.replace(
        plane="image", pos=pos, vel=np.zeros_like(pos), cov=np.zeros((len(pos), 4, 4)), groups=moved, events=events
    )
