"""What does the second eye earn? `stereo` beside `group-pda` and `blob` on the left pictures alone.

In the crowded scene of the suite, with more or fewer groups (the chart), and on its stairs, where a single eye that
takes everybody to stand on z = 0 is wrong. `people`: mean number of people in a frame, in all `sequences` of a row;
with --store, those of earlier runs count, too. `group-pda` tracks whole groups; the people of `blob` are grouped by the
default belief. Group scores are by hulls, as `stereo` names no members: `group F1` (group_F1_hull), `1-FP`, `1-FN` and
`MOTA` of groups, in strict frames. On the stairs also `error` of positions, m, and `found`, as in the mode `scenes`,
for tracks in the world.

Hulls of `stereo` and `blob` are compared on the ground, those of `group-pda` in the image, where errors of depth hardly
count. So `stereo, in the image` has the hulls of its groups projected to the image. `stereo - this`: paired differences
of group F1 on the same surface, `stereo` for `blob` and `stereo, in the image` for `group-pda`; * if 0 lies outside the
interval. 95 % intervals over sequences are Student's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from benchmarks.stereo.scenes import entries, position_errors, recordings
from benchmarks.stereo.stored_rows import Row, Stored
from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import head, interval, row, signed
from scenarios.loading.resolve import Entry, load
from sim.geometry.polygons import convex_hull
from sim.scene.camera import project
from sim.types import Camera, Tracks
from sim.types import Sequence as Recording
from tracking.running.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval

SCENE = "scenarios/suites/subtraction-stereo/crowded.toml"
CROWDS = (1, 2, 4, 8)
"""Groups from each side; two fifths as many come towards the camera, at least one."""
RIVALS = {"blob": "stereo", "group-pda": "stereo, in the image"}
"""Trackers of one picture, and what they are compared with."""
ROWS = ("stereo", "blob", "stereo, in the image", "group-pda")
BELOW, ABOVE = 1.0, 0.75
"""m: people's feet are so far below, their heads so far above the position of their group, the mean of its features."""
SCORES = {"group F1": "group_F1_hull", "1-FP": "group_1-FP", "1-FN": "group_1-FN", "MOTA": "group_MOTA"}
KEYS = {**SCORES, "error": "error", "found": "found"}

Curves = dict[str, dict[str, list[tuple[float, float, float]]]]


def density(args: argparse.Namespace) -> dict[str, list[str]]:
    """Prints the table, writes the chart and returns the table's rows."""
    stored = Stored(args.store)
    on_stairs = entries("stairs")
    scenes = {f"crowd {count}": _crowd(count) for count in CROWDS} | on_stairs
    for scene, entry in scenes.items():
        missing = [s for s in args.seeds if not all(stored.has(scene, name, s) for name in ROWS)]
        for seed, sequence in recordings(entry, missing):
            needed = [name for name in ROWS if not stored.has(scene, name, seed)]
            for name, found in _rows(sequence, needed, scene in on_stairs).items():
                stored.add(scene, name, seed, found)
            stored.write()
            print(f"{scene} {seed}", file=sys.stderr, flush=True)
    head(("scene", "people", "sequences", "tracker", *KEYS, "stereo - this, group F1"))
    made: dict[str, list[str]] = {}
    people: list[float] = []
    curves: Curves = {title: {name: [] for name in ROWS} for title in SCORES}
    for scene in scenes:
        by = {name: stored.rows(scene, name) for name in ROWS}
        people.append(float(np.mean([r["people"] for r in by["stereo"].values()])))
        for name in ROWS:
            values = {title: _interval([r.get(key, np.nan) for r in by[name].values()]) for title, key in KEYS.items()}
            if scene not in on_stairs:
                for title, curve in curves.items():
                    curve[name].append(values[title])
            own = by[RIVALS.get(name, name)]
            less = _interval([own[s]["group_F1_hull"] - by[name][s]["group_F1_hull"] for s in by[name]])
            cells = [*(interval(*v) for v in values.values()), signed(*less) if name in RIVALS else "–"]
            made[f"{scene} {name}"] = cells
            row([scene, f"{people[-1]:.1f}", str(len(by[name])), name, *cells])
    _chart(args, people[: len(CROWDS)], curves)
    return made


def _crowd(count: int) -> Entry:
    """Returns the crowded scene with `count` groups from each side."""
    counts = {"east": count, "west": count, "near": max(2 * count // 5, 1)}
    settings = [f"group.{id}.repeat={n}" for id, n in counts.items()]
    return Entry(f"crowd {count}", load(SCENE, settings))


def _rows(sequence: Recording, names: list[str], stairs: bool) -> dict[str, Row]:
    """Returns the scores of one sequence by row of the table, for some rows, with the mean number of people in a
    frame."""
    truth, camera = sequence.truth, sequence.camera
    assert truth is not None
    assert camera is not None
    runs: dict[str, Iterable[Tracks]] = {
        name: track(name, sequence, detections="image") for name in names if name in RIVALS
    }
    if not RIVALS.keys() >= set(names):
        runs["stereo"] = track("stereo", sequence, detections="image")
        runs["stereo, in the image"] = [in_image(t, camera) for t in runs["stereo"]]
    people = {"people": len(truth.id) / len(truth.groups or ())}
    made = {}
    for name in names:
        scores = {**evaluate(truth, runs[name]), **_places(sequence, runs[name])}
        made[name] = {key: scores[key] for key in (KEYS if stairs else SCORES).values()} | people
    return made


def _places(sequence: Recording, run: Iterable[Tracks]) -> Row:
    """Returns position errors as in the mode `scenes`; nan for tracks in the image."""
    inside = any(t.plane == "image" for t in run)
    return {"error": np.nan, "found": np.nan} if inside else position_errors(sequence, run)


def in_image(tracks: Tracks, camera: Camera) -> Tracks:
    """Returns tracks of groups in space as tracks in the image: the hulls of upright bodies on their ground hulls.

    A body reaches from BELOW to ABOVE the height of its group, which must be in front of the camera. A group's position
    is the mean of its hull's corners. Velocities are 0; events have no positions any more.
    """
    groups = tracks.groups
    assert groups is not None
    hulls = []
    for (_, _, z), hull in zip(groups.pos, groups.hull, strict=True):
        ends = [np.column_stack([hull, np.full(len(hull), height)]) for height in (z - BELOW, z + ABOVE)]
        hulls.append(convex_hull(project(camera, np.concatenate(ends))[0]))
    pos = np.array([hull.mean(0) for hull in hulls]).reshape(-1, 2)
    moved = groups.replace(pos=pos, vel=np.zeros_like(pos), hull=tuple(hulls))
    events = tuple(replace(e, pos=(np.nan, np.nan)) for e in tracks.events)
    return tracks.replace(
        plane="image", pos=pos, vel=np.zeros_like(pos), cov=np.zeros((len(pos), 4, 4)), groups=moved, events=events
    )


def _interval(values: list[float]) -> tuple[float, float, float]:
    mean, low, high = map(float, mean_interval(np.array(values)))
    return mean, low, high


def _chart(args: argparse.Namespace, people: list[float], curves: Curves) -> None:
    panels = [
        Panel(
            title,
            people,
            {name: tuple(np.array(v).T) for name, v in by.items()},
            "people in a frame",
            y_range=(0.0, 1.0),
        )
        for title, by in curves.items()
    ]
    if args.chart is not None:
        lines(panels, args.chart, 2)
