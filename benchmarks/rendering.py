"""How fast pictures are made, on one core: frames/s of what is asked for, and where the time goes.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/rendering.py [--frames 200]

640 × 480 px, 16 × 10 m, tilt 40°, default light and picture; nothing is encoded. Wanted: 200/s for ids, truth and
disparity with 20 people, 100/s for a pair. CPU time of the process: the best stretch of 10 frames, as others may
share the machine, whose load is printed.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

import numpy as np

from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.render import people_kernels, renderer, shadows_kernels
from sim.render.renderer import Renderer, make_renderer
from sim.scene.camera_placement import place_camera

STRETCH = 10


def street(people: int) -> Renderer:
    """So many people who walk about alone, seen as a scenario's default camera sees them."""
    place = [{"uniform": [1, 15]}, {"uniform": [1, 9]}]
    group = [{"id": "g", "size": 1, "start": place, "goal": place, "repeat": people}]
    scenario = Scenario.model_validate({"schema": 1, "group": group, "duration": 10.0, "camera": {"crop": True}})
    motion = run(scenario, 1)
    return make_renderer(motion, place_camera(scenario.camera, motion), scenario.light, scenario.picture)


def rate(draw: Callable[[int], object], frames: int) -> float:
    """Frames per second of CPU time: the best stretch of STRETCH frames (others may share the machine)."""
    draw(1)
    best = np.inf
    for first in range(0, frames, STRETCH):
        start = time.process_time()
        for k in range(first, first + STRETCH):
            draw(1 + k % 100)
        best = min(best, time.process_time() - start)
    return STRETCH / best


ASKED: dict[str, Callable[[Renderer], Callable[[int], object]]] = {
    "left": lambda s: s.frame,
    "left, ids, truth": lambda s: lambda i: s.draw(i, pixels=True),
    "left, ids, truth, disparity": lambda s: lambda i: s.draw(i, pixels=True, disparity=True),
    "left, right": lambda s: lambda i: s.draw(i, right=True),
    "left, right, ids, truth, disparity": lambda s: lambda i: s.draw(i, right=True, pixels=True, disparity=True),
    "ids, truth": lambda s: s.pixels,
    "empty": lambda s: lambda i: s.background(i % 50),
}
PARTS = (
    ("places, outlines", renderer.FrameBatch, ("__init__", "people", "in_view")),
    ("shadows", shadows_kernels, ("draw_shadows",)),
    ("people", people_kernels, ("draw_people",)),
    ("blur, light, noise", renderer.Renderer, ("_finish",)),
    ("truth of pixels", renderer, ("pixel_truth",)),
    ("disparity", renderer, ("frame_disparities",)),
)


def profile(made: Renderer, frames: int) -> dict[str, float]:
    """Milliseconds per frame of each part, all of the left view being asked for; `rest` is copies and the like."""
    spent: dict[str, float] = {}
    kept = []
    for part, owner, names in PARTS:
        for name in names:
            call = getattr(owner, name)
            kept.append((owner, name, call))

            def timed(*args: object, _call: Callable[..., object] = call, _part: str = part, **more: object) -> object:
                start = time.process_time_ns()
                answer = _call(*args, **more)
                spent[_part] = spent.get(_part, 0.0) + (time.process_time_ns() - start) / 1e6 / frames
                return answer

            setattr(owner, name, timed)
    start = time.process_time()
    for k in range(frames):
        made.draw(1 + k % 100, pixels=True, disparity=True)
    whole = 1e3 * (time.process_time() - start) / frames
    for owner, name, call in kept:
        setattr(owner, name, call)
    return spent | {"rest": whole - sum(spent.values()), "all": whole}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=200)
    frames = parser.parse_args().frames
    stages = {n: street(n) for n in (20, 100)}
    for n, made in stages.items():
        shown = made.draw(1, right=True, pixels=True, disparity=True).pixels
        assert shown is not None
        print(f"{n} people: {np.median(shown.amodal_px[shown.amodal_px > 0]):.0f} px each (median)")
    print(
        f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores\n\n{'frames/s':36}"
        + "".join(f"{n:>8}" for n in stages)
    )
    for name, ask in ASKED.items():
        print(f"{name:36}" + "".join(f"{rate(ask(made), frames):8.0f}" for made in stages.values()), flush=True)
    print(f"\n{'ms per frame':36}" + "".join(f"{n:>8}" for n in stages))
    parts = [profile(made, frames) for made in stages.values()]
    for name in parts[0]:
        print(f"{name:36}" + "".join(f"{part[name]:8.2f}" for part in parts))
    start = time.process_time()
    made = street(20)
    _ = made.left_view.blurred_canvas, made.left_view.geometry, made._atlas, made._noise
    print(f"\na stage with its left view: {1e3 * (time.process_time() - start):.0f} ms with the world's own time")


if __name__ == "__main__":
    main()
