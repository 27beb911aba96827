"""How fast `blob` tracks from pixels, on one core: frames/s by people and image size, and where the time goes.

    PYTHONPATH=. OMP_NUM_THREADS=1 python benchmarks/tracking_speed.py [--people 5,20,40] [--frames 40] [--pets FOLDER]

People walk about alone in 16 x 10 m, seen by a scenario's default camera (pinhole, tilt 40 degrees); pictures are made
beforehand, and neither rendering, decoding nor training on the background counts. CPU time of the process: the best of
several runs, after one that is not counted, as others may share the machine, whose load is printed. The parts are those
of the best run; `rest` is the population's (predict, update, births, deaths, report).
"""

from __future__ import annotations

import argparse
import copy
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest import mock

from scenarios.schema.scenario import Scenario
from sim.io.source import open_source
from sim.sequence import simulate
from sim.types import Frame, Sequence
from tracking.detect import blobs
from tracking.detect.background import Background
from tracking.detect.person_size import PersonSize
from tracking.papers.blob import new_people
from tracking.papers.blob.update_from_pixels import PixelUpdater
from tracking.prepare import PreparedTracker, prepare
from tracking.tracks_check import ReportHistory

SIZES = (640, 480), (1280, 720)
RUNS = 3
PARTS: dict[str, tuple[tuple[object, str], ...]] = {
    "classify": ((Background, "classify"),),
    "clean, find": ((blobs, "clean"), (blobs, "find")),
    "associate": ((PixelUpdater, "_associate"),),
    "split": ((PixelUpdater, "_measure_by_templates"),),
    "newcomers": ((new_people, "find_new_people"),),
    "person size": ((PersonSize, "learn"), (PixelUpdater, "_lone_people"), (PixelUpdater, "_relax_sizes")),
    "adapt": ((Background, "adapt"), (PixelUpdater, "_protected")),
}


@dataclass(frozen=True)
class Result:
    """Of a run: people told per frame, milliseconds per frame in all and by part."""

    people: float
    whole: float
    parts: dict[str, float]


def street(people: int, image: tuple[int, int], frames: int) -> Sequence:
    """So many people who walk about alone; pictures in memory."""
    place = [{"uniform": [1, 15]}, {"uniform": [1, 9]}]
    group = [{"id": "g", "size": 1, "start": place, "goal": place, "repeat": people}]
    camera = {"crop": True, "baseline": 0.0, "image": list(image)}
    scenario = Scenario.model_validate({"schema": 1, "group": group, "duration": frames / 10, "camera": camera})
    return held(simulate(scenario, 3))


def held(sequence: Sequence) -> Sequence:
    """The sequence with its pictures in memory."""
    frames = list(sequence.frames())

    def again() -> Iterator[Frame]:
        return iter(frames)

    return replace(sequence, frames=again)


@contextmanager
def timed(spent: dict[str, float]) -> Iterator[None]:
    """Adds the CPU seconds of each part to `spent`."""

    def wrap(call: Callable[..., object], part: str) -> Callable[..., object]:
        def run(*given: object, **more: object) -> object:
            start = time.process_time_ns()
            answer = call(*given, **more)
            spent[part] = spent.get(part, 0.0) + (time.process_time_ns() - start) / 1e9
            return answer

        return run

    patches = [mock.patch.object(o, n, wrap(getattr(o, n), part)) for part, all in PARTS.items() for o, n in all]
    for patch in patches:
        patch.start()
    try:
        yield
    finally:
        for patch in patches:
            patch.stop()


def one_run(ready: PreparedTracker) -> Result:
    """Track all frames once, by a copy of the tracker, so that the background is trained on but once."""
    ready = replace(ready, tracker=copy.deepcopy(ready.tracker), history=ReportHistory())
    spent: dict[str, float] = {}
    told = 0
    frames = list(ready.frames())
    with timed(spent):
        start = time.process_time()
        for frame in frames:
            told += len(ready.step(frame).id)
        whole = time.process_time() - start
    n = len(frames)
    parts = {part: 1e3 * spent.get(part, 0.0) / n for part in PARTS}
    whole = 1e3 * whole / n
    return Result(told / n, whole, parts | {"rest": whole - sum(parts.values())})


def best(sequence: Sequence) -> Result:
    """The fastest of several runs; one before them compiles and warms up."""
    ready = prepare("blob", sequence, detections="image")
    ready.reset(0)
    return min((one_run(ready) for _ in range(RUNS + 1)), key=lambda result: result.whole)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", default="5,20,40")
    parser.add_argument("--frames", type=int, default=40)
    parser.add_argument("--pets", type=Path, help="a MOTChallenge folder with images, tracked too")
    given = parser.parse_args()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, ms of CPU per frame\n")
    print("| video | told | frames/s | " + " | ".join(PARTS) + " | rest |\n|---" + "|---" * (len(PARTS) + 3) + "|")
    made: dict[str, Callable[[], Sequence]] = {}
    for image in SIZES:
        for people in given.people.split(","):
            title = f"{image[0]} × {image[1]}, {people} people"
            made[title] = lambda people=int(people), image=image: street(people, image, given.frames)
    if given.pets is not None:
        made[given.pets.name] = lambda: held(open_source(given.pets, images=True)[0])
    for title, make in made.items():
        result = best(make())
        cells = [f"{result.people:.0f}", f"{1e3 / result.whole:.0f}", *(f"{ms:.2f}" for ms in result.parts.values())]
        print(f"| {title} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
