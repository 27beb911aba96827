"""Mode `cost` of `benchmarks.group_pda`: CPU time of a step against the number of measurements.

Measurements are points in the image, 40 px per m, in clumps of the size of people. parted: two groups of 10 people far
from each other. shared: two such groups cross, and half of each stands among the other. crowd: groups of 5 people, 8 m
apart, with 50 points per person, so that the density does not depend on the number of points. pictures: the same crowd
as black ellipses on grey with about as many foreground grid points, with and without the time of the detector. The
tracker runs for three seconds, at whose start the groups of shared are apart, and is then copied. From there the same
few steps are timed, all sizes in turn in each round; the least time counts. The exponent is the slope of log time over
log n from 1000 measurements on. shared / parted is the ratio of their times.
Last table: frames per second on a whole recording of about 20 people, as points and from pixels, of the steps alone and
with the checks that `track` does; training on the background is not timed.
"""

from __future__ import annotations

import argparse
import copy
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.support.in_memory import in_memory
from benchmarks.support.tables import table
from benchmarks.support.timing import machine_load
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Array, Context, Detections, Frame, Sequence
from tracking import tracker_registry
from tracking.prepare import prepare

COUNTS = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000)
KINDS = ("parted", "shared", "crowd", "pictures")
FPS, SCALE = 10.0, 40.0
WARM, STEPS = 30, 4
BODY = np.array([0.12, 0.4])  # m, standard deviations of a person's points
SQUARE = 2.4  # m, side of the square in which the people of a group stand
SPEED = 0.8  # m/s, of each of two groups, towards the other
FIT_FROM = 1000  # measurements
GROUP_POINTS, APART = 250, 8.0  # points of a group of a crowd, and m between these groups


