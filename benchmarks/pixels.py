"""`blob` from pixels where the picture varies and the motion does not: tilt, shadows, noise, light.

    PYTHONPATH=. python benchmarks/pixels.py [tilt shadow noise light] [--seeds 0:10] [--scenes cross merge] [--out DIR]

One motion for each scene and seed, rendered in every way; the tracker's parameters are its defaults, or what the curve
names. Scores are means over scenes and seeds with 95 % intervals (bootstrap over sequences); `boxes` is the same
tracker on the scenario's simulated detector. DIR gets one SVG for each sweep.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.chart import Panel, lines
from scenarios import load
from scenarios.errors import InputError
from sim.crowd.world import run as walk
from sim.sequence import observe
from sim.types import Motion
from tracking import evaluate, track
from tracking.stats import bootstrap

SHOWN = {"HOTA": "HOTA", "MOTA": "MOTA", "IDF1": "IDF1", "group_F1": "group F1"}


@dataclass(frozen=True)
class Sweep:
    """What varies. steps: what the x axis says → settings of the scenario; curves: name → (detections, parameters)."""

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
            "no shadow classes": ("image", {"dark": 1.0, "bright": 1.0}),
            "MOG2": ("image", {"segmentation": "mog2"}),
        },
    ),
    "noise": Sweep(
        "noise, grey levels",
        {str(n): [f"picture.noise={n}"] for n in (0, 3, 6, 12, 24)},
        {"pixels": PIXELS, "MOG2": ("image", {"segmentation": "mog2"})},
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
            "no global gain": ("image", {"gain": "none"}),
            "one rate, 20 s": ("image", {"foreground_time": 20.0}),
        },
    ),
}


def motions(scenes: Sequence[str], seeds: range) -> list[tuple[str, Motion]]:
    return [(name, walk(load(name), seed)) for name in scenes for seed in seeds]


def measure(sweep: Sweep, made: Sequence[tuple[str, Motion]]) -> dict[str, np.ndarray]:
    """Scores (sequences, steps, keys) of each curve."""
    found = {name: np.full((len(made), len(sweep.steps), len(SHOWN)), np.nan) for name in sweep.curves}
    for k, (scene, motion) in enumerate(made):
        for step, settings in enumerate(sweep.steps.values()):
            sequence = observe(load(scene, settings), motion, streams=("left",))
            assert sequence.truth is not None
            for name, (mode, parameters) in sweep.curves.items():
                try:
                    run = track("blob", sequence, params=parameters, detections=mode)  # type: ignore[arg-type]
                except InputError as error:  # so noisy that no background can be had: no score, in the chart neither
                    print(f"  {name}: {error}")
                    continue
                scores = evaluate(sequence.truth, run)
                found[name][k, step] = [scores[key] for key in SHOWN]
        print(f"  {scene} {motion.seed}", flush=True)
    return found


def tell(title: str, sweep: Sweep, found: Mapping[str, np.ndarray], out: Path) -> None:
    """The table, and the chart of the same numbers."""
    shape = (3, len(sweep.steps), len(SHOWN))
    ends = {name: np.stack(bootstrap(v.reshape(len(v), -1))).reshape(shape) for name, v in found.items()}
    print(f"\n{title}: {len(next(iter(found.values())))} sequences")
    for k, key in enumerate(SHOWN.values()):
        for name, (mean, low, high) in ends.items():
            cells = "  ".join(
                f"{step} {mean[j, k]:.3f} [{low[j, k]:.3f}, {high[j, k]:.3f}]" for j, step in enumerate(sweep.steps)
            )
            print(f"{key:9} {name:22} {cells}")
    x = range(len(sweep.steps))
    panels = [
        Panel(name, x, {c: tuple(ends[c][:, :, k]) for c in ends}, sweep.label, "", (0.0, 1.0), list(sweep.steps))
        for k, name in enumerate(SHOWN.values())
    ]
    print(lines(panels, out / f"{title}.svg"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sweep", nargs="*", choices=[*SWEEPS, []], help="all where absent")
    parser.add_argument("--seeds", default="0:10", help="half-open range a:b")
    parser.add_argument("--scenes", nargs="+", default=["merge", "cross", "pass-by", "side-by-side"])
    parser.add_argument("--out", type=Path, default=Path("pixels"))
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    made = motions(arguments.scenes, range(first, last))
    for name in arguments.sweep or SWEEPS:
        tell(name, SWEEPS[name], measure(SWEEPS[name], made), arguments.out)


if __name__ == "__main__":
    main()
