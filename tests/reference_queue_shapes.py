"""Slow, obvious oracle of queues: the chain among the people of one standing crowd, tried line by line."""

from __future__ import annotations

import math

import numpy as np

from sim.truth.queue_detection import MAX_OFFSET, MAX_SPACING, MIN_CROWD_SHARE, MIN_SPACING, MIN_TURN_COSINE


def chain(pos):
    """Rows of the chain among people at pos (N, 2), N > 1, who stand close to one another, in order; or none."""
    whole = _along(pos, np.arange(len(pos)))
    if _fits(pos[whole]):
        return whole
    least = max(3, math.ceil(MIN_CROWD_SHARE * len(pos)))
    found = [_from_seed(pos, i, j) for i, j in _seeds(pos)] if len(pos) >= least else []
    found = sorted((c for c in found if len(c) >= least), key=lambda c: (-len(c), _residual(pos[c])))
    return found[0] if found else np.zeros(0, np.int64)


def axis(pos):
    """Unit vector (2,) of the line through places (N, 2) in order, from the first towards the last."""
    if len(pos) == 2:
        direction = pos[1] - pos[0]
    else:
        direction = np.linalg.svd(pos - pos.mean(axis=0), full_matrices=False)[2][0]
        direction = direction if direction @ (pos[-1] - pos[0]) >= 0 else -direction
    return np.asarray(direction / max(float(np.hypot(*direction)), 1e-12))


def _along(pos, rows):
    return rows[np.argsort((pos[rows] - pos[rows[0]]) @ axis(pos[rows]), kind="stable")]


def _fits(pos):
    """Whether places (N, 2), in order, are a chain."""
    u = axis(pos)
    arm = pos - pos.mean(axis=0)
    if np.abs(arm @ np.array([-u[1], u[0]])).max() > MAX_OFFSET:
        return False
    return bool(_steps_fit(pos, u).all() and _turns_fit(pos).all())


def _steps_fit(pos, u):
    steps = np.diff(pos @ u)
    return np.asarray((steps >= MIN_SPACING) & (steps <= MAX_SPACING))


def _turns_fit(pos):
    step = np.diff(pos, axis=0)
    length = np.hypot(*step.T)
    return np.asarray((step[:-1] * step[1:]).sum(axis=1) >= MIN_TURN_COSINE * length[:-1] * length[1:])


def _seeds(pos):
    i, j = np.triu_indices(len(pos), 1)
    length = np.hypot(*(pos[j] - pos[i]).T)
    kept = (length >= MIN_SPACING) & (length <= MAX_SPACING)
    return list(zip(i[kept].tolist(), j[kept].tolist(), strict=True))


def _from_seed(pos, i, j):
    """The longest chain along the line through i and j."""
    u = axis(pos[[i, j]])
    arm = pos - (pos[i] + pos[j]) / 2
    rows = np.flatnonzero(np.abs(arm @ np.array([-u[1], u[0]])) <= MAX_OFFSET)
    rows = rows[np.argsort(arm[rows] @ u, kind="stable")]
    links = _steps_fit(pos[rows], u)
    links[1:] &= _turns_fit(pos[rows]) | ~links[:-1]
    run = max(np.split(rows, np.flatnonzero(~links) + 1), key=len)
    return run if len(run) > 1 and _fits(pos[run]) else rows[:0]


def _residual(pos):
    return float(np.linalg.svd(pos - pos.mean(axis=0), compute_uv=False)[-1]) if len(pos) > 2 else 0.0
