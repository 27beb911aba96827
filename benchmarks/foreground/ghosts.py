"""Mode `ghosts` of `benchmarks.foreground`: people who stand through the background sample, with and without mending.

Bare videos of 30 s at `FPS`; the sample is 112 frames or fewer of the first seconds, in which people stand. "empty
sample" has a sample without people instead: nothing should change there. Columns: HOTA and MOTA of `blob` with its
defaults, places mended per video, and mended pixels that show a person, per video.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

import tracking
from benchmarks.support.replaced_code import Replacement, replaced_code
from benchmarks.support.tables import head, row
from scenarios import load
from sim import simulate
from sim.types import Array, Bools, Frame, Sequence
from tracking.detect import ghosts
from tracking.detect.background import Background
from tracking.detect.background_settings import NEVER
from tracking.run import track

FPS, SECONDS, MOST = 7, 30, 112
VIEW = ("tilt_deg=20", "image=[480,360]", "focal_px=600", "crop=true", "baseline=0")
SCENES = {"party": 16, "queue": 16, "mixed": 16, "stop": 16, "signal": 14, "square": 14}
"""Seconds of the sample; the last three are streets seen from above."""
STREETS = "stop", "signal", "square"
WAYS: dict[str, tuple[float, list[Replacement]]] = {
    "never": (NEVER, []),
    "`ghost_time` 0.5 s": (0.5, []),
    "**`ghost_time` 1 s**": (1.0, []),
    "`ghost_time` 2 s": (2.0, []),
    "`ghost_time` 4 s": (4.0, []),
    "steps 1.3 times": (1.0, [(ghosts, "STEPS", 1.3)]),
    "steps 3 times": (1.0, [(ghosts, "STEPS", 3.0)]),
    "a quarter of the edge open": (1.0, [(ghosts, "OPEN", 0.25)]),
    "three quarters open": (1.0, [(ghosts, "OPEN", 0.75)]),
}


def compare(seeds: range) -> None:
    """Prints the table of standing people, and that of samples without people."""
    for title, standing in (("people stand in the sample", True), ("empty sample", False)):
        ways = WAYS if standing else dict(list(WAYS.items())[:3])
        found: dict[str, list[list[float]]] = {name: [] for name in ways}
        for scene in SCENES:
            for seed in seeds:
                whole, video = rendered(scene, seed, standing)
                for name, (ghost_time, changes) in ways.items():
                    found[name].append(measure(whole, video, ghost_time, changes))
        head([title, "HOTA", "MOTA", "mended", "of people, px"])
        for name, values in found.items():
            hota, mota, mended, people = np.mean(values, axis=0)
            row([name, f"{hota:.3f}", f"{mota:.3f}", f"{mended:.1f}", f"{people:.0f}"])


def rendered(name: str, seed: int, standing: bool) -> tuple[Sequence, Sequence]:
    """Returns the simulated sequence and the video to track; people more than half outside are not in its truth."""
    street = name in STREETS
    view = [] if street else [f"camera.{s}" for s in VIEW]
    source = f"scenarios/suites/streets/{name}.toml" if street else name
    whole = simulate(load(source, set=[*view, f"camera.fps={FPS}", "picture.jpeg=80"]), seed)
    frames = [frame for frame in whole.frames() if frame.index <= SECONDS * FPS]
    truth = whole.truth
    assert truth is not None
    assert truth.truncation is not None
    keep = (truth.frame <= len(frames)) & (truth.truncation < 0.5)
    columns = ("frame", "id", "group", "pos", "vel", "box", "visibility", "z", "heading", "height", "truncation")
    cut = {k: getattr(truth, k)[keep] for k in (*columns, "visible_box") if getattr(truth, k) is not None}
    none = {"groups": None, "groups_px": None, "labelled": None, "events": None, "near": None, "orders": ()}
    in_view = truth.replace(length=len(frames), **cut, **none)
    first = frames[: SCENES[name] * FPS]
    sample = np.stack([f.image for f in first[:: max(len(first) // MOST, 1)]]) if standing else whole.background()
    video = replace(
        whole, length=len(frames), frames=lambda: iter(frames), load_truth=lambda: in_view, bare=None, load_pixels=None,
        load_background=lambda: sample,
    )  # fmt: skip
    return whole, replace(video, camera=None, scene=None) if standing else video


def measure(whole: Sequence, video: Sequence, ghost_time: float, changes: list[Replacement]) -> list[float]:
    """Returns HOTA, MOTA, places mended, and mended pixels that show a person."""
    shown, mended, people = 0, 0, 0
    mend = Background.mend

    def counted(model: Background, where: Bools, colour: Array) -> None:
        nonlocal mended, people
        mended, people = mended + 1, people + int(np.count_nonzero(where & (whole.load_pixels(shown).ids > 0)))
        mend(model, where, colour)  # type: ignore[arg-type]

    def frames() -> Iterator[Frame]:
        nonlocal shown
        for frame in video.frames():
            shown = frame.index
            yield frame

    with replaced_code([(Background, "mend", counted), *changes]):
        run = track("blob", replace(video, frames=frames), params={"ghost_time": ghost_time}, detections="image")
    assert video.truth is not None
    scores = tracking.evaluate(video.truth, run, similarity="boxes")
    return [float(scores["HOTA"]), float(scores["MOTA"]), mended, people]
