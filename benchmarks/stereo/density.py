"""What does the second eye earn in a crowd? `stereo` beside `group-pda` and `blob` on the left pictures alone.

The crowded scene of the suite, with more or fewer groups. `people`: mean number of people in a frame, in all sequences
of a crowd. `group-pda` tracks whole groups; the people of `blob` are grouped by the default belief. Group scores are by
hulls, as `stereo` names no members: `group F1` (group_F1_hull), `1-FP`, `1-FN` and `MOTA` of groups, in strict frames.
`stereo - group-pda`, `stereo - blob`: paired differences of group F1; * if 0 lies outside the interval. 95 % intervals
over sequences are Student's.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

from benchmarks.stereo.scenes import recordings
from benchmarks.stereo.stored_rows import Row, Stored
from benchmarks.support.chart import Panel, lines
from benchmarks.support.tables import head, interval, row, signed
from scenarios.loading.resolve import Entry, load
from sim.types import Sequence as Recording
from tracking.run import track
from tracking.scoring import evaluate
from tracking.stats import mean_interval

SCENE = "scenarios/suites/subtraction-stereo/crowded.toml"
CROWDS = (1, 2, 3, 5, 8)
"""Groups from each side; two fifths as many come towards the camera, at least one."""
TRACKERS = ("stereo", "group-pda", "blob")
KEYS = {"group F1": "group_F1_hull", "1-FP": "group_1-FP", "1-FN": "group_1-FN", "MOTA": "group_MOTA"}


def density(args: argparse.Namespace) -> dict[str, list[str]]:
    """Prints the table, writes the chart and returns the table's rows."""
    stored = Stored(args.store)
    for count in CROWDS:
        for seed, sequence in recordings(_crowd(count), [s for s in args.seeds if not _done(stored, count, s)]):
            for name in TRACKERS:
                stored.add(f"crowd {count}", name, seed, _row(sequence, name))
            stored.write()
            print(f"crowd {count} {seed}", file=sys.stderr, flush=True)
    head(("people", "tracker", *KEYS, "stereo - this, group F1"))
    made, people = {}, []
    curves: dict[str, dict[str, list[tuple[float, float, float]]]] = {k: {t: [] for t in TRACKERS} for k in KEYS}
    for count in CROWDS:
        by = {name: stored.rows(f"crowd {count}", name) for name in TRACKERS}
        people.append(float(np.mean([r["people"] for r in by["stereo"].values()])))
        for name in TRACKERS:
            cells = []
            for title, key in KEYS.items():
                values = _interval([r[key] for r in by[name].values()])
                curves[title][name].append(values)
                cells.append(interval(*values))
            own = [by["stereo"][s]["group_F1_hull"] - by[name][s]["group_F1_hull"] for s in by[name]]
            cells.append("–" if name == "stereo" else signed(*_interval(own)))
            made[f"{people[-1]:.1f} {name}"] = cells
            row([f"{people[-1]:.1f}", name, *cells])
    _chart(args, people, curves)
    return made


def _done(stored: Stored, count: int, seed: int) -> bool:
    return all(stored.has(f"crowd {count}", name, seed) for name in TRACKERS)


def _crowd(count: int) -> Entry:
    """Returns the crowded scene with `count` groups from each side."""
    counts = {"east": count, "west": count, "near": max(2 * count // 5, 1)}
    settings = [f"group.{id}.repeat={n}" for id, n in counts.items()]
    return Entry(f"crowd {count}", load(SCENE, settings))


def _row(sequence: Recording, name: str) -> Row:
    """Returns the group scores of a tracker on one sequence, and the mean number of people in a frame."""
    truth = sequence.truth
    assert truth is not None
    scores = evaluate(truth, track(name, sequence, detections="image"))
    return {key: scores[key] for key in KEYS.values()} | {"people": len(truth.id) / len(truth.groups or ())}


def _interval(values: list[float]) -> tuple[float, float, float]:
    known = np.array(values)[np.isfinite(values)]
    mean, low, high = mean_interval(known[:, None])
    return float(mean[0]), float(low[0]), float(high[0])


def _chart(
    args: argparse.Namespace, people: list[float], curves: dict[str, dict[str, list[tuple[float, float, float]]]]
) -> None:
    panels = [
        Panel(title, people, {name: tuple(np.array(v).T) for name, v in by.items()}, "people in a frame")
        for title, by in curves.items()
    ]
    lines(panels, args.chart, 2)
