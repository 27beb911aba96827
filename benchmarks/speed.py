"""How fast one core draws pictures.

    python -m benchmarks.speed rendering [--frames 200]

All times are CPU seconds of this process with one thread; the load of the machine is printed. People walk about alone
in 16 x 10 m, seen by a scenario's default camera (640 x 480 px, tilt 40 degrees), default light and picture, nothing
encoded. First table: frames per second by what is asked for, with 20 and with 100 people; the best stretch of 10 frames
counts. Aim: 200 for ids, truth and disparity with 20 people, 100 for a pair. Second table: ms per frame of each part of
the left view; `rest` is copies and calls.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from unittest import mock

import numpy as np

from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_times, machine_load
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.render import people_kernels, renderer
from sim.render.renderer import Renderer
from sim.scene.camera_placement import place_camera

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
    "places, outlines": [(renderer.Renderer, "_people")],
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


def renderer_of(people: int) -> Renderer:
    scenario = walkers(people, 10.0)
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


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["rendering"])
    parser.add_argument("--frames", type=int, default=200)
    args = parser.parse_args()
    one_thread()
    print(machine_load())
    rendering(args.frames)


if __name__ == "__main__":
    main()
