"""Fits a linear policy (`tracking.running.policy`) by playing episodes of the environment that change meanwhile (ours).

Configs are drawn round the one to begin with, and each plays all training scenes as a constant, with a decision in each
window of `every` s. The score of a window under a config with the residuals u_p, before which the statistics z_k were
seen (standardised, z_0 = 1), is taken as a response surface (Box and Wilson 1951):

    S = S_w + sum_p [ u_p sum_k g_pk z_k - h_p u_p² ]

S_w, what the window itself gives, is the mean over configs and falls out of the differences from it. g and h follow by
ridge regression over all windows, scenes and configs. The surface is highest at u_p = sum_k g_pk z_k / (2 h_p), which
is the policy. h_p is at least `curvature`, so that a parameter without effect stays, and |u_p| at most `limit`, as the
surface is known only where configs were drawn. So no scene need tell when or how
it changes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from sim.types import Array
from tracking.config import Config
from tracking.environment.env import TuningEnv
from tracking.parameter_space import Space
from tracking.running.policy import BIAS, Policy, averaged
from tracking.running.signals import NAMES

SPREAD, CHANGED = 0.4, 0.35  # standard deviation of drawn residuals; share of the parameters that each changes
EVERY, MEMORY = 2.0, 2.0  # s from one decision to the next, and over which statistics are averaged
FITS = tuple((1e-4, curvature, limit) for curvature in (0.2, 0.6) for limit in (0.3, 0.5))  # of `fitted_policy`
LEAST_SD = 1e-3  # of a statistic: one that varies less tells nothing
# statistics of how tracker and detector fit; those of the crowd, and scores, mean something else in other scenes
TOLD = (
    "observed", "associated", "extra", "found", "coasting", "gap", "residual", "nis", "shift", "births", "deaths",
    "brief",
)  # fmt: skip
LEAST_WEIGHT = 0.005  # of a standardised statistic: smaller ones are left out of the policy


@dataclass(frozen=True)
class Played:
    """One episode with T decisions: seen (T + 1, K), averaged statistics before each window, and after the last;
    residual (T, P) and score (T,) of each window; objective of the whole episode."""

    seen: Array
    residual: Array
    score: Array
    objective: float


# play(policy, offset): plays all training scenes, in their order; [] if the tracker fails with these parameters
PlayAll = Callable[[Policy, Array], list[Played]]


def play_policy(env: TuningEnv, policy: Policy, offset: Array | None = None) -> Played:
    """Plays one episode of an environment with residual actions by a policy. offset (P,): is added to its residuals.

    The environment's next scene is played. Its parameters must begin with the policy's, and it must decide as often.
    """
    new, _ = env.reset(options={"params": policy.base})
    columns = [k for k, p in enumerate(env.space) if p.name in policy.weights]
    seen, ended = [averaged(None, new[: len(NAMES)].astype(float), policy)], False
    scores, moves = list[float](), list[Array]()
    while not ended:
        action = np.zeros(len(env.space))
        action[columns] = np.clip(policy.residual(seen[-1]) + (0.0 if offset is None else offset), -1.0, 1.0)
        before = 0 if env.rollout is None else len(env.rollout.tracks)
        new, reward, ended, _, info = env.step(action)
        moves.append(action[columns])
        assert env.rollout is not None
        scores.append(reward * env.rollout.length / (info["frame"] - before))
        seen.append(averaged(seen[-1], new[: len(NAMES)].astype(float), policy))
    return Played(np.array(seen), np.array(moves), np.array(scores), info["scores"].get("objective", math.nan))


def drawn_residuals(space: Space, count: int, random: np.random.Generator) -> Array:
    """Returns residuals (count, P) of configs to play; the first are 0."""
    found = random.normal(0.0, SPREAD, (count, len(space))) * (random.random((count, len(space))) < CHANGED)
    found[0] = 0.0
    return np.clip(found, -1.0, 1.0)


def fitted_policy(
    base: Config, space: Space, played: Sequence[Sequence[Played]], ridge: float, curvature: float, limit: float
) -> Policy:
    """Returns the policy fitted to episodes: played[c][s] is the c-th on scene s."""
    scenes = list(zip(*played, strict=True))
    seen = np.concatenate([[one.seen[:-1] for one in scene] for scene in scenes], axis=1)  # (C, windows, K)
    score = np.concatenate([[one.score for one in scene] for scene in scenes], axis=1)  # (C, windows)
    later = seen.any(axis=(0, 2))  # not the windows before which nothing is seen
    seen, score = seen[:, later], score[:, later]
    mean, sd = seen.mean(axis=(0, 1)), seen.std(axis=(0, 1))
    tells = np.flatnonzero((sd > LEAST_SD) & np.isin(NAMES, TOLD))
    z = np.concatenate([np.ones((*score.shape, 1)), (seen[..., tells] - mean[tells]) / sd[tells]], axis=2)
    u = np.concatenate([[one.residual for one in scene] for scene in scenes], axis=1)[:, later]  # (C, windows, P)
    linear = (u[..., :, None] * z[..., None, :]).reshape(*score.shape, -1)
    surface = np.concatenate([linear, -np.square(u)], axis=2)
    x, y = (each - each.mean(axis=0) for each in (surface, score))
    x, y = x.reshape(-1, x.shape[2]), y.ravel()
    solved = np.linalg.solve(x.T @ x + ridge * len(x) * np.eye(x.shape[1]), x.T @ y)
    slope, bend = solved[: -len(space)].reshape(len(space), -1), np.maximum(solved[-len(space) :], curvature)
    aim = slope / (2.0 * bend[:, None])
    rows = {}
    for p, (first, *others) in zip(space, aim.tolist(), strict=True):
        weights = {NAMES[k]: w / sd[k] for k, w in zip(tells, others, strict=True) if abs(w) > LEAST_WEIGHT}
        bias = first - sum(w * mean[NAMES.index(name)] for name, w in weights.items())
        told = weights or abs(first) > LEAST_WEIGHT
        found = {BIAS: float(bias), **weights} if told else {}
        rows[p.name] = {name: round(float(w), 4) for name, w in found.items()}
    return Policy(base, EVERY, MEMORY, rows, limit)


def searched_policy(
    play: PlayAll, base: Config, space: Space, configs: int, seed: int, report: Callable[[str], None]
) -> tuple[Policy, list[list[Played]]]:
    """Returns the policy whose episodes have the best mean objective, the one that always keeps `base` if none has a
    better one, and the episodes of the constants.

    configs: number of constants to play. Half as many again are played round the best policy that was fitted to them,
    and all are fitted once more.
    """
    random = np.random.default_rng(seed)
    best = Policy(base, EVERY, MEMORY, {p.name: {} for p in space})
    pool = list[list[Played]]()
    for k, offset in enumerate(drawn_residuals(space, configs, random)):
        report(f"policy: configs, {k + 1} of {configs}")
        pool += _known(play(best, offset))
    constants, most = list(pool), mean_objective(pool[0]) if pool else -math.inf
    for again in (0, configs // 2):
        report(f"policy: {again} configs round the best")
        for offset in drawn_residuals(space, again + 1, random)[1:]:
            pool += _known(play(best, offset))
        for fit in FITS if pool else ():
            report("policy: fits")
            made = fitted_policy(base, space, pool, *fit)
            played = _known(play(made, np.zeros(len(space))))
            pool += played
            if played and mean_objective(played[0]) > most:
                best, most = made, mean_objective(played[0])
    return best, constants


def _known(played: list[Played]) -> list[list[Played]]:
    return [played] if played else []


def mean_objective(played: Sequence[Played]) -> float:
    """Returns the mean of the objectives that are known."""
    return float(np.nanmean([one.objective for one in played]))
