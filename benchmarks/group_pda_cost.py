"""Mode `cost` of benchmarks/group_pda.py: time of a step against the number of measurements.

Points in the image, 40 px per m, in clumps like people. parted: two groups of 10 people far from each other. shared:
they cross, and half of each stands among the other's people. crowd: groups of 5 people 8 m apart, as many as there are
points at 50 a person, so that density stays what it is. pictures: the same crowd as black ellipses on grey, so that
about as many grid points are foreground, with and without the time that the detector takes. The tracker gets to know
them for two seconds, and is then copied: the same few steps are timed from there on, all sizes in turn, round after
round; the least time counts.
"""

from __future__ import annotations

import argparse
import copy
import os
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from benchmarks.group_pda_runs import held
from benchmarks.group_pda_tables import table
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Array, Context, Detections, Frame, Sequence
from tracking import tracker_registry
from tracking.prepare import prepare

COUNTS = (100, 200, 500, 1000, 2000, 5000, 10_000, 20_000)
KINDS = ("parted", "shared", "crowd", "pictures")
FPS, SCALE = 10.0, 40.0
ROUNDS, WARM, STEPS = 5, 20, 4
BODY = np.array([0.12, 0.4])  # m, standard deviations of a person's points
SQUARE = 2.4  # m, side of the square in which the people of a group stand
SPEED = 0.8  # m/s, of each of two groups, towards the other
LEAST = 1000  # measurements from which on the exponent is fitted
FIVE, APART = 250, 8.0  # points of a group of a crowd, and m between such groups


