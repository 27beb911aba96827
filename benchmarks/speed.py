"""How fast one core draws pictures, and how fast trackers read them.

    python -m benchmarks.speed rendering|pixels [--frames 200]

All times are CPU seconds of this process with one thread; the load of the machine is printed. People walk about alone
in 16 x 10 m, seen by a scenario's default camera (640 x 480 px, tilt 40 degrees), default light and picture, nothing
encoded. First table: frames per second by what is asked for, with 20 and with 100 people; the best stretch of 10 frames
counts. Aim: 200 for ids, truth and disparity with 20 people, 100 for a pair. Second table: ms per frame of each part of
the left view; `rest` is copies and calls.

pixels: 20 people as bare video. First table: frames per second of `blob`, of OpenCV's MOG2 alone on the same pictures,
and the ratio of their times; medians of stretches, taken in turn. Second table: ms for the disparities of a pair of
640 x 480 px at a share of the picture that is foreground (ellipses of people's size at random places), for those of the
whole pair by OpenCV's StereoBM, and their ratio.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from unittest import mock

import cv2
import numpy as np

from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_times, machine_load
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.render import people_kernels, renderer
from sim.render.renderer import Renderer
from sim.scene.camera_placement import place_camera
from sim.sequence import simulate
from sim.types import Bools, Context
from tracking.detect import blobs
from tracking.detect.subtraction_stereo import LEAST_UNIQUE, SubtractionStereo
from tracking.papers.blob.tracker import Blob

STRETCH = 10  # frames
Parts = Mapping[str, Sequence[tuple[object, str]]]
ASKED: dict[str, Callable[[Renderer], Callable[[int], object]]] = {
    "left": lambda s: s.frame,
    "left, ids, truth": lambda s: lambda i: s.draw(i, pixels=True),
    "left, ids, truth, disparity": lambda s: lambda i: s.draw(i, pixels=True, disparity=True),
    "left, right": lambda s: lambda i: s.draw(i, right=True),
    "left, right, ids, truth, disparity": lambda s: lambda i: s.draw(i, right=True, pixels=True, disparity=True),
    "ids, truth": lambda s: s.pixels,
    "empty": lambda s: lambda i: s.background(i % 50),
}
RENDERING: Parts = {
    "places, outlines": [(renderer.Renderer, "_shown")],
    "shadows": [(people_kernels, "draw_shadows")],
    "people": [(people_kernels, "draw_people")],
    "blur, light, noise": [(renderer.Renderer, "_finish")],
    "truth of pixels": [(renderer, "pixel_truth")],
    "disparity": [(renderer.Renderer, "_disparities")],
}


@contextmanager
def timed(parts: Parts) -> Iterator[dict[str, float]]:
    """Within it, the CPU seconds of each part are added to the dict that it gives."""
    spent = dict.fromkeys(parts, 0.0)

    def wrap(call: Callable[..., object], part: str) -> Callable[..., object]:
        def run(*given: object, **more: object) -> object:
            begun = time.process_time_ns()
            answer = call(*given, **more)
            spent[part] += (time.process_time_ns() - begun) / 1e9
            return answer

        return run

    patches = [mock.patch.object(o, n, wrap(getattr(o, n), part)) for part, all in parts.items() for o, n in all]
    for patch in patches:
        patch.start()
    try:
        yield spent
    finally:
        for patch in patches:
            patch.stop()


def walkers(people: int, duration: float, **camera: object) -> Scenario:
    """Returns a scenario of people who walk about alone in 16 x 10 m."""
    place = [{"uniform": [1, 15]}, {"uniform": [1, 9]}]
    group = [{"id": "g", "size": 1, "start": place, "goal": place, "repeat": people}]
    keys = {"schema": 1, "group": group, "duration": duration, "camera": {"crop": True, **camera}}
    return Scenario.model_validate(keys)


def renderer_of(people: int, **camera: object) -> Renderer:
    scenario = walkers(people, 10.0, **camera)
    motion = run(scenario, 1)
    return Renderer(motion, place_camera(scenario.camera, motion), scenario.light, scenario.picture)


def frame_rate(draw: Callable[[int], object], frames: int) -> float:
    """Returns frames per CPU second of the best stretch."""
    draw(1)
    stretches = [[1 + k % 100 for k in range(first, first + STRETCH)] for first in range(0, frames, STRETCH)]
    return STRETCH / min(best_times(lambda s=s: [draw(k) for k in s], 1)[0] for s in stretches)


def part_times(made: Renderer, frames: int) -> dict[str, float]:
    """Returns ms per frame of each part, with everything of the left view asked for."""
    with timed(RENDERING) as spent:
        draw = lambda: [made.draw(1 + k % 100, pixels=True, disparity=True) for k in range(frames)]  # noqa: E731
        whole = 1e3 * best_times(draw, 1)[0] / frames
    ms = {part: 1e3 * seconds / frames for part, seconds in spent.items()}
    return ms | {"rest": whole - sum(ms.values()), "all": whole}


def rendering(frames: int) -> None:
    made = {n: renderer_of(n) for n in (20, 100)}
    for n, one in made.items():
        pixels = one.draw(1, right=True, pixels=True, disparity=True).pixels
        assert pixels is not None
        print(f"{n} people: {np.median(pixels.amodal_px[pixels.amodal_px > 0]):.0f} px each (median)")
    head(["frames/s", *(f"{n} people" for n in made)])
    for name, ask in ASKED.items():
        row([name, *(f"{frame_rate(ask(one), frames):.0f}" for one in made.values())])
    parts = [part_times(one, frames) for one in made.values()]
    head(["ms per frame", *(f"{n} people" for n in made)])
    for name in parts[0]:
        row([name, *(f"{part[name]:.2f}" for part in parts)])

    def first_view() -> None:
        one = renderer_of(20)
        _ = one.left_view.blurred_canvas, one.left_view.geometry, one._atlas, one._noise

    print(f"a scene with its left view, simulation included: {1e3 * best_times(first_view, 1)[0]:.0f} ms")


def pixels(frames: int) -> None:
    cv2.setNumThreads(1)
    head(["20 people, frames/s", "blob", "MOG2", "time over MOG2's"])
    for size in ([480, 360], [1280, 720]):
        scenario = walkers(20, frames / 10, image=size, fps=10, focal_px=1.25 * size[0], tilt_deg=20)
        pictures = list(simulate(scenario, 1))
        sample = np.stack([frame.image for frame in pictures[:: max(len(pictures) // 50, 1)]])
        blob, subtractor = Blob(), cv2.createBackgroundSubtractorMOG2()
        blob.reset(Context(10.0, np.nan, background=sample), 1)
        times = []
        for first in range(0, len(pictures) - STRETCH + 1, STRETCH):
            stretch = pictures[first : first + STRETCH]
            track = best_times(lambda s=stretch, b=blob: [b.step(f, None) for f in s], 1)[0]
            subtract = best_times(lambda s=stretch, m=subtractor: [m.apply(f.image) for f in s], 1)[0]
            times.append([track / STRETCH, subtract / STRETCH])
        own, other = np.median(times[1:], axis=0)
        row([f"{size[0]} x {size[1]}", f"{1 / own:.0f}", f"{1 / other:.0f}", f"{own / other:.2f}"])
    pair = renderer_of(100, baseline=0.12, focal_px=500).draw(1, right=True)
    left, right = (cv2.cvtColor(view, cv2.COLOR_BGR2GRAY) for view in (pair.image, pair.right))
    stereo = SubtractionStereo(24.0, 15)
    whole = cv2.StereoBM.create(stereo.disparities, stereo.block)
    whole.setUniquenessRatio(LEAST_UNIQUE)
    head(["foreground", "regions", "ms", "whole pair, ms", "ratio"])
    for share in (0.05, 0.1, 0.2):
        found = blobs.find(people_at_random(left.shape, share), 1)
        works = (lambda b=found: stereo.match(left, right, b), lambda: whole.compute(left, right))
        ms = np.min([[1e3 * best_times(work, 1)[0] for work in works] for _ in range(15)], axis=0)
        row([f"{share}", f"{len(found)}", f"{ms[0]:.1f}", f"{ms[1]:.1f}", f"{ms[0] / ms[1]:.2f}"])


def people_at_random(shape: tuple[int, ...], share: float) -> Bools:
    """Returns a mask (H, W) of upright ellipses, 30 x 90 px, of which the `share` is True."""
    random, mask = np.random.default_rng(1), np.zeros(shape, np.uint8)
    while mask.mean() < share:
        centre = random.integers([50, 50], [shape[1] - 20, shape[0] - 50])
        cv2.ellipse(mask, centre.tolist(), (15, 45), 0, 0, 360, 1, -1)
    return mask.astype(bool)


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["rendering", "pixels"])
    parser.add_argument("--frames", type=int, default=200)
    args = parser.parse_args()
    one_thread()
    print(machine_load())
    {"rendering": rendering, "pixels": pixels}[args.mode](args.frames)


if __name__ == "__main__":
    main()
