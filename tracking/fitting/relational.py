"""`fit_relational`: the speed table of `relational`, learned from clean simulated truth; `fit_observed`: the table and
the sensor's noise, learned from observations, as the paper does.

Speed table (Table 3 of Cattelani et al. 2012): for each row of speeds the mean of the velocity's change over LAG,
against the direction of motion, and its standard deviation per axis; as drift per second and diffusion per root second.
The paper learns from differences of measured boxes in consecutive frames, which mixes the sensor's errors with the
motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Truth
from sim.types import Sequence as Recording
from tracking.filters.assignment import optimal

Changes = tuple[Array, Array, Array, Array]

LAG = 0.4  # Time over which changes of velocity are measured, s: steering is correlated over shorter times.
LEAST = 500  # Fewest changes from which a table is fitted.
FURTHEST = 2.0  # Largest distance of a detection from its person, m.
# Settings of a sensor as the paper's observations are: every visible person, nobody else, and displaced feet.
LABELS = ("sensor.detect_prob=1", "sensor.occlusion_power=0", "sensor.clutter_rate=0")
PAPER_ENDS = (0.0125, 2.5, 5.0, 7.5)  # Column A of the paper's Table 3, m/s.


def fit_relational(truths: Iterable[Truth], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns fitted parameters of `relational` by name: drift and diffusion. ends: upper ends of the rows of the speed
    table, m/s; the last row has none. Raises InputError for too few data."""
    changes = [velocity_changes(truth, max(1, round(LAG * truth.fps))) for truth in truths]
    count = sum(len(speed) for speed, *_ in changes)
    if count < LEAST:
        remedy = "give more seeds or scenarios"
        raise InputError(place="scenes", got=f"{count} changes of velocity", expected=f"{LEAST}", remedy=remedy)
    return speed_table(changes, ends)


def fit_observed(sequences: Iterable[Recording], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns fitted parameters by name: drift, diffusion, and point_noise, the standard deviation of detected
    positions, m. ends: upper ends of the rows of the speed table, m/s."""
    changes, errors = [], []
    for sequence in sequences:
        truth, error = observed(sequence)
        changes.append(velocity_changes(truth, 1))
        errors.append(error)
    noise = float(np.sqrt(np.mean(np.square(np.concatenate(errors)))))
    return speed_table(changes, ends) | {"point_noise": noise}


def observed(sequence: Recording) -> tuple[Truth, Array]:
    """Returns the truth with detected positions in place of the true ones, and the errors (N, 2) of all detected
    positions, m. Velocities are differences from the frame before; rows without a velocity are left out."""
    truth = sequence.truth
    assert truth is not None
    assert truth.pos is not None
    pos, true = np.full((len(truth.id), 2), np.nan), truth.pos[:, :2]
    for frame in sequence:
        rows = truth.rows(frame.index)
        assert frame.detections is not None
        points = frame.detections.pos[:, :2]
        people, found = optimal(np.hypot(*(true[rows][:, None] - points).transpose(2, 0, 1)), FURTHEST)
        pos[np.arange(rows.start, rows.stop)[people]] = points[found]
    order = np.lexsort((truth.frame, truth.id))
    before, after = order[:-1], order[1:]
    vel = np.full(pos.shape, np.nan)
    vel[after] = (pos[after] - pos[before]) * truth.fps
    apart = (truth.id[after] != truth.id[before]) | (truth.frame[after] - truth.frame[before] != 1)
    vel[after[apart]] = np.nan
    kept, errors = np.isfinite(vel[:, 0]), pos - true
    frame, id, group = truth.frame[kept], truth.id[kept], truth.group[kept]
    seen = truth.replace(
        frame=frame, id=id, group=group, pos=pos[kept], vel=vel[kept], box=None, visibility=truth.visibility[kept]
    )
    return seen, errors[np.isfinite(errors[:, 0])]


def speed_table(changes: Sequence[Changes], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns the lists drift (m/s^2) and diffusion (m/s^1.5), one number per row of the speed table, by name.
    changes: results of `velocity_changes`. ends: upper ends of the rows, m/s; the last row has none."""
    speed, along, across, lag = (np.concatenate(x) for x in zip(*changes, strict=True))
    row = np.searchsorted(ends, speed)
    drifts, diffusions = [], []
    for k in range(len(ends) + 1):
        inside = row == k
        if not inside.any():
            inside = np.ones(len(row), bool)
        drift = 0.0 if k == 0 else max(-float(np.mean(along[inside] / lag[inside])), 0.0)
        spread = np.mean((along[inside] + drift * lag[inside]) ** 2 / lag[inside] + across[inside] ** 2 / lag[inside])
        drifts.append(drift)
        diffusions.append(float(np.sqrt(spread / 2)))
    return {"drift": drifts, "diffusion": diffusions}


def velocity_changes(truth: Truth, frames: int) -> Changes:
    """Returns four arrays (R,): speed, m/s; change of velocity over `frames` frames along and across the direction of
    motion, m/s; and the time of the change, s."""
    assert truth.vel is not None
    order = np.lexsort((truth.frame, truth.id))
    frame, id, vel = truth.frame[order], truth.id[order], truth.vel[order]
    later = np.arange(len(frame)) + frames
    later = later[later < len(frame)]
    now = later - frames
    kept = (id[now] == id[later]) & (frame[later] - frame[now] == frames)
    now, later = now[kept], later[kept]
    speed = np.hypot(*vel[now].T)
    ahead = vel[now] / np.maximum(speed, 1e-9)[:, None]
    change = vel[later] - vel[now]
    along = (change * ahead).sum(axis=1)
    across = change[:, 1] * ahead[:, 0] - change[:, 0] * ahead[:, 1]
    return speed, along, across, np.full(len(now), frames / truth.fps)
