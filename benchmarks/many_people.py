"""Time and memory of the trackers with many people: all come in the first frame, and walk on.

`python -m benchmarks.many_people` prints a row for each tracker: CPU seconds of the slowest of 6 frames when 300 and
when 1,000 people come at once, and with 2,000 people over 40 frames CPU seconds of the mean frame and the largest
memory of the process. Each run is a process of its own. People are spread with a density of 1 per 4 m^2, and measured
with a noise of 5 cm; `--area 25` spreads them wider. `--trackers joint stereo` names trackers.
"""

from __future__ import annotations

import argparse
import resource
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from sim.types import Context, Detections, Frame
from tracking.running.tracker_registry import find, names

FPS, SCALE = 10.0, 40.0
# People who come at once, and frames in which they are confirmed by every tracker.
NEWCOMERS, SOON = (300, 1000), 6
# People and frames of the long run.
CROWD, LONG = 2000, 40


def frames(name: str, people: int, count: int, area: float = 4.0) -> Iterator[Frame]:
    """Yields frames with the detections of people who walk at up to 1 m/s per axis, as the tracker takes them; area:
    m^2 for each person."""
    draws = np.random.default_rng(0)
    place = draws.uniform(0, np.sqrt(people * area), (people, 2))
    velocity = draws.uniform(-1, 1, (people, 2))
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
        yield Frame(k, (k - 1) / FPS, detections=found)


def seconds(name: str, people: int, count: int, area: float = 4.0) -> list[float]:
    """Returns the CPU seconds of each frame in this process, after a run with 12 people that compiles the kernels."""
    context = Context(FPS, SCALE if name == "blob" else float("nan"))
    for size, length in ((12, 12), (people, count)):
        tracker, spent = find(name)(), []
        tracker.reset(context, 0)
        for frame in frames(name, size, length, area):
            start = time.process_time()
            tracker.step(frame, frame.detections)
            spent.append(time.process_time() - start)
    return spent


def measured(name: str, people: int, count: int, area: float) -> tuple[float, float, float]:
    """Returns CPU seconds of the slowest and of the mean frame, and the memory of this process, MB."""
    spent = seconds(name, people, count, area)
    return max(spent), float(np.mean(spent)), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--area", type=float, default=4.0)
    parser.add_argument("--trackers", nargs="+", default=list(names()))
    options = parser.parse_args()
    print("| tracker | 300 newcomers, s | 1,000 newcomers, s | 2,000 × 40 frames: s per frame | slowest | MB |")
    print("|---|---|---|---|---|---|")
    for name in options.trackers:
        cells = []
        for people, count in (*((people, SOON) for people in NEWCOMERS), (CROWD, LONG)):
            with ProcessPoolExecutor(1, get_context("spawn")) as pool:
                slowest, mean, memory = pool.submit(measured, name, people, count, options.area).result()
            cells += [f"{slowest:.2f}"] if count == SOON else [f"{mean:.2f}", f"{slowest:.2f}", f"{memory:.0f}"]
        print(f"| {name} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
