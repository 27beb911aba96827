"""Mode `opening` of `benchmarks.foreground`: what the opening of the foreground mask earns, over scale and noise.

Rendered scenes at 20, 40 and 80 px per m, with little and with much noise. The disc of the opening is left out, has at
least 3 px, or at least 5 px; its nominal width is OPEN_M at the scale. Columns: F1 of foreground pixels against the
exact people, false blobs per frame (under a tenth of their pixels are of people), other blobs per connected region of
people, and HOTA of `blob` with its defaults.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

import tracking
from benchmarks.support.tables import head, interval, row
from scenarios import load
from sim import simulate
from sim.types import Sequence
from tracking.detect import blobs
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.foreground import Foreground
from tracking.run import track
from tracking.stats import mean_interval

WAYS = {"none": 0, "at least 3 px": 3, "at least 5 px": 5}
SCALES, NOISES, SCENES = (20, 40, 80), (3, 12), ("cross",)
EVERY, FALSE = 5, 0.1


@contextmanager
def opened(least: int) -> Iterator[None]:
    """Sets the least disc of the opening, px; 0 leaves the opening out."""
    kept = blobs.OPEN_M, blobs.LEAST_OPEN
    blobs.OPEN_M, blobs.LEAST_OPEN = (blobs.OPEN_M, least) if least else (0.0, 1)
    try:
        yield
    finally:
        blobs.OPEN_M, blobs.LEAST_OPEN = kept


def opening(seeds: range) -> None:
    """Prints a table for each scale and noise: means over scenes and seeds; differences from "none" with intervals."""
    for scale in SCALES:
        for noise in NOISES:
            made = [scene(name, scale, noise, seed) for name in SCENES for seed in seeds]
            found = {}
            for name, least in WAYS.items():
                with opened(least):
                    found[name] = np.array([measure(s) for s in made])
            head([f"{scale} px per m, noise {noise}", "F1", "false blobs", "blobs per region", "HOTA", "HOTA gained"])
            for name, values in found.items():
                gain = mean_interval((values - found["none"])[:, 3:])
                row([name, *(f"{v:.3f}" for v in np.nanmean(values, 0)), interval(*(float(g[0]) for g in gain))])


def scene(name: str, scale: int, noise: int, seed: int) -> Sequence:
    """Returns 8 s of a scene at this scale and noise (grey levels), from a camera tilted by 25 degrees.

    scale: px per m of a person 9 m away. Image and focal length grow with it, so that every scale shows the same view.
    """
    settings = [f"camera.image=[{12 * scale},{9 * scale}]", f"camera.focal_px={9 * scale}", "camera.tilt_deg=25"]
    settings += ["camera.fps=7", "camera.crop=true", "camera.baseline=0", "duration=8", f"picture.noise={noise}"]
    return simulate(load(name, set=settings), seed)


def measure(sequence: Sequence) -> list[float]:
    """Returns F1 of foreground pixels, false blobs per frame, blobs per region of people, and HOTA of `blob`."""
    from tracking.prepare import prepare

    context = prepare("blob", sequence, detections="image").context
    foreground = Foreground(context, BackgroundSettings())
    hit = false = missed = wrong = pieces = regions = frames = 0
    for frame in sequence:
        if frame.index % EVERY:
            continue
        assert frame.image is not None
        truth = sequence.frame_truth(frame.index)
        assert truth is not None
        assert truth.pixels is not None
        person = truth.pixels.ids > 0
        mask = foreground.segment(frame.image).mask
        hit, false, missed = (
            hit + (mask & person).sum(),
            false + (mask & ~person).sum(),
            missed + (person & ~mask).sum(),
        )
        found, frames = foreground.person_blobs(mask), frames + 1
        inside = np.bincount(found.label[person], minlength=len(found) + 1)[1:]
        wrong += int((inside < FALSE * found.area).sum())
        pieces += int((inside >= FALSE * found.area).sum())
        regions += len(np.unique(truth.pixels.blob[truth.pixels.blob >= 0]))
    assert sequence.truth is not None
    hota = tracking.evaluate(sequence.truth, track("blob", sequence, detections="image"), similarity="boxes")["HOTA"]
    return [2 * hit / max(2 * hit + false + missed, 1), wrong / frames, pieces / max(regions, 1), float(hota)]
