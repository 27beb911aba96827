"""Mode `consistency` of benchmarks/group_pda.py: does the centroid's filter know how wrong it is?

One group alone, whose centroid moves by the filter's own model: constant velocity and white acceleration. Members
    redrawn   all of them anew in each frame, Gaussian about the centroid: `centroid_noise = "redrawn"` is right, or
    fixed     at fixed offsets (of mean 0), each seen with probability 0.75: `centroid_noise = "people"` is right;
each by the other filter, too, which should fall out of its bands (without the miss hypothesis, which would rather lose
a group than believe what it sees). In these, members who are not seen are not carried along: neither formula knows of
that. The last row is the tracker as it is. NEES is taken at single frames over independent runs, of the state (x, v)
and of the position alone; NIS and whiteness over all frames from the first of these on.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.group_pda_tables import table
from sim.types import Array, Context, Detections, Frame
from tracking import tracker_registry
from tracking.scoring.consistency import LAGS, mean_band, normalised, normalised_square, whiteness, whiteness_band

FPS = 10.0
AT = (30, 45, 60)  # frames in which NEES is taken
PEOPLE = 20
SPREAD = 0.3  # m, standard deviation of a member's place; the default of person_spread, so that shrinking has no bias
SEEN = 0.75  # of fixed members, probability
START = 1.3  # m/s, standard deviation of the first velocity
PLAIN: Mapping[str, object] = {"carry_time": 0.0}
ALL_SEEN: Mapping[str, object] = {"detect_prob": 1.0}
SOME_SEEN: Mapping[str, object] = {"detect_prob": SEEN}
CASES: Mapping[str, tuple[str, Mapping[str, object]]] = {
    "redrawn members, filter redrawn": ("redrawn", {**PLAIN, **ALL_SEEN, "centroid_noise": "redrawn"}),
    "fixed members, filter people": ("fixed", {**PLAIN, **SOME_SEEN}),
    "mismatch: redrawn members, filter people": ("redrawn", {**PLAIN, **ALL_SEEN, "miss": False}),
    "mismatch: fixed members, filter redrawn": (
        "fixed",
        {**PLAIN, **SOME_SEEN, "miss": False, "centroid_noise": "redrawn"},
    ),
    "fixed members, filter people, the unseen carried along": ("fixed", SOME_SEEN),
}


@dataclass(frozen=True)
class Path:
    """A run's centroid (T, 4) x, y, vx, vy, and what is measured in each frame: places (M, 2)."""

    state: Array
    points: list[Array]


def draw(members: str, accel: float, noise: float, r: np.random.Generator) -> Path:
    """One run; accel: m/s^1.5, noise: m, of each measured place."""
    frames, dt = AT[-1], 1 / FPS
    a = r.normal(0, accel / np.sqrt(dt), (frames, 2))
    state = np.zeros((frames, 4))
    state[0, 2:] = r.normal(0, START, 2)
    for k in range(1, frames):
        state[k, :2] = state[k - 1, :2] + dt * state[k - 1, 2:] + dt**2 / 2 * a[k]
        state[k, 2:] = state[k - 1, 2:] + dt * a[k]
    offsets = r.normal(0, SPREAD, (PEOPLE, 2))
    offsets -= offsets.mean(0)
    points = []
    for k in range(frames):
        about = r.normal(0, SPREAD, (PEOPLE, 2)) if members == "redrawn" else offsets[r.random(PEOPLE) < SEEN]
        points.append(state[k, :2] + about + r.normal(0, noise, about.shape))
    return Path(state, points)


@dataclass(frozen=True)
class Record:
    """Of the runs in which one group was told in every frame: errors and covariances at AT (R, K, 4), (R, K, 4, 4), and
    normalised innovations (R, T, 2)."""

    error: Array
    cov: Array
    innovation: Array
    dropped: int


def record(tracker: str, members: str, params: Mapping[str, object], runs: int) -> Record:
    """Track `runs` runs; those in which there was ever more or less than one group are dropped, and counted."""
    kind: Any = tracker_registry.find(tracker)
    config = kind.config_class.from_dict(params)
    rows = []
    for seed in range(runs):
        path = draw(members, config.accel_noise, config.point_noise, np.random.default_rng([seed, len(members)]))
        rows.append(follow(kind(config), path))
    good = [row for row in rows if row is not None]
    error, cov, innovation = (np.array([row[k] for row in good]) for k in range(3))
    return Record(error, cov, innovation, runs - len(good))


def follow(tracker: Any, path: Path) -> tuple[Array, Array, Array] | None:
    """One run's errors and covariances at AT and normalised innovations from AT[0] on."""
    tracker.reset(Context(FPS, 40.0), 0)
    error, cov, y, S = [], [], [], []
    for index, points in enumerate(path.points, 1):
        t = (index - 1) / FPS
        frame = Frame(index, t, detections=Detections(index, t, "ground", points, score=np.ones(len(points))))
        said = tracker.step(frame, frame.detections)
        if index < AT[0]:
            continue
        if len(said.id) != 1 or len(tracker.innovation) != 1:
            return None
        _, one, its = tracker.innovation[0]
        y.append(one)
        S.append(its)
        if index in AT:
            error.append(np.concatenate([said.pos[0], said.vel[0]]) - path.state[index - 1])
            cov.append(said.cov[0])
    return np.array(error), np.array(cov), normalised(np.array(y), np.array(S))


def judged(value: float, low: float, high: float) -> str:
    """A value and its band; * where it lies outside."""
    return f"{value:.2f} [{low:.2f}, {high:.2f}]" + ("" if low <= value <= high else " *")


def cells(found: Record) -> dict[str, str]:
    """One row of the table by column."""
    out = {"runs": f"{len(found.error)} ({found.dropped} dropped)"}
    if not len(found.error):
        return out
    runs, frames = found.innovation.shape[:2]
    for name, dims in (("state", 4), ("place", 2)):
        for k, frame in enumerate(AT):
            nees = normalised_square(found.error[:, k, :dims], found.cov[:, k, :dims, :dims]).mean()
            out[f"NEES of {name}, frame {frame}"] = judged(float(nees), *mean_band(runs, dims))
    nis = float(np.square(found.innovation).sum(2).mean())
    out["NIS"] = judged(nis, *mean_band(runs * frames, 2))
    r = np.mean([whiteness(one) for one in found.innovation], axis=0)
    for lag in range(1, LAGS + 1):
        band = whiteness_band(frames, 2, lag) / np.sqrt(runs)
        out[f"r({lag})"] = judged(float(r[lag - 1]), -band, band)
    return out


def consistency(given: argparse.Namespace) -> Any:
    """Must-show 6: each generator by each filter."""
    found = {name: cells(record(given.tracker, *case, given.runs)) for name, case in CASES.items()}
    title = f"one group of {PEOPLE}, {FPS:g} frames/s; bands of 95 %, * outside; 4, 2, 2, 0 are right"
    columns = list(dict.fromkeys(column for row in found.values() for column in row))
    rows = {name: [row.get(column, "–") for column in columns] for name, row in found.items()}
    table(title, "members and filter", columns, rows)
    return found
