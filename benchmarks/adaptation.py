"""Two rates of adaptation against one, and the gain against none: curves over time.

    PYTHONPATH=. python benchmarks/adaptation.py [--seed 40000] [--out adaptation.svg]

lamp, thing, person: empty rendered frames (`merge`, 320x240, one per second) in which at 60 s a lamp throws a bright
warm spot on the ground, a thing that lay there in the sample is carried away, somebody comes and stands for ten minutes
in the same place; shown is the share of these pixels that is called foreground. A lamp and a ghost should go, a person
stay; `person, protected` is the place that a confirmed track keeps out of adaptation.
light: `lights` with its people, ten frames per second; shown is the share of the people-free pixels called anything but
background, smallest where the gain is followed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np

from benchmarks.chart import Panel, lines
from scenarios import load
from sim import simulate
from tracking.detect.background import BACKGROUND, Background, fused_foreground
from tracking.detect.background_settings import BackgroundSettings

SECONDS, CHANGE, SHOWN = 900, 60, 6
"""How long, when it changes, and how many seconds lie between points that are drawn."""
RATES = {
    "two rates: 20 s, 200 s": BackgroundSettings(),
    "one rate: 20 s": BackgroundSettings(foreground_time=20.0),
    "one rate: 200 s": BackgroundSettings(background_time=200.0),
    "20 s, foreground left alone": BackgroundSettings(foreground_time=1e9),
}
GAINS = {"two rates: 20 s, 200 s": BackgroundSettings(), "gain not followed": BackgroundSettings(gain="none")}


def small(name: str, seed: int, *settings: str):
    return simulate(load(name, ["camera.image=[320,240]", *settings]), seed)


def person(sequence) -> tuple[np.ndarray, np.ndarray]:
    """The frame and mask of the largest lone person among every tenth frame."""
    best = (0.0, None, None)
    for frame in sequence:
        if frame.index % 10 == 0:
            pixels = sequence.load_pixels(frame.index)
            lone = [b >= 0 and np.sum(pixels.blob == b) == 1 for b in pixels.blob]
            for number, px in enumerate(np.where(lone, pixels.visible_px, 0)):
                if px > best[0]:
                    id = sequence.frame_truth(frame.index).id[number]
                    best = (px, frame.image, pixels.ids == id)
    assert best[1] is not None
    return best[1], best[2]


def empty(sample: np.ndarray, seed: int) -> Iterator[np.ndarray]:
    """The frames of the sample in random order, without end."""
    rng = np.random.default_rng(seed)
    while True:
        yield from sample[rng.permutation(len(sample))]


def staying(sample: np.ndarray, frames: Iterator[np.ndarray], where, settings, protected=None) -> list[float]:
    """Share of `where` called foreground, one value per second."""
    model, curve = Background(sample, 1.0, settings), []
    for frame in frames:
        classes = model.classify(frame)
        curve.append(float(fused_foreground(classes)[where].mean()))
        model.adapt(frame, classes, protected)
    return curve


def spot(size: tuple[int, int]) -> np.ndarray:
    """(H, W) a soft round light in the middle."""
    v, u = np.mgrid[: size[0], : size[1]]
    return np.exp(-(((u - size[1] / 2) / 25) ** 2 + ((v - size[0] / 2) / 18) ** 2))


def changes(seed: int) -> dict[str, Panel]:
    sequence = small("merge", seed)
    sample = sequence.background()
    size = sample.shape[1:3]
    lamp = 1 + 1.2 * spot(size)[..., None] * np.array([0.3, 0.7, 1.0])
    lit = spot(size) > 0.5
    thing = np.zeros(size, bool)
    thing[140:165, 60:95] = True
    shown, mask = person(sequence)

    def with_lamp(frame, t):
        return np.clip(frame * lamp, 0, 255).astype(np.uint8) if t >= CHANGE else frame

    def with_thing(frame, t):
        return np.where((thing & (t < CHANGE))[..., None], (frame * 0.3 + (60, 20, 10)).astype(np.uint8), frame)

    def with_person(frame, t):
        return np.where((mask & (t >= CHANGE))[..., None], shown, frame)

    wide = cv2.dilate(mask.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    panels = {}
    for title, change, where in (
        ("A lamp is switched on", with_lamp, lit),
        ("A thing is carried away", with_thing, thing),
        ("A person comes and stands", with_person, mask),
    ):
        trained = np.stack([change(frame, 0) for frame in sample])

        def seen(change=change):
            return (change(frame, t) for t, frame in zip(range(SECONDS), empty(sample, seed), strict=False))

        curves = {name: staying(trained, seen(), where, settings) for name, settings in RATES.items()}
        if change is with_person:
            curves["two rates, place protected"] = staying(trained, seen(), where, BackgroundSettings(), wide)
        report(title, curves)
        drawn = {name: curve[::SHOWN] for name, curve in curves.items()}
        panels[title] = Panel(title, range(0, SECONDS, SHOWN), drawn, "s", "share called foreground", (0.0, 1.02))
    return panels


def report(title: str, curves: dict[str, list[float]]) -> None:
    """When each curve falls to a half and to a tenth for good."""
    print(f"\n{title}: s until no more than 0.5 and 0.1 is foreground")
    for name, curve in curves.items():
        value = np.array(curve[CHANGE:])
        last = [np.flatnonzero(value > level) for level in (0.5, 0.1)]
        said = ["never" if len(k) and k[-1] == len(value) - 1 else str(k[-1] + 1 if len(k) else 0) for k in last]
        print(f"  {name:30s} {said[0]:>6s} {said[1]:>6s}   first {value[0]:.2f}, last {value[-1]:.2f}")


def light(seed: int) -> Panel:
    sequence = small("lights", seed)
    sample = sequence.background()
    curves: dict[str, list[float]] = {}
    for name, settings in GAINS.items():
        model, curve = Background(sample, sequence.fps, settings), []
        for frame in sequence:
            classes = model.classify(frame.image)
            model.adapt(frame.image, classes)
            curve.append(float(np.mean(classes[sequence.load_pixels(frame.index).ids <= 0] != BACKGROUND)))
        curves[name] = curve
        print(f"{name:20s} mean {np.mean(curve):.3f} worst {np.max(curve):.3f}")
    t = np.arange(len(curve)) / sequence.fps
    return Panel("Light drifts and switches", t, curves, "s", "ground not called background", (0.0, 1.02))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=40000)
    parser.add_argument("--out", type=Path, default=Path("adaptation.svg"))
    chosen = parser.parse_args()
    panels = [*changes(chosen.seed).values(), light(chosen.seed)]
    print(f"\nwrote {lines(panels, chosen.out)}")


if __name__ == "__main__":
    main()
