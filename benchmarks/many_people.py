"""Time and memory of the trackers with many people: all come in the first frame, and walk on.

`python -m benchmarks.many_people --people 1000 --frames 10` prints a row for each tracker: seconds of the slowest and
of the mean frame, tracks in the last frame, and the largest memory of a process of its own. People are spread with a
density of 1 per 4 m^2, and measured with a noise of 5 cm.
"""

from __future__ import annotations

import argparse
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from sim.types import Context, Detections, Frame
from tracking.tracker_registry import find, names

FPS, SCALE = 10.0, 40.0
AREA = 4.0
"""m^2 for each person."""


def frames(name: str, people: int, count: int) -> list[Frame]:
    """Returns frames with the detections of people who walk at up to 1 m/s per axis, as the tracker takes them."""
    draws = np.random.default_rng(0)
    place = draws.uniform(0, np.sqrt(people * AREA), (people, 2))
    velocity = draws.uniform(-1, 1, (people, 2))
    made = []
    for k in range(1, count + 1):
        pos = place + velocity * (k - 1) / FPS + draws.normal(0, 0.05, place.shape)
        box = None
        if name == "blob":
            pos = pos * SCALE
            box = np.column_stack([pos - [10, 34], np.tile([20.0, 68.0], (people, 1))])
        plane = "image" if name == "blob" else "ground"
        if name == "stereo":
            pos, plane = np.column_stack([pos, np.zeros(people)]), "space"
        found = Detections(k, (k - 1) / FPS, plane, pos, None, box, np.ones(people))
        made.append(Frame(k, (k - 1) / FPS, detections=found))
    return made


def measure(name: str, people: int, count: int) -> str:
    """Returns a row of the table, for one tracker in this process; kernels are compiled before."""
    context = Context(FPS, SCALE if name == "blob" else float("nan"))
    for size, length in ((12, 12), (people, count)):
        tracker, seconds, tracks = find(name)(), [], 0
        tracker.reset(context, 0)
        for frame in frames(name, size, length):
            start = time.perf_counter()
            tracks = len(tracker.step(frame, frame.detections).id)
            seconds.append(time.perf_counter() - start)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return f"| {name} | {max(seconds):.2f} | {np.mean(seconds):.2f} | {tracks} | {memory:.0f} |"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=1000)
    parser.add_argument("--frames", type=int, default=10)
    parser.add_argument("--trackers", nargs="+", default=list(names()))
    options = parser.parse_args()
    print("| tracker | slowest frame, s | mean frame, s | tracks at the end | memory, MB |\n|---|---|---|---|---|")
    for name in options.trackers:
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            print(pool.submit(measure, name, options.people, options.frames).result(), flush=True)


if __name__ == "__main__":
    main()
