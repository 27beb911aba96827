"""`fit_relational`: the speed table of `relational`, learned from clean simulated truth.

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

Changes = tuple[Array, Array, Array, Array]

LAG = 0.4  # Time over which changes of velocity are measured, s: steering is correlated over shorter times.
LEAST = 500  # Fewest changes from which a table is fitted.


def fit_relational(truths: Iterable[Truth], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns fitted parameters of `relational` by name: drift and diffusion. ends: upper ends of the rows of the speed
    table, m/s; the last row has none. Raises InputError for too few data."""
    changes = [velocity_changes(truth, max(1, round(LAG * truth.fps))) for truth in truths]
    count = sum(len(speed) for speed, *_ in changes)
    if count < LEAST:
        remedy = "give more seeds or scenarios"
        raise InputError(place="scenes", got=f"{count} changes of velocity", expected=f"{LEAST}", remedy=remedy)
    return speed_table(changes, ends)


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
