"""Mode `consistency` of `benchmarks.group_pda`: do the covariances of the centroid's filter match its errors?

The centroid of one group moves by the filter's own model: constant velocity and white acceleration. Its members are
    redrawn   all drawn anew in each frame, Gaussian about the centroid; the filter without `corrections` fits
    fixed     at fixed offsets of mean 0, each seen with probability 0.75; the filter with `corrections` fits
    spaced    as fixed, but 0.75 m apart as people are, not Gaussian about the centroid
Redrawn and fixed members are also tracked by the other filter, which should fall outside its bands. Missed
members are carried along in the last rows only. Columns:
normalised estimation error squared (NEES) at single frames over independent runs, of the state (position, velocity;
expected 4) and of the position alone (2); normalised innovation squared (NIS; 2) and autocorrelations r of the
innovations (0), over all frames from the first of these on. Brackets: 95 % bands; * outside.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.support.tables import table
from sim.types import Array, Context, Detections, Frame
from tracking import tracker_registry
from tracking.scoring.consistency import LAGS, mean_band, normalised, normalised_square, whiteness, whiteness_band

FPS = 10.0
AT = (30, 45, 60)  # frames in which NEES is taken
PEOPLE = 20
SPREAD = 0.3  # m, standard deviation of a member's place; the default of person_spread, so that shrinking has no bias
GAP, JITTER = 0.75, 0.08  # m, between spaced members, and its standard deviation
SEEN = 0.75  # of fixed and spaced members, probability
START = 1.3  # m/s, standard deviation of the first velocity
PLAIN: Mapping[str, object] = {"carry_time": 0.0}
ALL_SEEN: Mapping[str, object] = {"detect_prob": 1.0}
SOME_SEEN: Mapping[str, object] = {"detect_prob": SEEN}
CASES: Mapping[str, tuple[str, int, Mapping[str, object]]] = {
    "redrawn members, filter redrawn": ("redrawn", PEOPLE, {**PLAIN, **ALL_SEEN, "corrections": False}),
    "fixed members, filter people": ("fixed", PEOPLE, {**PLAIN, **SOME_SEEN}),
    "mismatch: redrawn members, filter people": ("redrawn", PEOPLE, {**PLAIN, **ALL_SEEN}),
    "mismatch: fixed members, filter redrawn": (
        "fixed",
        PEOPLE,
        {**PLAIN, **SOME_SEEN, "corrections": False},
    ),
    "4 spaced members, the unseen carried along": ("spaced", 4, SOME_SEEN),
    "9 spaced members, the unseen carried along": ("spaced", 9, SOME_SEEN),
    "fixed members, the unseen carried along": ("fixed", PEOPLE, SOME_SEEN),
}


@dataclass(frozen=True)
class SimulatedGroup:
    """State of the centroid in each frame, (T, 4) x, y, vx, vy, and measured positions (M, 2) in each frame; m, m/s."""

    state: Array
    points: list[Array]


def draw(members: str, people: int, accel: float, noise: float, r: np.random.Generator) -> SimulatedGroup:
    """Returns one run; accel: noise of the acceleration, m/s^1.5; noise: standard deviation of each position, m."""
    frames, dt = AT[-1], 1 / FPS
    a = r.normal(0, accel / np.sqrt(dt), (frames, 2))
    state = np.zeros((frames, 4))
    state[0, 2:] = r.normal(0, START, 2)
    for k in range(1, frames):
        state[k, :2] = state[k - 1, :2] + dt * state[k - 1, 2:] + dt**2 / 2 * a[k]
        state[k, 2:] = state[k - 1, 2:] + dt * a[k]
    if members == "spaced":
        side = int(np.ceil(np.sqrt(people)))
        offsets = GAP * np.stack(np.divmod(np.arange(people), side), 1) + r.normal(0, JITTER, (people, 2))
    else:
        offsets = r.normal(0, SPREAD, (people, 2))
    offsets -= offsets.mean(0)
    points = []
    for k in range(frames):
        about = r.normal(0, SPREAD, (people, 2)) if members == "redrawn" else offsets[r.random(people) < SEEN]
        points.append(state[k, :2] + about + r.normal(0, noise, about.shape))
    return SimulatedGroup(state, points)


@dataclass(frozen=True)
class FilterErrors:
    """Of the R runs in which exactly one group was reported in every frame.

    error (R, K, 4) and cov (R, K, 4, 4): at the frames AT; innovation (R, T, 2): normalised; dropped: number of other
    runs.
    """

    error: Array
    cov: Array
    innovation: Array
    dropped: int


def filter_errors(tracker: str, runs: int, members: str, people: int, params: Mapping[str, object]) -> FilterErrors:
    """Tracks `runs` runs and returns the errors of the runs with exactly one group in every frame."""
    kind: Any = tracker_registry.find(tracker)
    config = kind.config_class.from_dict(params)
    rows = []
    for seed in range(runs):
        path = draw(
            members, people, config.accel_noise, config.point_noise, np.random.default_rng([seed, len(members)])
        )
        rows.append(follow(kind(config), path))
    good = [row for row in rows if row is not None]
    error, cov, innovation = (np.array([row[k] for row in good]) for k in range(3))
    return FilterErrors(error, cov, innovation, runs - len(good))


def follow(tracker: Any, path: SimulatedGroup) -> tuple[Array, Array, Array] | None:
    """Returns errors and covariances at AT and normalised innovations from AT[0] on; None without exactly one group."""
    tracker.reset(Context(FPS, 40.0), 0)
    error, cov, y, S = [], [], [], []
    for index, points in enumerate(path.points, 1):
        t = (index - 1) / FPS
        frame = Frame(index, t, detections=Detections(index, t, "ground", points, score=np.ones(len(points))))
        answer = tracker.step(frame, frame.detections)
        if index < AT[0]:
            continue
        if len(answer.id) != 1 or len(tracker.innovation) != 1:
            return None
        _, one, its = tracker.innovation[0]
        y.append(one)
        S.append(its)
        if index in AT:
            error.append(np.concatenate([answer.pos[0], answer.vel[0]]) - path.state[index - 1])
            cov.append(answer.cov[0])
    return np.array(error), np.array(cov), normalised(np.array(y), np.array(S))


def with_band(value: float, low: float, high: float) -> str:
    """Returns a value and its band; * if it lies outside."""
    return f"{value:.2f} [{low:.2f}, {high:.2f}]" + ("" if low <= value <= high else " *")


def cells(found: FilterErrors) -> dict[str, str]:
    """Returns one row of the table by column."""
    out = {"runs": f"{len(found.error)} ({found.dropped} dropped)"}
    if not len(found.error):
        return out
    runs, frames = found.innovation.shape[:2]
    for name, dims in (("state", 4), ("position", 2)):
        for k, frame in enumerate(AT):
            nees = normalised_square(found.error[:, k, :dims], found.cov[:, k, :dims, :dims]).mean()
            out[f"NEES of {name}, frame {frame}"] = with_band(float(nees), *mean_band(runs, dims))
    nis = float(np.square(found.innovation).sum(2).mean())
    out["NIS"] = with_band(nis, *mean_band(runs * frames, 2))
    r = np.mean([whiteness(one) for one in found.innovation], axis=0)
    for lag in range(1, LAGS + 1):
        band = whiteness_band(frames, 2, lag) / np.sqrt(runs)
        out[f"r({lag})"] = with_band(float(r[lag - 1]), -band, band)
    return out


def consistency(given: argparse.Namespace) -> Any:
    """Prints the table and returns its cells: each kind of members with each filter."""
    found = {name: cells(filter_errors(given.tracker, given.runs, *case)) for name, case in CASES.items()}
    title = f"one group, of {PEOPLE} where nothing is said, {FPS:g} frames/s; 95 % bands"
    columns = list(dict.fromkeys(column for row in found.values() for column in row))
    rows = {name: [row.get(column, "–") for column in columns] for name, row in found.items()}
    table(title, "members and filter", columns, rows)
    return found