def people_of(kind: str, count: int, r: np.random.Generator) -> tuple[Array, Array]:
    """Returns positions (P, 2), m, of all people in the first timed step, and their velocities (P, 2), m/s."""
    if kind == "crowd":
        side = int(np.ceil(np.sqrt(max(1, count // GROUP_POINTS))))
        middle = APART * np.stack(np.divmod(np.arange(max(1, count // GROUP_POINTS)), side), 1)
        place = np.repeat(middle, 5, axis=0) + r.normal(0, 0.5, (5 * len(middle), 2))
        return place, np.zeros_like(place)
    shift = {"parted": 3 * SQUARE, "shared": SQUARE / 2}[kind]
    place = r.uniform(0, SQUARE, (20, 2))
    place[10:, 0] += shift
    way = np.where(np.arange(20) < 10, SPEED, -SPEED) * (kind == "shared")
    return place, np.column_stack([way, np.zeros(20)])


def frames(kind: str, count: int) -> list[Frame]:
    """Returns the frames before the timed ones, and the timed ones; points are drawn anew in each frame."""
    r = np.random.default_rng(count)
    place, vel = people_of(kind, count, r)
    person, made = np.arange(count) % len(place), []
    for index in range(1, WARM + STEPS + 1):
        now = place + vel * (index - WARM - 1) / FPS
        pos = SCALE * (now[person] + r.normal(0, 1, (count, 2)) * BODY)
        t = (index - 1) / FPS
        made.append(Frame(index, t, detections=Detections(index, t, "image", pos, score=np.ones(count))))
    return made


def pictures(count: int) -> tuple[Array, list[Frame]]:
    """Returns a background sample (10, H, W, 3) and frames of one picture with about `count` black grid points."""
    r = np.random.default_rng(count)
    place = SCALE * (people_of("crowd", count, r)[0] + APART / 2)
    side = int(SCALE * APART * np.ceil(np.sqrt(max(1, count // GROUP_POINTS))))
    empty = r.integers(120, 130, (10, side, side, 3), np.uint8)
    image = empty[0].copy()
    for x, y in place:
        rows, columns = np.ogrid[int(y) - 29 : int(y) + 30, int(x) - 10 : int(x) + 11]
        inside = np.square((columns - x) / 9) + np.square((rows - y) / 28) <= 1
        image[rows[0, 0] : rows[-1, 0] + 1, columns[0, 0] : columns[0, -1] + 1][inside] = 0
    steps = range(1, WARM + STEPS + 1)
    return empty, [Frame(k, (k - 1) / FPS, image=image) for k in steps]


class TimedTracker:
    """A tracker after the frames before the timed ones.

    State: the tracker; the least time so far, s, of a step (best) and of the detector (detector); the number of groups
    reported in the last frame (reported).
    """

    def __init__(self, tracker: str, kind: str, count: int) -> None:
        made: Any = tracker_registry.find(tracker)
        self.tracker = made(made.config_class())
        sample, first = pictures(count) if kind == "pictures" else (None, frames(kind, count))
        self.tracker.reset(Context(FPS, SCALE, background=sample), 0)
        for frame in first[:WARM]:
            self.tracker.step(frame, frame.detections)
        self.frames, self.best, self.detector, self.reported = first[WARM:], float("inf"), float("inf"), 0

    def round(self) -> None:
        """Runs the timed steps once more."""
        tracker = copy.deepcopy(self.tracker)
        begun = time.process_time()
        for frame in self.frames:
            answer = tracker.step(frame, frame.detections)
        self.best = min(self.best, (time.process_time() - begun) / len(self.frames))
        self.reported = len(answer.id)
        if tracker.pixels is not None:
            begun = time.process_time()
            for frame in self.frames:
                tracker.pixels.points(frame.image, tracker.outlines())
            self.detector = min(self.detector, (time.process_time() - begun) / len(self.frames))


def exponent(counts: Array, seconds: Array) -> float:
    """Returns the slope of log time over log number."""
    big = counts >= FIT_FROM
    return float(np.polyfit(np.log(counts[big]), np.log(seconds[big]), 1)[0])


def cost(given: argparse.Namespace) -> Any:
    """Prints both tables and returns the least seconds and exponents by kind."""
    kinds = given.only.split(",") if given.only else KINDS
    print(f"CPU time, {machine_load()}")
    timed = {(kind, n): TimedTracker(given.tracker, kind, n) for kind in kinds for n in COUNTS}
    for _ in range(given.rounds):
        for one in timed.values():
            one.round()
    rows, found = {}, {}
    for kind in kinds:
        row = [timed[kind, n] for n in COUNTS]
        seconds = np.array([s.best - (s.detector if kind == "pictures" else 0.0) for s in row])
        found[kind] = {"seconds": seconds.tolist(), "exponent": exponent(np.array(COUNTS), seconds)}
        rows[f"{kind}, ms"] = [*(f"{1e3 * s:.2f}" for s in seconds), f"{found[kind]['exponent']:.2f}"]
        rows[f"{kind}, frames/s"] = [*(f"{1 / s:.0f}" for s in seconds), ""]
        if kind == "pictures":
            rows["pictures, frames/s with the detector"] = [*(f"{1 / s.best:.0f}" for s in row), ""]
        rows[f"{kind}, groups reported"] = [*(str(s.reported) for s in row), ""]
    if {"shared", "parted"} <= set(found):
        ratio = np.divide(found["shared"]["seconds"], found["parted"]["seconds"])
        found["ratio"] = ratio.tolist()
        rows["shared / parted"] = [*(f"{r:.2f}" for r in ratio), ""]
    title = "a step against the number of measurements"
    table(title, "measurements", [*(f"{n:,}" for n in COUNTS), "exponent"], rows)
    speeds = whole_recordings(given.tracker, given.rounds)
    table("whole recordings", "", ["frames/s", "checks included", "people"], speeds)
    return {**found, "recordings": speeds}


def whole_recordings(tracker: str, rounds: int) -> dict[str, list[str]]:
    """Returns the cells of the last table by input."""
    live = simulate(load("party", set=["group.passers.repeat=11", "duration=20", "event=[]"]), 40_000)
    assert live.truth is not None
    people = f"{len(live.truth.id) / live.truth.length:.1f}"
    sequence, modes = in_memory(live), {"points": "file", "640 × 480 pixels, with the detector": "image"}
    found = {}
    for name, mode in modes.items():
        speeds = np.max([_speeds(tracker, sequence, mode) for _ in range(rounds)], axis=0)
        found[name] = [*(f"{s:.0f}" for s in speeds), people]
    return found


def _speeds(tracker: str, sequence: Sequence, mode: Any) -> tuple[float, float]:
    """Returns frames per CPU second of the steps alone, and with the checks of input and output that `track` does."""
    ready = prepare(tracker, sequence, detections=mode)
    given = list(ready.frames())

    def alone(frame: Frame) -> Any:
        return ready.tracker.step(frame, None if mode == "image" else frame.detections)

    steps: tuple[Callable[[Frame], Any], ...] = alone, ready.step
    found = []
    for step in steps:
        ready.reset(0)
        begun = time.process_time()
        for frame in given:
            step(frame)
        found.append(len(given) / (time.process_time() - begun))
    return found[0], found[1]
