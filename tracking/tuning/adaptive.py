"""Fits a linear policy (`tracking.running.policy`) by playing episodes of the environment that change meanwhile (ours).

Reward-weighted regression (Peters and Schaal 2007). Configs are drawn round the one to begin with, and each plays all
training scenes as a constant, with a decision in each window of `every` s. In a window w of a scene, a config c has the
score S_wc. Its advantage is A_wc = S_wc - mean_c S_wc, averaged over NEAR windows before and after. The parameters to
aim at in a window are the mean of all configs' residuals under the weights exp(A_wc / temperature), less their mean
under equal weights, so that a parameter without effect stays. A ridge regression then tells these from the statistics
that were seen before the window, under any of the configs. So no scene need tell when or how it changes.
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
NEAR = 1  # windows before and after over which advantages are averaged
LEAST_SD = 1e-3  # of a statistic: one that varies less tells nothing
UNTOLD = "time", "since", "rate"  # statistics that do not depend on what is seen: they would be learned by heart
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
    temperature: float, ridge: float,
) -> Policy:  # fmt: skip
    """Returns the policy fitted to episodes: played[c][s] is that of config c, with residuals (C, P), on scene s."""
    aims, seen = list[Array](), list[Array]()
    for s in range(len(played[0])):
        score = np.array([each[s].score for each in played])  # (C, T)
        advantage = smoothed(score - score.mean(axis=0))
        weight = np.exp((advantage - advantage.max(axis=0)) / temperature)
        weight /= weight.sum(axis=0)
        aim = np.einsum("ct,cp->tp", weight - 1.0 / len(weight), residuals)
        for each in played:
            seen.append(each[s].seen[:-1])
            aims.append(aim)
    x, y = np.concatenate(seen), np.concatenate(aims)
    mean, sd = x.mean(axis=0), x.std(axis=0)
    tells = (sd > LEAST_SD) & ~np.isin(NAMES, UNTOLD)
    z = np.where(tells, (x - mean) / np.where(tells, sd, 1.0), 0.0)
    solved = np.linalg.solve(z.T @ z + ridge * len(z) * np.eye(z.shape[1]), z.T @ (y - y.mean(axis=0)))
    solved[np.abs(solved) < LEAST_WEIGHT] = 0.0
    rows = {}
    for k, p in enumerate(space):
        weights = {NAMES[j]: float(w / sd[j]) for j, w in enumerate(solved[:, k]) if w}
        bias = float(y[:, k].mean() - sum(w * mean[NAMES.index(name)] for name, w in weights.items()))
        if weights or abs(bias) > LEAST_WEIGHT:
            rows[p.name] = {BIAS: round(bias, 6), **{name: round(w, 6) for name, w in weights.items()}}
    return Policy(base, every, memory, rows)


def smoothed(values: Array) -> Array:
    """Returns values (C, T) averaged over NEAR of their neighbours in time on either side."""
    padded = np.pad(values, ((0, 0), (NEAR, NEAR)), mode="edge")
    return np.asarray(np.mean([padded[:, k : k + values.shape[1]] for k in range(2 * NEAR + 1)], axis=0))


def constant(base: Config, space: Space, residual: Array) -> Config:
    """Returns the config at a residual (P,) from `base`."""
    return decode(space, moved(space, residual, base), base)
