"""Cost of `relational` and `particle` against the number of people, and the error of propagated sums."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from typing import cast

import numpy as np

from benchmarks.relational.errors import CUT, FILTERS, config_of
from benchmarks.support import tables
from sim.types import Array, Context, Detections, Frame
from tracking.filters.assignment import optimal
from tracking.papers.relational.association_sums_kernels import exact_sum, propagated_sum
from tracking.papers.relational.tracker import Particle
from tracking.tracker_registry import find

PEOPLE = (2, 5, 10, 20, 50)
FPS, FRAMES, WARM = 10.0, 80, 20
"""Mode speed: frames per second, frames, and the first frames, which do not count."""
SIZES = (2, 4, 6, 8, 10, 12, 14)
"""Numbers of people of a cluster in mode sums."""
NEAREST, ERROR, DETECTED, CLUTTER = 0.5, 0.15, 0.95, 0.002
"""Mode sums: distance of neighbours and standard deviation of a forecast point about its detection, m; probability of a
detection; false alarms per m^2."""


def speed(given: argparse.Namespace) -> None:
    """Prints a table: rows are numbers of people, who walk in pairs, and trackers; means over seeds.

    Columns: frames per second of CPU time, error per person and frame, and the tracker's diagnostics.
    """
    tables.head(
        ["people", "weights", "tracker", "frames/s", "error, m", "effective share", "ancestors, share"]
    )  # fmt: skip
    for people in PEOPLE:
        for weights in ("factorised", "joint"):
            for name in FILTERS:
                config = config_of(name, given.counts[0], given).with_set(f"weights={weights}")
                tracker = cast(Particle, find(name)(config))
                runs = np.array([_timed(tracker, people, seed) for seed in given.seeds])
                rate, error, effective, ancestors = runs.mean(axis=0)
                cells = [f"{rate:.0f}", f"{error:.3f}", f"{effective:.3f}", f"{ancestors:.3f}"]
                tables.row([str(people), weights, name, *cells])


def _timed(tracker: Particle, people: int, seed: int) -> list[float]:
    """Returns frames per second, the mean error, m, and the shares of effective particles and distinct ancestors."""
    steps = list(_walkers(people, seed))
    tracker.reset(Context(FPS, float("nan")), seed)
    spent, errors = 0.0, []
    for k, (true, frame) in enumerate(steps):
        begun = time.process_time()
        tracks = tracker.step(frame, frame.detections)
        spent += time.process_time() - begun if k >= WARM else 0.0
        away = np.hypot(*(true[:, None] - tracks.pos[None]).transpose(2, 0, 1))
        a, b = optimal(away, CUT)
        errors.append((away[a, b].sum() + CUT * (people - len(a))) / people)
    told = tracker.diagnostics
    shares = [float(told[key] or 0.0) for key in ("effective_particles_of_a_person", "distinct_ancestors")]
    return [(len(steps) - WARM) / spent, float(np.mean(errors[WARM:])), *shares]


def _walkers(people: int, seed: int) -> Iterator[tuple[Array, Frame]]:
    """Yields the places (K, 2) and frames of people who walk in pairs, the pairs 3 m apart, with misses and no false
    alarms."""
    rng = np.random.default_rng(seed)
    k = np.arange(people)
    start = np.stack([k // 2 % 5 * 3.0, k // 10 * 3.0 + k % 2 * 0.7], axis=1)
    for t in range(FRAMES):
        true = start + np.array([0.12 * t, 0.0])
        pos = (true + rng.normal(0, 0.05, (people, 2)))[rng.random(people) < DETECTED]
        found = Detections(t + 1, t / FPS, "ground", pos, None, None, np.ones(len(pos)))
        yield true, Frame(t + 1, t / FPS, detections=found)


def sums(given: argparse.Namespace) -> None:
    """Prints a table: rows are numbers of people in a cluster, columns the errors of belief propagation and the cost.

    A cluster is a row of people NEAREST apart; a person in a particle is off the detection by ERROR per axis.
    """
    tables.head(
        ["people", "ratio of the sums, mean", "least", "largest", "largest error of a probability, mean", "largest",
         "exact, ms", "propagated, ms"]
    )  # fmt: skip
    for count in SIZES:
        ratio, error, exact_time, time_of = [], [], 0.0, 0.0
        for seed in given.seeds:
            W, miss, spare = cluster(np.random.default_rng(seed), count)
            true, found = np.empty(W.shape), np.empty(W.shape)
            exact_sum(W, miss, spare, true)
            begun = time.process_time()
            log_exact = exact_sum(W, miss, spare, true)
            middle = time.process_time()
            log_found = propagated_sum(W, miss, spare, found)
            time_of += time.process_time() - middle
            exact_time += middle - begun
            ratio.append(np.exp(log_found - log_exact))
            error.append(np.abs(found - true).max())
        cells = [f"{x:.3f}" for x in (np.mean(ratio), min(ratio), max(ratio), np.mean(error), max(error))]
        times = [f"{1000 * x / len(ratio):.3f}" for x in (exact_time, time_of)]
        tables.row([str(count), *cells, *times])


def cluster(rng: np.random.Generator, count: int) -> tuple[Array, Array, Array]:
    """Returns the weights W (n, m), miss (n,) and spare (m,) of people who stand in a row, some of them missed."""
    pos = np.stack([NEAREST * np.arange(count), np.zeros(count)], axis=1)
    points = (pos + rng.normal(0, ERROR, pos.shape))[rng.random(count) < DETECTED]
    if not len(points):
        points = pos[:1].copy()
    place = pos + rng.normal(0, ERROR, pos.shape)
    d2 = ((place[:, None] - points[None]) ** 2).sum(axis=2)
    sd = 2 * ERROR
    g = np.exp(-0.5 * d2 / sd**2) / (2 * np.pi * sd**2)
    return DETECTED * g / CLUTTER, np.full(count, 1 - DETECTED), np.ones(len(points))
