"""What does the second eye earn? `stereo` beside `group-pda` and `blob` on the left pictures alone.

In the crowded scene of the suite, with more or fewer groups (the chart), and on its stairs, where a single eye that
takes everybody to stand on z = 0 is wrong. `people`: mean number of people in a frame, in all sequences of a row.
`group-pda` tracks whole groups; the people of `blob` are grouped by the default belief. Group scores are by hulls, as
`stereo` names no members: `group F1` (group_F1_hull), `1-FP`, `1-FN` and `MOTA` of groups, in strict frames. On the
stairs also `error` of positions, m, and `found`, as in the mode `scenes`, for tracks in the world. `stereo - this`:
paired differences of group F1; * if 0 lies outside the interval. 95 % intervals over sequences are Student's.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from benchmarks.stereo.scenes import entries, position_errors, recordings
from benchmarks.stereo.stored_rows import Row, Stored
from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import head, interval, row, signed
from scenarios.loading.resolve import Entry, load
from sim.types import Sequence as Recording
from tracking.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval

SCENE = "scenarios/suites/subtraction-stereo/crowded.toml"
CROWDS = (1, 2, 4, 8)
"""Groups from each side; two fifths as many come towards the camera, at least one."""
TRACKERS = ("stereo", "group-pda", "blob")
SCORES = {"group F1": "group_F1_hull", "1-FP": "group_1-FP", "1-FN": "group_1-FN", "MOTA": "group_MOTA"}
KEYS = {**SCORES, "error": "error", "found": "found"}

Curves = dict[str, dict[str, list[tuple[float, float, float]]]]


def density(args: argparse.Namespace) -> dict[str, list[str]]:
    """Prints the table, writes the chart and returns the table's rows."""
    stored = Stored(args.store)
    on_stairs = entries("stairs")
    scenes = {f"crowd {count}": _crowd(count) for count in CROWDS} | on_stairs
    for scene, entry in scenes.items():
        missing = [s for s in args.seeds if not all(stored.has(scene, name, s) for name in TRACKERS)]
        for seed, sequence in recordings(entry, missing):
            for name in TRACKERS:
                stored.add(scene, name, seed, _row(sequence, name, scene in on_stairs))
            stored.write()
            print(f"{scene} {seed}", file=sys.stderr, flush=True)
    head(("scene", "people", "tracker", *KEYS, "stereo - this, group F1"))
    made: dict[str, list[str]] = {}
    people: list[float] = []
    curves: Curves = {title: {name: [] for name in TRACKERS} for title in SCORES}
    for scene in scenes:
        by = {name: stored.rows(scene, name) for name in TRACKERS}
        people.append(float(np.mean([r["people"] for r in by["stereo"].values()])))
        for name in TRACKERS:
            values = {title: _interval([r.get(key, np.nan) for r in by[name].values()]) for title, key in KEYS.items()}
            if scene not in on_stairs:
                for title, curve in curves.items():
                    curve[name].append(values[title])
            own = [by["stereo"][s]["group_F1_hull"] - by[name][s]["group_F1_hull"] for s in by[name]]
            cells = [*(interval(*v) for v in values.values()), "–" if name == "stereo" else signed(*_interval(own))]
            made[f"{scene} {name}"] = cells
            row([scene, f"{people[-1]:.1f}", name, *cells])
    _chart(args, people[: len(CROWDS)], curves)
    return made


def _crowd(count: int) -> Entry:
    """Returns the crowded scene with `count` groups from each side."""
    counts = {"east": count, "west": count, "near": max(2 * count // 5, 1)}
    settings = [f"group.{id}.repeat={n}" for id, n in counts.items()]
    return Entry(f"crowd {count}", load(SCENE, settings))


def _row(sequence: Recording, name: str, stairs: bool) -> Row:
    """Returns the scores of a tracker on one sequence, and the mean number of people in a frame."""
    truth = sequence.truth
    assert truth is not None
    run = track(name, sequence, detections="image")
    scores = {**evaluate(truth, run), **position_errors(sequence, run)}
    return {key: scores[key] for key in (KEYS if stairs else SCORES).values()} | {
        "people": len(truth.id) / len(truth.groups or ())
    }


def _interval(values: list[float]) -> tuple[float, float, float]:
    known = np.array(values)[np.isfinite(values)]
    if not len(known):
        return np.nan, np.nan, np.nan
    mean, low, high = mean_interval(known[:, None])
    return float(mean[0]), float(low[0]), float(high[0])


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
    lines(panels, args.chart, 2)