def people_of(kind: str, count: int, r: np.random.Generator) -> tuple[Array, Array]:
    """Places (P, 2), m, of all people in the first of the steps that are timed, and their velocities (P, 2), m/s."""
    if kind == "crowd":
        side = int(np.ceil(np.sqrt(max(1, count // FIVE))))
        middle = APART * np.stack(np.divmod(np.arange(max(1, count // FIVE)), side), 1)
        place = np.repeat(middle, 5, axis=0) + r.normal(0, 0.5, (5 * len(middle), 2))
        return place, np.zeros_like(place)
    shift = {"parted": 3 * SQUARE, "shared": SQUARE / 2}[kind]
    place = r.uniform(0, SQUARE, (20, 2))
    place[10:, 0] += shift
    way = np.where(np.arange(20) < 10, SPEED, -SPEED) * (kind == "shared")
    return place, np.column_stack([way, np.zeros(20)])


def frames(kind: str, count: int) -> list[Frame]:
    """The frames before those that are timed, and these; points are drawn anew in each."""
    r = np.random.default_rng(count)
    place, vel = people_of(kind, count, r)
    who, made = np.arange(count) % len(place), []
    for index in range(1, WARM + STEPS + 1):
        now = place + vel * (index - WARM - 1) / FPS
        pos = SCALE * (now[who] + r.normal(0, 1, (count, 2)) * BODY)
        t = (index - 1) / FPS
        made.append(Frame(index, t, detections=Detections(index, t, "image", pos, score=np.ones(count))))
    return made


def pictures(count: int) -> tuple[Array, list[Frame]]:
    """Background sample (10, H, W, 3) and the same picture again and again, about so many of its grid points black."""
    r = np.random.default_rng(count)
    place = SCALE * (people_of("crowd", count, r)[0] + APART / 2)
    side = int(SCALE * APART * np.ceil(np.sqrt(max(1, count // FIVE))))
    empty = r.integers(120, 130, (10, side, side, 3), np.uint8)
    image = empty[0].copy()
    for x, y in place:
        rows, columns = np.ogrid[int(y) - 29 : int(y) + 30, int(x) - 10 : int(x) + 11]
        inside = np.square((columns - x) / 9) + np.square((rows - y) / 28) <= 1
        image[rows[0, 0] : rows[-1, 0] + 1, columns[0, 0] : columns[0, -1] + 1][inside] = 0
    steps = range(1, WARM + STEPS + 1)
    return empty, [Frame(k, (k - 1) / FPS, image=image) for k in steps]


class Stepper:
    """A tracker that knows its groups. State: its copy to begin with, and the least times of a step and, of pictures,
    of the detector so far, s; how many groups it told."""

    def __init__(self, tracker: str, kind: str, count: int) -> None:
        made: Any = tracker_registry.find(tracker)
        self.tracker = made(made.config_class())
        sample, first = pictures(count) if kind == "pictures" else (None, frames(kind, count))
        self.tracker.reset(Context(FPS, SCALE, background=sample), 0)
        for frame in first[:WARM]:
            self.tracker.step(frame, frame.detections)
        self.frames, self.best, self.detector, self.told = first[WARM:], float("inf"), float("inf"), 0

    def round(self) -> None:
        """The steps once more."""
        tracker = copy.deepcopy(self.tracker)
        begun = time.process_time()
        for frame in self.frames:
            said = tracker.step(frame, frame.detections)
        self.best = min(self.best, (time.process_time() - begun) / len(self.frames))
        self.told = len(said.id)
        if tracker.pixels is not None:
            begun = time.process_time()
            for frame in self.frames:
                tracker.pixels.points(frame.image, tracker.outlines())
            self.detector = min(self.detector, (time.process_time() - begun) / len(self.frames))


def exponent(counts: Array, seconds: Array) -> float:
    """Slope of log t over log n."""
    big = counts >= LEAST
    return float(np.polyfit(np.log(counts[big]), np.log(seconds[big]), 1)[0])


def cost(given: argparse.Namespace) -> Any:
    """Must-show 5."""
    kinds = given.only.split(",") if given.only else KINDS
    print(f"CPU time, load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    steppers = {(kind, n): Stepper(given.tracker, kind, n) for kind in kinds for n in COUNTS}
    for _ in range(ROUNDS):
        for stepper in steppers.values():
            stepper.round()
    rows, found = {}, {}
    for kind in kinds:
        row = [steppers[kind, n] for n in COUNTS]
        seconds = np.array([s.best - (s.detector if kind == "pictures" else 0.0) for s in row])
        found[kind] = {"seconds": seconds.tolist(), "exponent": exponent(np.array(COUNTS), seconds)}
        rows[f"{kind}, ms"] = [*(f"{1e3 * s:.2f}" for s in seconds), f"{found[kind]['exponent']:.2f}"]
        rows[f"{kind}, frames/s"] = [*(f"{1 / s:.0f}" for s in seconds), ""]
        if kind == "pictures":
            rows["pictures, frames/s with the detector"] = [*(f"{1 / s.best:.0f}" for s in row), ""]
        rows[f"{kind}, groups told"] = [*(str(s.told) for s in row), ""]
    title = f"a step against the number of measurements; exponent of n, from {LEAST} on"
    table(title, "measurements", [*(f"{n:,}" for n in COUNTS), "exponent"], rows)
    speeds = whole(given.tracker)
    table("whole recordings", "", ["frames/s", "checks included", "people"], speeds)
    return {**found, "recordings": speeds}


def whole(tracker: str) -> dict[str, list[str]]:
    """Frames per second of a recording of about 20 people: as points; picture by picture, detector and all."""
    live = simulate(load("party", set=["group.passers.repeat=11", "duration=20", "event=[]"]), 40_000)
    assert live.truth is not None
    people = f"{len(live.truth.id) / live.truth.length:.1f}"
    sequence, modes = held(live), {"points": "file", "640 × 480 pixels, detector and all": "image"}
    found = {}
    for name, mode in modes.items():
        speeds = np.max([_speeds(tracker, sequence, mode) for _ in range(ROUNDS)], axis=0)
        found[name] = [*(f"{s:.0f}" for s in speeds), people]
    return found


def _speeds(tracker: str, sequence: Sequence, mode: Any) -> tuple[float, float]:
    """Frames per CPU second of the steps alone, and with the checks of in- and output that `track` does; training on
    the background is in neither."""
    ready = prepare(tracker, sequence, detections=mode)
    given = list(ready.frames())

    def alone(frame: Frame) -> Any:
        return ready.tracker.step(frame, None if mode == "image" else frame.detections)

    steps: tuple[Callable[[Frame], Any], ...] = alone, ready.answer
    found = []
    for step in steps:
        ready.reset(0)
        begun = time.process_time()
        for frame in given:
            step(frame)
        found.append(len(given) / (time.process_time() - begun))
    return found[0], found[1]
