"""The speed table and the sensor's noise of the preset `paper`, learned from observations, as the paper does.

Speed table (Table 3 of Cattelani et al. 2012): for each row of speeds the mean of the velocity's change from frame to
frame, against the direction of motion, and its standard deviation per axis; as drift per second and diffusion per root
second. Velocities are differences of detected positions, so that the sensor's errors are part of the table.
"""

from __future__ import annotations

import argparse

import numpy as np

from scenarios.loading.resolve import resolve
from sim.sequence import simulate
from sim.types import Array, Sequence
from tracking.filters.assignment import optimal

FURTHEST = 2.0  # Largest distance of a detection from its person, m.
# Settings of a sensor as the paper's observations are: every visible person, nobody else, and displaced feet.
LABELS = ("sensor.detect_prob=1", "sensor.occlusion_power=0", "sensor.clutter_rate=0")
ENDS = (0.0125, 2.5, 5.0, 7.5)  # Column A of Table 3: upper ends of the rows but the last, m/s.


def observed(sequence: Sequence) -> tuple[Array, Array]:
    """Returns rows (R, 4) of people detected in three successive frames: speed, m/s, change of velocity per time along
    and across the direction of motion, m/s^2, and the time between two frames, s; and the errors (N, 2) of all detected
    positions, m."""
    truth = sequence.truth
    assert truth is not None
    assert truth.pos is not None
    pos = np.full((len(truth.id), 2), np.nan)
    for frame in sequence:
        rows = truth.rows(frame.index)
        assert frame.detections is not None
        points = frame.detections.pos[:, :2]
        people, found = optimal(np.hypot(*(truth.pos[rows][:, None] - points).transpose(2, 0, 1)), FURTHEST)
        pos[rows.start + people] = points[found]
    order = np.lexsort((truth.frame, truth.id))
    vel = np.diff(pos[order], axis=0) * truth.fps
    vel[(np.diff(truth.id[order]) != 0) | (np.diff(truth.frame[order]) != 1)] = np.nan
    speed, change = np.hypot(*vel[:-1].T), np.diff(vel, axis=0) * truth.fps
    ahead = vel[:-1] / np.maximum(speed, 1e-9)[:, None]
    across = change[:, 1] * ahead[:, 0] - change[:, 0] * ahead[:, 1]
    changes = np.column_stack([speed, (change * ahead).sum(axis=1), across, np.full(len(speed), 1 / truth.fps)])
    return _known(changes), _known(pos - truth.pos)


def _known(rows: Array) -> Array:
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def speed_table(changes: Array) -> tuple[list[float], list[float]]:
    """Returns drift, m/s^2, and diffusion, m/s^1.5, of each row of the table; changes (R, 4): of `observed`."""
    drifts, diffusions = [], []
    row = np.searchsorted(ENDS, changes[:, 0])
    for k in range(len(ENDS) + 1):
        _, along, across, dt = changes[row == k].T if (row == k).any() else changes.T
        drifts.append(max(-float(along.mean()), 0.0) if k else 0.0)
        diffusions.append(float(np.sqrt(np.mean(dt * ((along + drifts[k]) ** 2 + across**2)) / 2)))
    return drifts, diffusions


def table(given: argparse.Namespace) -> None:
    """Prints the parameters of the preset, learned on a suite with the seeds asked for."""
    entries = resolve(f"suite:{given.suite}", LABELS)
    found = [observed(simulate(e.scenario, seed, e.repeat, ())) for e in entries for seed in given.seeds]
    changes, errors = (np.concatenate(part) for part in zip(*found, strict=True))
    drift, diffusion = speed_table(changes)
    noise = np.sqrt(np.mean(errors**2))
    print(f"drift = {np.round(drift, 2)}\ndiffusion = {np.round(diffusion, 2)}\npoint_noise = {noise:.3f}")
