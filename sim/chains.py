"""Chains: people of one moment who stand behind one another.

Along the line that fits them best their spacing is 0.4-1.5 m and nobody is more than 0.5 m off it. From one to the next
the way turns by 60° at most: a conversation circle passes the first two tests when projected, never the third.
"""

from __future__ import annotations

import math

import numpy as np

from sim.types import Array, Bools, Ints

NEAREST, FURTHEST = 0.4, 1.5  # m along the line
OFF = 0.5  # m
STRAIGHT = 0.5  # cosine of the greatest turn from one to the next
FAR = 1e9  # m: where those stand who are off a line
SHARE = 2 / 3  # of a standing crowd that must be in the chain: else it is a crowd


def chain(pos: Array) -> Ints:
    """Rows of the chain among people at pos (N, 2), N > 1, who stand close to one another, in order; or none."""
    whole = _along(pos, np.arange(len(pos)))
    if _fits(pos[whole]):
        return whole
    least = max(3, math.ceil(SHARE * len(pos)))
    found = [_from_seed(pos, i, j) for i, j in _seeds(pos, least)] if len(pos) >= least else []
    found = sorted((c for c in found if len(c) >= least), key=lambda c: (-len(c), _residual(pos[c])))
    return found[0] if found else np.zeros(0, np.int64)


def axis(pos: Array) -> Array:
    """Unit vector (2,) of the line through places (N, 2) in order, from the first towards the last."""
    if len(pos) == 2:
        direction = pos[1] - pos[0]
    else:
        direction = np.linalg.svd(pos - pos.mean(axis=0), full_matrices=False)[2][0]
        direction = direction if direction @ (pos[-1] - pos[0]) >= 0 else -direction
    return np.asarray(direction / max(float(np.hypot(*direction)), 1e-12))


def _along(pos: Array, rows: Ints) -> Ints:
    return rows[np.argsort((pos[rows] - pos[rows[0]]) @ axis(pos[rows]), kind="stable")]


def _fits(pos: Array) -> bool:
    """Whether places (N, 2), in order, are a chain."""
    u = axis(pos)
    arm = pos - pos.mean(axis=0)
    if np.abs(arm @ np.array([-u[1], u[0]])).max() > OFF:
        return False
    return bool(_steps_fit(pos, u).all() and _turns_fit(pos).all())


def _steps_fit(pos: Array, u: Array) -> Bools:
    steps = np.diff(pos @ u)
    return np.asarray((steps >= NEAREST) & (steps <= FURTHEST))


def _turns_fit(pos: Array) -> Bools:
    step = np.diff(pos, axis=0)
    length = np.hypot(*step.T)
    return np.asarray((step[:-1] * step[1:]).sum(axis=1) >= STRAIGHT * length[:-1] * length[1:])


def _seeds(pos: Array, least: int) -> list[tuple[int, int]]:
    """Pairs through whose line a chain of `least` people may go: so many stand along it with the right spacing."""
    i, j = np.triu_indices(len(pos), 1)
    step = pos[j] - pos[i]
    length = np.hypot(*step.T)
    kept = (length >= NEAREST) & (length <= FURTHEST)
    i, j, u = i[kept], j[kept], step[kept] / length[kept, None]
    arm = pos[None] - (pos[i] + pos[j])[:, None] / 2
    off = np.abs(arm[..., 1] * u[:, :1] - arm[..., 0] * u[:, 1:])
    along = np.sort(np.where(off <= OFF, arm[..., 0] * u[:, :1] + arm[..., 1] * u[:, 1:], FAR), axis=1)
    gap = np.diff(along, axis=1)
    run, longest = np.ones(len(i), np.int64), np.ones(len(i), np.int64)
    for k in range(gap.shape[1]):
        run = np.where((gap[:, k] >= NEAREST) & (gap[:, k] <= FURTHEST), run + 1, 1)
        longest = np.maximum(longest, run)
    return list(zip(i[longest >= least].tolist(), j[longest >= least].tolist(), strict=True))


def _from_seed(pos: Array, i: int, j: int) -> Ints:
    """The longest chain along the line through i and j."""
    u = axis(pos[[i, j]])
    arm = pos - (pos[i] + pos[j]) / 2
    rows = np.flatnonzero(np.abs(arm @ np.array([-u[1], u[0]])) <= OFF)
    rows = rows[np.argsort(arm[rows] @ u, kind="stable")]
    links = _steps_fit(pos[rows], u)
    links[1:] &= _turns_fit(pos[rows]) | ~links[:-1]
    run = max(np.split(rows, np.flatnonzero(~links) + 1), key=len)
    return run if len(run) > 1 and _fits(pos[run]) else rows[:0]


def _residual(pos: Array) -> float:
    return float(np.linalg.svd(pos - pos.mean(axis=0), compute_uv=False)[-1]) if len(pos) > 2 else 0.0
