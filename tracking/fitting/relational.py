"""`fit_relational`: the speed table and the relation dynamics of `relational`, learned from clean simulated truth;
`fit_observed`: the speed table and the sensor's noise, learned from observations, as the paper does.

Speed table (Table 3 of Cattelani et al. 2012): for each row of speeds the mean of the velocity's change over LAG,
against the direction of motion, and its standard deviation per axis; as drift per second and diffusion per root second.
The paper learns from differences of measured boxes in consecutive frames, which mixes the sensor's errors with the
motion.

Relations (ours; the paper gives none): a logistic regression of "in one true group" on distance and velocity
difference, and the rate at which the relation follows it: the one whose moving average of probabilities has the least
log loss.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, Bools, Ints, Truth
from sim.types import Sequence as Recording
from tracking.filters.assignment import optimal

Changes = tuple[Array, Array, Array, Array]

LAG = 0.4  # Time over which changes of velocity are measured, s: steering is correlated over shorter times.
NEAR = 6.0  # Pairs farther apart teach nothing, m.
LEAST = 500  # Fewest rows from which anything is fitted.
RATES = tuple(0.05 * 2.0**k for k in range(9))  # Rates of relations that are tried, 1/s.
# Standard deviation of the prior of each logistic weight, about 0: pairs that a line separates have finite weights.
PRIOR = 5.0
FURTHEST = 2.0  # Largest distance of a detection from its person, m.
# Settings of a sensor as the paper's observations are: every visible person, nobody else, and displaced feet.
LABELS = ("sensor.detect_prob=1", "sensor.occlusion_power=0", "sensor.clutter_rate=0")
PAPER_ENDS = (0.0125, 2.5, 5.0, 7.5)  # Column A of the paper's Table 3, m/s.
STEPS = 50  # Most steps of Newton's method.


@dataclass(frozen=True)
class TruePairs:
    """Pairs of people of a sequence, one row per pair and frame, sorted by pair, then frame. pair, frame (R,)."""

    pair: Ints
    frame: Ints
    design: Array  # (R, 3): 1, minus distance in m, minus velocity difference in m/s
    same: Bools  # (R,): True if both are in one true group
    dt: float  # s between frames


def fit_relational(truths: Iterable[Truth], ends: Sequence[float]) -> dict[str, float | list[float]]:
    """Returns fitted parameters of `relational` by name: drift, diffusion, relation_rate, _bias, _distance, _velocity.
    ends: upper ends of the rows of the speed table, m/s; the last row has none. Raises InputError for too few data."""
    changes, pairs = [], []
    for truth in truths:
        changes.append(velocity_changes(truth, max(1, round(LAG * truth.fps))))
        pairs.append(pair_rows(truth))
    speed = np.concatenate([c[0] for c in changes]) if changes else np.zeros(0)
    same = np.concatenate([p.same for p in pairs]) if pairs else np.zeros(0, bool)
    if len(speed) < LEAST or same.all() or not same.any():
        raise InputError(
            place="scenes", got=f"{len(speed)} changes of velocity, {int(same.sum())} pairs in groups of {len(same)}",
            expected=f"{LEAST} changes, and pairs in and out of groups", remedy="give more seeds or scenarios",
        )  # fmt: skip
    weights = logistic(np.concatenate([p.design for p in pairs]), same)
    losses = [_log_loss(pairs, weights, rate) for rate in RATES]
    rate = RATES[int(np.argmin(losses))]
    names = ("relation_bias", "relation_distance", "relation_velocity")
    return speed_table(changes, ends) | {"relation_rate": rate, **dict(zip(names, weights.tolist(), strict=True))}


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


def pair_rows(truth: Truth) -> TruePairs:
    """Returns the rows of all pairs of people of a sequence, in the frames in which they are at most 6 m apart."""
    assert truth.pos is not None
    assert truth.vel is not None
    people, found = int(truth.id.max(initial=0)) + 1, []
    for index in range(1, truth.length + 1):
        r = truth.rows(index)
        pos, vel, id, group = truth.pos[r], truth.vel[r], truth.id[r], truth.group[r]
        a, b = np.triu_indices(len(id), 1)
        distance, differ = (np.hypot(*(x[a] - x[b]).T) for x in (pos, vel))
        near = distance <= NEAR
        a, b, distance, differ = a[near], b[near], distance[near], differ[near]
        design = np.stack([np.ones(len(a)), -distance, -differ], axis=1)
        found.append((id[a] * people + id[b], np.full(len(a), index), design, (group[a] >= 0) & (group[a] == group[b])))
    pair, frame, design, same = (np.concatenate(x) for x in zip(*found, strict=True))
    order = np.lexsort((frame, pair))
    return TruePairs(pair[order], frame[order], design[order], same[order], 1 / truth.fps)


def logistic(design: Array, same: Bools) -> Array:
    """Returns the weights (3,) of a logistic regression of `same` (R,) on `design` (R, 3), with a normal prior."""
    weights = np.zeros(design.shape[1])
    for _ in range(STEPS):
        p = 1 / (1 + np.exp(-np.clip(design @ weights, -40, 40)))
        gradient = design.T @ (same - p) - weights / PRIOR**2
        hessian = (design * (p * (1 - p))[:, None]).T @ design + np.eye(len(weights)) / PRIOR**2
        step = np.linalg.solve(hessian, gradient)
        weights = weights + step
        if np.abs(step).max() < 1e-8:
            break
    return weights


def _log_loss(sequences: list[TruePairs], weights: Array, rate: float) -> float:
    from scipy.signal import lfilter

    total, count = 0.0, 0
    for rows in sequences:
        g = 1 / (1 + np.exp(-np.clip(rows.design @ weights, -40, 40)))
        new = -np.expm1(-rate * rows.dt)
        cuts = np.flatnonzero((np.diff(rows.pair) != 0) | (np.diff(rows.frame) != 1)) + 1
        for part in np.split(np.arange(len(g)), cuts):
            if len(part):
                smooth = lfilter([new], [1, new - 1], g[part], zi=[(1 - new) * g[part[0]]])[0]
                p = np.clip(smooth, 1e-6, 1 - 1e-6)
                total -= float(np.log(np.where(rows.same[part], p, 1 - p)).sum())
                count += len(part)
    return total / max(count, 1)
