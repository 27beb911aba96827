"""Mode `adaptation` of `benchmarks.foreground`: lasting changes of the scene, and how a background model absorbs them.

`adaptation` prints tables and writes a chart with one panel for each change, and one for changing light.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.support.chart import Panel, lines
from benchmarks.support.replaced_code import replaced_code
from scenarios import load
from sim import simulate
from sim.types import Sequence
from tracking.detect import background
from tracking.detect.background import BACKGROUND, Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings

SECONDS, CHANGE, DRAWN = 900, 60, 6
"""s: length of the video, time of the change, step between drawn points."""
RATES = {
    "two rates: 20 s, 200 s": (20.0, 10.0),
    "one rate: 20 s": (20.0, 1.0),
    "one rate: 200 s": (200.0, 1.0),
    "20 s, foreground left alone": (20.0, math.inf),
}
"""Time constant of background pixels, s, and how many times as slowly foreground adapts."""


class FixedGain(Background):
    """The model without the gain of each frame."""

    def _estimate_gain(self, image: np.ndarray) -> np.ndarray:
        del image
        return self.gain


GAINS = {"two rates: 20 s, 200 s": Background, "gain not followed": FixedGain}
Alter = Callable[[np.ndarray, int], np.ndarray]
"""An empty frame and its time, s, to the frame with the change."""


def adaptation(seed: int, out: Path) -> None:
    """Prints how long each change stays foreground, and writes the chart."""
    panels = [*_changes(seed), _changing_light(seed)]
    print(f"\nwrote {lines(panels, out)}")


def _simulated(name: str, seed: int) -> Sequence:
    return simulate(load(name, ["camera.image=[320,240]"]), seed)


def _person(sequence: Sequence) -> tuple[np.ndarray, np.ndarray]:
    """Returns the frame and the mask of the largest lone person among every tenth frame."""
    best = (0.0, None, None)
    for frame in sequence:
        if frame.index % 10 == 0:
            pixels = sequence.load_pixels(frame.index)
            alone = [b >= 0 and np.sum(pixels.blob == b) == 1 for b in pixels.blob]
            for row, px in enumerate(np.where(alone, pixels.visible_px, 0)):
                if px > best[0]:
                    id = sequence.frame_truth(frame.index).id[row]
                    best = (px, frame.image, pixels.ids == id)
    assert best[1] is not None
    return best[1], best[2]


def _empty_frames(sample: np.ndarray, seed: int) -> Iterator[np.ndarray]:
    """Yields the frames of the sample in random order, without end."""
    rng = np.random.default_rng(seed)
    while True:
        yield from sample[rng.permutation(len(sample))]


def _foreground_share(
    sample: np.ndarray, frames: Iterator[np.ndarray], where: np.ndarray, rates: tuple[float, float],
    protected: np.ndarray | None = None,
) -> list[float]:  # fmt: skip
    """Returns the share of the pixels `where` that is called foreground, one value per frame."""
    time, slower = rates
    model, curve = Background(sample, 1.0, BackgroundSettings(background_time=time)), []
    with replaced_code([(background, "FOREGROUND_SLOWER", slower)]):
        for frame in frames:
            classes = model.classify(frame)
            curve.append(float(fused_foreground(classes)[where].mean()))
            model.adapt(frame, classes, protected)
    return curve


def _spot(size: tuple[int, int]) -> np.ndarray:
    """Returns a soft round light in the middle of the image, (H, W), 0 to 1."""
    v, u = np.mgrid[: size[0], : size[1]]
    return np.exp(-(((u - size[1] / 2) / 25) ** 2 + ((v - size[0] / 2) / 18) ** 2))


def _changes(seed: int) -> list[Panel]:
    sequence = _simulated("merge", seed)
    sample = sequence.background()
    assert sample is not None
    size = sample.shape[1:3]
    lamp = 1 + 1.2 * _spot(size)[..., None] * np.array([0.3, 0.7, 1.0])
    thing = np.zeros(size, bool)
    thing[140:165, 60:95] = True
    shown, mask = _person(sequence)

    def with_lamp(frame: np.ndarray, t: int) -> np.ndarray:
        return np.clip(frame * lamp, 0, 255).astype(np.uint8) if t >= CHANGE else frame

    def with_thing(frame: np.ndarray, t: int) -> np.ndarray:
        return np.where((thing & (t < CHANGE))[..., None], (frame * 0.3 + (60, 20, 10)).astype(np.uint8), frame)

    def with_person(frame: np.ndarray, t: int) -> np.ndarray:
        return np.where((mask & (t >= CHANGE))[..., None], shown, frame)

    wide = cv2.dilate(mask.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    protected = {"two rates, place protected": ((20.0, 10.0), wide)}
    return [
        _panel("A lamp is switched on", with_lamp, _spot(size) > 0.5, sample, seed),
        _panel("A thing is carried away", with_thing, thing, sample, seed),
        _panel("A person comes and stands", with_person, mask, sample, seed, protected),
    ]


def _panel(
    title: str, alter: Alter, where: np.ndarray, sample: np.ndarray, seed: int,
    more: dict[str, tuple[tuple[float, float], np.ndarray]] | None = None,
) -> Panel:  # fmt: skip
    """Returns the curves of one change; more: further curves, by rates and protected pixels."""
    trained = np.stack([alter(frame, 0) for frame in sample])
    ways = {name: (rates, None) for name, rates in RATES.items()} | (more or {})
    curves = {}
    for name, (rates, protected) in ways.items():
        frames = (alter(f, t) for t, f in zip(range(SECONDS), _empty_frames(sample, seed), strict=False))
        curves[name] = _foreground_share(trained, frames, where, rates, protected)
    _print_times(title, curves)
    drawn = {name: curve[::DRAWN] for name, curve in curves.items()}
    return Panel(title, range(0, SECONDS, DRAWN), drawn, "s", "share called foreground", (0.0, 1.02))


def _print_times(title: str, curves: dict[str, list[float]]) -> None:
    """Prints the seconds from the change until each curve stays at or below 0.5 and 0.1."""
    print(f"\n{title}: s until no more than 0.5 and 0.1 is foreground")
    for name, curve in curves.items():
        value = np.array(curve[CHANGE:])
        above = [np.flatnonzero(value > level) for level in (0.5, 0.1)]
        times = ["never" if len(k) and k[-1] == len(value) - 1 else str(k[-1] + 1 if len(k) else 0) for k in above]
        print(f"  {name:30s} {times[0]:>6s} {times[1]:>6s}   first {value[0]:.2f}, last {value[-1]:.2f}")


def _changing_light(seed: int) -> Panel:
    sequence = _simulated("lights", seed)
    sample = sequence.background()
    curves: dict[str, list[float]] = {}
    for name, kind in GAINS.items():
        model, curve = kind(sample, sequence.fps), []
        for frame in sequence:
            classes = model.classify(frame.image)
            model.adapt(frame.image, classes)
            curve.append(float(np.mean(classes[sequence.load_pixels(frame.index).ids <= 0] != BACKGROUND)))
        curves[name] = curve
        print(f"{name:20s} mean {np.mean(curve):.3f} worst {np.max(curve):.3f}")
    t = np.arange(len(curve)) / sequence.fps
    return Panel("Light drifts and switches", t, curves, "s", "ground not called background", (0.0, 1.02))
