"""The search for an agent: CMA-ES over the offset and weights of a linear policy (tracking.agent), on whole episodes.

All policies of a generation are played on the same training sequences, and what counts is the gain over the defaults on
each of them: scenes differ by more than policies do. The centre of the last generations is the agent; it is believed
where its gain on validation sequences is sure, else the defaults stay. Hansen & Ostermeier 2001; needs `cmaes`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, DetectionMode
from sim.workers import Run, crew, in_order
from tracking.agent import Policy
from tracking.episodes import Cache, Rollout, play
from tracking.observation import NAMES, Observer
from tracking.source import Source, What, sources
from tracking.stats import paired

SIGMA = 0.08
"""First step of the search, in the cube: of an offset, and of a weight per standard deviation of a statistic."""
LEAST = 0.02
"""A statistic's standard deviation is taken to be no less."""
BATCH = 8
"""Training sequences that a generation is played on, others in the next one."""


@dataclass(frozen=True)
class Learned:
    """policy: the agent, or the defaults (no weights, no offset) where it was not surely better in validation; tried:
    the agent in any case; gain: its mean gain there, and the ends of the 95 % interval; history: mean gains in training
    of each generation's policies."""

    policy: Policy
    tried: Policy
    gain: tuple[float, float, float]
    history: tuple[float, ...]


@dataclass(frozen=True)
class Job:
    """A policy on a source."""

    policy: Policy
    source: Source
    mode: DetectionMode


def learn(
    tracker: str,
    suite: What,
    parameters: Sequence[str],
    statistics: Sequence[str],
    *,
    every: float = 1.0,
    generations: int = 20,
    seeds: Iterable[int] = range(24),
    validation: Iterable[int] = range(10_000, 10_024),
    set: Iterable[str] = (),
    detections: DetectionMode = "file",
    workers: int = 1,
    seed: int = 0,
    progress: Callable[[int, int, float], None] | None = None,
) -> Learned:
    """An agent that moves these parameters by these statistics, every so many seconds.

    No statistics: the best fixed parameters that the same search finds. progress: called with the generations done, how
    many there will be, and the mean gain. InputError where names are unknown.
    """
    settings = tuple(set)
    train, check = sources(suite, seeds, settings), sources(suite, validation, settings)
    p, f = np.zeros(len(parameters)), np.zeros(len(statistics))
    zero = Policy(tracker, every, tuple(parameters), tuple(statistics), p, np.outer(p, f), f, f + 1)
    usual, spread = usual_statistics(zero, train[:BATCH], detections)
    zero = replace(zero, usual=usual, spread=spread)
    with crew(workers) as run:
        base = dict(zip(train, played(run, zero, train, detections), strict=True))

        def gains(policies: list[Policy], part: Sequence[Source]) -> Array:
            jobs = [Job(policy, s, detections) for policy in policies for s in part]
            value = np.reshape(list(in_order(run, objective, jobs)), (len(policies), len(part)))
            return np.asarray(value - np.array([base[s] for s in part]))

        best, history = _evolved(zero, train, gains, generations, seed, progress)
        new, old = (played(run, one, check, detections) for one in (best, zero))
    gain, low, high = (float(v[0]) for v in paired(old[:, None], new[:, None]))
    return Learned(best if low > 0 else zero, best, (gain, low, high), history)


def _evolved(
    zero: Policy,
    train: Sequence[Source],
    gains: Callable[[list[Policy], Sequence[Source]], Array],
    generations: int,
    seed: int,
    progress: Callable[[int, int, float], None] | None,
) -> tuple[Policy, tuple[float, ...]]:
    """The mean of the centres of the last quarter of the generations, and the mean gain of each generation."""
    try:
        from cmaes import CMA
    except ImportError as error:
        remedy = 'install the extra: pip install "flockscope[tune]"'
        raise InputError(place="agent_search", got="no cmaes", expected="the package cmaes", remedy=remedy) from error
    p, f = zero.weights.shape
    search = CMA(mean=np.zeros(p * (1 + f)), sigma=SIGMA, seed=seed)
    r, history, centres = np.random.default_rng(seed), [], []
    for k in range(generations):
        part = [train[i] for i in sorted(r.permutation(len(train))[:BATCH])]
        points = [search.ask() for _ in range(search.population_size)]
        found = gains([moved(zero, point) for point in points], part).mean(1)
        search.tell([(point, -float(value)) for point, value in zip(points, found, strict=True)])
        history.append(float(found.mean()))
        centres.append(search.mean.copy())
        if progress is not None:
            progress(k + 1, generations, history[-1])
    return moved(zero, np.mean(centres[-max(generations // 4, 1) :], axis=0)), tuple(history)


def moved(policy: Policy, point: Array) -> Policy:
    """The policy with the offset and weights of a point (P + P F,)."""
    p, f = policy.weights.shape
    return replace(policy, offset=point[:p], weights=point[p:].reshape(p, f))


def played(run: Run, policy: Policy, among: Sequence[Source], mode: DetectionMode) -> Array:
    """The objective (S,) of a policy on each of the sources."""
    return np.array(list(in_order(run, objective, [Job(policy, s, mode) for s in among])))


def usual_statistics(policy: Policy, among: Sequence[Source], mode: DetectionMode) -> tuple[Array, Array]:
    """Mean and standard deviation (F,) of its statistics, as the tracker sees them with the config that it moves."""
    seen = []
    for source in among:
        rollout = Rollout(policy.tracker, source, policy.base, detections=mode, cache=_memory())
        observer, long = Observer(rollout.sequence.fps), policy.frames(rollout.sequence.fps)
        for k, (frame, answer) in enumerate(rollout.advance(), 1):
            observer.see(frame, answer)
            if k % long == 0:
                seen.append(observer.look(rollout.ready.px_per_m(rollout.answers)))
    found = np.array(seen, float)[:, [NAMES.index(s) for s in policy.statistics]]
    return found.mean(0), np.maximum(found.std(0), LEAST)


def objective(job: Job) -> float:
    """Of an episode; 0 where it has nothing to score."""
    found = play(job.policy.tracked(), job.source, detections=job.mode, cache=_memory()).objective
    return 0.0 if np.isnan(found) else found


@functools.cache
def _memory() -> Cache:
    """Of this process."""
    return Cache()
