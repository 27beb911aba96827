"""Fits a linear policy (`tracking.running.policy`) by playing episodes of the environment that change meanwhile (ours).

Configs are drawn round the one to begin with, and each plays all training scenes as a constant, with a decision in each
window of `every` s. The score of a window under a config with the residuals u_p, before which the statistics z_k were
seen (standardised, z_0 = 1), is taken as a response surface (Box and Wilson 1951):

    S = S_w + sum_p [ u_p sum_k g_pk z_k - h_p u_p² ]

S_w, what the window itself gives, is the mean over configs and falls out of the differences from it. g and h follow by
ridge regression over all windows, scenes and configs. The surface is highest at u_p = sum_k g_pk z_k / (2 h_p), which
is the policy. h_p is at least `curvature`, so that a parameter without effect stays. So no scene need tell when or how
it changes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.config import Config
from tracking.environment.env import TuningEnv
from tracking.parameter_space import Space, decode, moved
from tracking.running.policy import BIAS, Policy, averaged
from tracking.running.signals import NAMES

SPREAD, CHANGED = 0.4, 0.35  # standard deviation of drawn residuals; share of the parameters that each changes
LEAST_SD = 1e-3  # of a statistic: one that varies less tells nothing
# statistics of how tracker and detector fit; those of the crowd, and scores, mean something else in other scenes
TOLD = (
    "observed", "associated", "extra", "found", "coasting", "gap", "residual", "nis", "shift", "births", "deaths",
    "brief",
)  # fmt: skip
LEAST_WEIGHT = 0.005  # of a standardised statistic: smaller ones are left out of the policy


@dataclass(frozen=True)
class Played:
    """One episode with decisions: seen (T + 1, K), averaged statistics before each window, and after the last; score
    (T,) of each window; objective of the whole episode."""

    seen: Array
    score: Array
    objective: float


def play_policy(env: TuningEnv, policy: Policy, offset: Array | None = None) -> Played:
    """Plays one episode of an environment with residual actions by a policy. offset (P,): is added to its residuals.

    The environment's next scene is played. Its parameters must begin with the policy's, and it must decide as often.
    """
    new, _ = env.reset(options={"params": policy.base})
    names = [p.name for p in policy.space]
    columns = [k for k, p in enumerate(env.space) if p.name in names]
    seen, scores, ended = [averaged(None, new[: len(NAMES)].astype(float), policy)], list[float](), False
    while not ended:
        action = np.zeros(len(env.space))
        action[columns] = policy.residual(seen[-1]) + (0.0 if offset is None else offset)
        before = 0 if env.rollout is None else len(env.rollout.tracks)
        new, reward, ended, _, info = env.step(np.clip(action, -1.0, 1.0))
        assert env.rollout is not None
        scores.append(reward * env.rollout.length / (info["frame"] - before))
        seen.append(averaged(seen[-1], new[: len(NAMES)].astype(float), policy))
    return Played(np.array(seen), np.array(scores), info["scores"].get("objective", math.nan))


def drawn_residuals(space: Space, count: int, random: np.random.Generator) -> Array:
    """Returns residuals (count, P) of configs to play; the first are 0."""
    found = random.normal(0.0, SPREAD, (count, len(space))) * (random.random((count, len(space))) < CHANGED)
    found[0] = 0.0
    return np.clip(found, -1.0, 1.0)


def fitted_policy(
    base: Config, space: Space, every: float, memory: float, residuals: Array, played: Sequence[Sequence[Played]],
    ridge: float, curvature: float,
) -> Policy:  # fmt: skip
    """Returns the policy fitted to episodes: played[c][s] is that of config c, with residuals (C, P), on scene s."""
    seen = np.concatenate(
        [[one.seen[:-1] for one in scene] for scene in zip(*played, strict=True)], axis=1
    )  # (C, N, K)
    score = np.concatenate([[one.score for one in scene] for scene in zip(*played, strict=True)], axis=1)  # (C, N)
    mean, sd = seen.mean(axis=(0, 1)), seen.std(axis=(0, 1))
    tells = np.flatnonzero((sd > LEAST_SD) & np.isin(NAMES, TOLD))
    z = np.concatenate([np.ones((*score.shape, 1)), (seen[..., tells] - mean[tells]) / sd[tells]], axis=2)
    u, parts = residuals[:, None], z.shape[2]
    linear = (u[..., :, None] * z[..., None, :]).reshape(*score.shape, -1)
    surface = np.concatenate([linear, np.broadcast_to(-np.square(u), (*score.shape, len(space)))], axis=2)
    x, y = (each - each.mean(axis=0) for each in (surface, score))
    x, y = x.reshape(-1, x.shape[2]), y.ravel()
    solved = np.linalg.solve(x.T @ x + ridge * len(x) * np.eye(x.shape[1]), x.T @ y)
    slope, bend = solved[: -len(space)].reshape(len(space), parts), np.maximum(solved[-len(space) :], curvature)
    aim = slope / (2.0 * bend[:, None])
    rows = {}
    for p, (first, *others) in zip(space, aim.tolist(), strict=True):
        weights = {NAMES[k]: w / sd[k] for k, w in zip(tells, others, strict=True) if abs(w) > LEAST_WEIGHT}
        bias = first - sum(w * mean[NAMES.index(name)] for name, w in weights.items())
        if weights or abs(first) > LEAST_WEIGHT:
            rows[p.name] = {BIAS: round(float(bias), 4), **{name: round(float(w), 4) for name, w in weights.items()}}
    return Policy(base, every, memory, rows)


def constant(base: Config, space: Space, residual: Array) -> Config:
    """Returns the config at a residual (P,) from `base`."""
    return decode(space, moved(space, residual, base), base)
