"""Simulated scenes before cameras that are drawn at random, tracked by `blob` without their camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from benchmarks.belief.cameras import detector
from benchmarks.support.options import CAMPUS, PETS, TOWN_CENTRE
from scenarios.errors import FlockscopeError
from scenarios.loading.resolve import Entry, resolve
from sim.crowd.world import run as walk
from sim.sequence import LabelledSequence, observe, simulate
from sim.types import Tracks
from tracking.running.prepare import prepare

Source = Literal["boxes", "pixels"]
SUITES = ("standard", "streets")
# Ends of what is drawn: height, m (its logarithm is uniform), tilt, degrees, focal length, widths of the picture.
HEIGHT, TILT, FOCAL = (2.2, 12.0), (3.0, 50.0), (0.75, 1.45)
IMAGE = {"boxes": (1280, 720), "pixels": (480, 270)}
LENGTH = {"boxes": 30.0, "pixels": 20.0}  # s
FPS = 10.0


@dataclass(frozen=True)
class Tracked:
    """A scene with its truth and its camera, what `blob` reported of it, and the image scale of these tracks."""

    sequence: LabelledSequence
    tracks: tuple[Tracks, ...]
    px_per_m: float
    tilt_deg: float


def tracked(source: Source, seeds: range, data: Path) -> Iterator[Tracked]:
    """Yields the scene of each seed: an entry of the suites and a camera, both drawn by the seed, and for boxes a
    detector that is fitted to a recording. Scenes that do not fit before their
    camera, or whose orders need more time, are left out."""
    entries = [entry for suite in SUITES for entry in resolve(suite)]
    for seed in seeds:
        r = np.random.default_rng(seed)
        entry = entries[int(r.integers(len(entries)))]
        try:
            yield _tracked(source, entry, seed, r, data)
        except FlockscopeError as error:
            print(f"seed {seed}, {entry.name}: {error.line()}", flush=True)


def _tracked(source: Source, entry: Entry, seed: int, r: np.random.Generator, data: Path) -> Tracked:
    height, tilt, focal = float(np.exp(r.uniform(*np.log(HEIGHT)))), float(r.uniform(*TILT)), float(r.uniform(*FOCAL))
    place = {"kind": "pinhole", "image": IMAGE[source], "focal_px": focal * IMAGE[source][0], "tilt_deg": tilt}
    free = {"height": height, "position": None, "yaw_deg": None, "px_per_m": None, "crop": True, "fps": FPS}
    camera = entry.scenario.camera.model_copy(update={**place, **free})
    changed = {"camera": camera, "duration": min(entry.scenario.duration, LENGTH[source])}
    scenario = entry.scenario.model_copy(update=changed)
    if source == "boxes":
        recording = (CAMPUS, PETS, TOWN_CENTRE)[int(r.integers(3))]
        scenario = scenario.model_copy(update={"sensor": detector(data / recording)})
        sequence = observe(scenario, walk(scenario, seed, entry.repeat))
    else:
        sequence = simulate(scenario, seed, entry.repeat, streams=("left", "background"))
    bare = replace(sequence, camera=None, scene=None, px_per_m=float("nan"))
    ready = prepare("blob", bare, detections="file" if source == "boxes" else "image")
    ready.reset(0)
    tracks = tuple(ready.step(frame) for frame in ready.frames())
    _ = sequence.truth  # an order that was not carried out is an error here
    return Tracked(sequence, tracks, ready.px_per_m(tracks), tilt)
