"""How fast one core draws pictures, tracks from pixels, and finds true and estimated groups.

    python -m benchmarks.speed rendering [--frames 200]
    python -m benchmarks.speed tracking [--people 5,20,40] [--frames 40] [--pets FOLDER]
    python -m benchmarks.speed groups [--people 1000] [--frames 600] [--rounds 3]

All times are CPU seconds of this process with one thread; the load of the machine is printed.
rendering: people walk about alone in 16 x 10 m, seen by a scenario's default camera (640 x 480 px, tilt 40 degrees),
default light and picture, nothing encoded. First table: frames per second by what is asked for, with 20 and with 100
people; the best stretch of 10 frames counts. Aim: 200 for ids, truth and disparity with 20 people, 100 for a pair.
Second table: ms per frame of each part of the left view; `rest` is copies and calls.
tracking: `blob` from pixels on people who walk about, by number of people and size of the image. Rendering, decoding
and training on the background are not timed; the best of several runs counts, the first run compiles. Columns: tracks
reported per frame, frames per second, ms per frame of each part; `rest` is prediction, update, births, deaths, report.
groups: 1000 people in groups of 1 to 4 on 60 x 60 m, one group in five standing. Seconds for the truth (membership
with hard negatives, crossings, queues, hulls) and for the baseline rule over tracks (links, labels).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from benchmarks.support.in_memory import in_memory
from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import best_times, machine_load
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.io.source import open_source
from sim.render import people_kernels, renderer, weather_kernels
from sim.render.renderer import Renderer
from sim.scene.camera_placement import place_camera
from sim.sequence import simulate
from sim.truth.crossing_events import crossings
from sim.truth.group_hulls import groups_over_time
from sim.truth.merge_split_events import groups_and_events
from sim.truth.queue_detection import queues
from sim.types import Sequence as Recording
from tracking.detect import blobs
from tracking.detect.background import Background
from tracking.detect.person_size import PersonSize
from tracking.grouping.group_labels import label_people
from tracking.grouping.link_rule import LinkRule, find_links
from tracking.grouping.merge_split_events import TrackedMotion
from tracking.papers.blob import person_template
from tracking.papers.blob.update_from_pixels import PixelUpdater
from tracking.running.prepare import PreparedTracker, prepare
from tracking.running.tracks_check import ReportHistory

STRETCH = 10  # frames
RUNS = 3
SIZES = (640, 480), (1280, 720)
FPS = 10.0
SIDE = 60.0  # m
STANDING = 0.2  # share of the groups
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
    "shadows": [(weather_kernels, "draw_shadows")],
    "people": [(people_kernels, "draw_people")],
    "blur, light, noise": [(renderer.Renderer, "_finish")],
    "truth of pixels": [(renderer, "pixel_truth")],
    "disparity": [(renderer.Renderer, "_disparities")],
}
TRACKING: Parts = {
    "classify": [(Background, "classify")],
    "clean, find": [(blobs, "clean"), (blobs, "find")],
    "associate": [(PixelUpdater, "_associate")],
    "split": [(PixelUpdater, "_measure_by_templates")],
    "newcomers": [(person_template, "find_new_people")],
    "person size": [(PersonSize, "learn"), (PixelUpdater, "_lone_people"), (PixelUpdater, "_relax_sizes")],
    "adapt": [(Background, "adapt"), (PixelUpdater, "_protected")],
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


def rendering(args: argparse.Namespace) -> None:
    made, frames = {n: renderer_of(n) for n in (20, 100)}, args.frames or 200
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


@dataclass(frozen=True)
class TrackingTimes:
    """Of one run: tracks reported per frame, ms per frame in all and by part."""

    reported: float
    whole: float
    parts: dict[str, float]


def track_once(ready: PreparedTracker) -> TrackingTimes:
    """Tracks all frames by a copy of the tracker, so that all runs share one training on the background."""
    ready = replace(ready, tracker=deepcopy(ready.tracker), history=ReportHistory())
    reported, frames = [], list(ready.frames())
    with timed(TRACKING) as spent:
        whole = best_times(lambda: reported.extend(len(ready.step(frame).id) for frame in frames), 1)[0]
    ms, whole = {part: 1e3 * seconds / len(frames) for part, seconds in spent.items()}, 1e3 * whole / len(frames)
    return TrackingTimes(float(np.mean(reported)), whole, ms | {"rest": whole - sum(ms.values())})


def best_tracking(sequence: Recording) -> TrackingTimes:
    ready = prepare("blob", sequence, detections="image")
    ready.reset(0)
    return min((track_once(ready) for _ in range(RUNS + 1)), key=lambda times: times.whole)


def tracking(args: argparse.Namespace) -> None:
    head(["video", "tracks reported", "frames/s", *TRACKING, "rest"])
    made: dict[str, Callable[[], Recording]] = {}
    for image in SIZES:
        for people in (args.people or "5,20,40").split(","):
            scenario = walkers(int(people), (args.frames or 40) / 10, baseline=0.0, image=list(image))
            made[f"{image[0]} × {image[1]}, {people} people"] = lambda scenario=scenario: simulate(scenario, 3)
    if args.pets is not None:
        made[args.pets.name] = lambda: open_source(args.pets, images=True)[0]
    for title, make in made.items():
        times = best_tracking(in_memory(make(), with_background=False))
        ms = [f"{v:.2f}" for v in times.parts.values()]
        row([title, f"{times.reported:.0f}", f"{1e3 / times.whole:.0f}", *ms])


def large_crowd(people: int, frames: int) -> tuple[np.ndarray, ...]:
    """Returns positions and velocities (T, P, 2), m and m/s, and intent (T, P): the number of each person's group.

    Groups walk straight on and turn round at the walls; some unite and part.
    """
    r = np.random.default_rng(0)
    sizes = r.choice([1, 1, 2, 2, 3, 4], people)
    sizes = sizes[: int(np.searchsorted(np.cumsum(sizes), people)) + 1]
    group = np.repeat(np.arange(len(sizes)), sizes)[:people]
    rank = np.concatenate([np.arange(n) for n in sizes])[:people]
    heading, speed = r.uniform(0, 2 * np.pi, len(sizes)), np.clip(r.normal(1.34, 0.26, len(sizes)), 0.5, 2.2)
    speed[r.random(len(sizes)) < STANDING] = 0.0
    step = speed[:, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    start = r.uniform(0, SIDE, (len(sizes), 2))
    start[1::7] = start[:-1:7] + np.array([0, 3.2])  # approaches, walks along, goes on
    step[1::7] = step[:-1:7] - np.array([0, 0.1])
    t = np.arange(frames)[:, None, None] / FPS
    straight = start[group] + np.stack([0.75 * rank, 0 * rank], axis=1) + t * step[group]
    pos = np.abs(straight % (2 * SIDE) - SIDE) + 0.05 * np.sin(2 * t + r.uniform(0, 6, (people, 2)))
    intent = np.tile(group, (frames, 1))
    for first in range(0, len(sizes) - 1, 7):
        intent[frames // 3 : 2 * frames // 3, group == first + 1] = first
    return pos, np.gradient(pos, 1 / FPS, axis=0), intent


def groups(args: argparse.Namespace) -> None:
    people, frames = int(args.people or 1000), args.frames or 600
    pos, vel, intent = large_crowd(people, frames)
    present = np.ones(intent.shape, bool)
    found = groups_and_events(pos, vel, present, intent, FPS)
    counts = (
        len(found.events),
        len(crossings(pos, vel, present, found.group, FPS)),
        len(queues(pos, vel, present, found.group, FPS)),
    )
    print(f"{people} people, {frames} frames: {counts[0]} events, {counts[1]} crossings, {counts[2]} queues,", end=" ")
    frame, column = np.nonzero(present)
    places: Any = pos[frame, column], vel[frame, column]
    label = found.group[frame, column]
    hulls = groups_over_time(frame, column, label, *places, 0, frames)
    print(f"{sum(len(g.id) for g in hulls)} hulls, {len(found.near.a)} hard negatives")
    rule = LinkRule()
    links = find_links(frame, column, *places, frames, FPS, rule)
    truth = {
        "membership": lambda: groups_and_events(pos, vel, present, intent, FPS),
        "crossings": lambda: crossings(pos, vel, present, found.group, FPS),
        "queues": lambda: queues(pos, vel, present, found.group, FPS),
        "hulls": lambda: groups_over_time(frame, column, label, *places, 0, frames),
    }
    baseline = {
        "links": lambda: find_links(frame, column, *places, frames, FPS, rule),
        "labels": lambda: label_people(frame, column, TrackedMotion(pos, vel, FPS), links, rule),
    }
    for title, works in (("truth", truth), ("baseline rule", baseline)):
        head([title, "CPU s"])
        seconds = {name: best_times(work, args.rounds)[0] for name, work in works.items()}
        for name, value in (*seconds.items(), ("all", sum(seconds.values()))):
            row([name, f"{value:.2f}"])


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("mode", choices=["rendering", "tracking", "groups"])
    parser.add_argument("--people", help="tracking: numbers of people; groups: number of people")
    parser.add_argument("--frames", type=int)
    parser.add_argument("--rounds", type=int, default=3, help="groups: runs of which the best counts")
    parser.add_argument("--pets", type=Path, help="tracking: a MOTChallenge folder with pictures, tracked, too")
    args = parser.parse_args()
    one_thread()
    print(machine_load())
    {"rendering": rendering, "tracking": tracking, "groups": groups}[args.mode](args)


if __name__ == "__main__":
    main()
