"""Mode `sweep` of `benchmarks.blob`: from pixels where the picture varies and the motion does not.

The pictures vary in tilt, depth of shadows, noise, or light. One motion for each scenario and seed is rendered in every
way. Each curve is a setting of the tracker; `boxes` is the tracker on the scenario's simulated detector. Scores are
means over scenarios and seeds with 95 % intervals (Student's t over sequences). One SVG chart for each sweep.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.support.chart import Panel, lines
from benchmarks.support.mog2 import MOG2, background_model
from benchmarks.support.tables import head, interval, row
from scenarios import load
from scenarios.errors import InputError
from sim.crowd.world import run as walk
from sim.sequence import observe
from sim.types import Motion
from tracking import evaluate, track
from tracking.stats import mean_interval

SCORES = {"HOTA": "HOTA", "MOTA": "MOTA", "IDF1": "IDF1", "group_F1": "group F1"}


@dataclass(frozen=True)
class Sweep:
    """What varies. label: of the x axis; steps: tick of the x axis → settings of the scenario; curves: name →
    (detections, parameters of the tracker)."""

    label: str
    steps: Mapping[str, Sequence[str]]
    curves: Mapping[str, tuple[str, Mapping[str, object]]]


PIXELS: tuple[str, Mapping[str, object]] = ("image", {})
BOXES: tuple[str, Mapping[str, object]] = ("file", {})
SWEEPS = {
    "tilt": Sweep(
        "tilt of the camera",
        {f"{t}°": [f"camera.tilt_deg={t}"] for t in (25, 40, 60)} | {"above": ['camera.kind="top"']},
        {"pixels": PIXELS, "boxes": BOXES},
    ),
    "shadow": Sweep(
        "depth of cast shadows",
        {str(d): [f"light.shadow={d}"] for d in (0, 0.3, 0.5, 0.7)},
        {
            "pixels": PIXELS,
            "no shadow class": ("image", {"dark": 1.0}),
            MOG2: PIXELS,
        },
    ),
    "noise": Sweep(
        "noise, grey levels",
        {str(n): [f"picture.noise={n}"] for n in (0, 3, 6, 12, 24)},
        {"pixels": PIXELS, MOG2: PIXELS},
    ),
    "light": Sweep(
        "light",
        {
            "steady": [],
            "drift": ["light.drift=0.15"],
            "lamp": ["light.switch=[{ at = 8, gain = 1.3 }]"],
            "both": ["light.drift=0.15", "light.switch=[{ at = 8, gain = 1.3 }]"],
        },
        {
            "pixels": PIXELS,
            "as trained": ("image", {"background": "trained"}),
        },
    ),
}


def sweep(parts: Sequence[str], scenarios: Sequence[str], seeds: range, out: Path) -> None:
    """Prints the table and writes the chart OUT/<sweep>.svg of each chosen sweep."""
    motions = [(name, walk(load(name), seed)) for name in scenarios for seed in seeds]
    for name in parts:
        write_sweep(name, measure(SWEEPS[name], motions), out)


def measure(chosen: Sweep, motions: Sequence[tuple[str, Motion]]) -> dict[str, np.ndarray]:
    """Returns the scores (sequences, steps, keys) of each curve; nan where no background can be learned."""
    found = {name: np.full((len(motions), len(chosen.steps), len(SCORES)), np.nan) for name in chosen.curves}
    for k, (scene, motion) in enumerate(motions):
        for step, settings in enumerate(chosen.steps.values()):
            sequence = observe(load(scene, settings), motion, streams=("left",))
            assert sequence.truth is not None
            for name, (mode, parameters) in chosen.curves.items():
                try:
                    with background_model(name):
                        run = track("blob", sequence, params=parameters, detections=mode)  # type: ignore[arg-type]
                except InputError as error:  # the noise is so large that no pixel has a background
                    print(f"  {name}: {error}")
                    continue
                scores = evaluate(sequence.truth, run)
                found[name][k, step] = [scores[key] for key in SCORES]
        print(f"  {scene} {motion.seed}", flush=True)
    return found


def write_sweep(title: str, found: Mapping[str, np.ndarray], out: Path) -> None:
    """Prints the table of a sweep and writes the chart of the same numbers."""
    chosen = SWEEPS[title]
    shape = (3, len(chosen.steps), len(SCORES))
    ends = {name: np.stack(mean_interval(v.reshape(len(v), -1))).reshape(shape) for name, v in found.items()}
    print(f"\n{title}: {len(next(iter(found.values())))} sequences")
    for k, key in enumerate(SCORES.values()):
        head([key, *chosen.steps])
        for name, (mean, low, high) in ends.items():
            row([name, *(interval(mean[j, k], low[j, k], high[j, k]) for j in range(len(chosen.steps)))])
    x = range(len(chosen.steps))
    panels = [
        Panel(name, x, {c: tuple(ends[c][:, :, k]) for c in ends}, chosen.label, "", (0.0, 1.0), list(chosen.steps))
        for k, name in enumerate(SCORES.values())
    ]
    print(lines(panels, out / f"{title}.svg"))
