"""The search for an agent: CMA-ES over the offset and weights of a linear policy (tracking.agent), on whole episodes.

First the offset alone is searched, the best fixed parameters; from there offset and weights together. All policies of a
generation are played on the same training sequences, and what counts is the gain over the defaults on each of them:
scenes differ by more than policies do. The centre of the last generations is what was found; it is believed where its
gain on validation sequences is sure. Hansen & Ostermeier 2001; needs `cmaes`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scenarios.errors import InputError
from sim.types import Array, DetectionMode, Ints
from sim.workers.protocol import RunItems
from sim.workers.start import results_in_order, start_workers
from tracking.agent import Policy
from tracking.environment.episodes import Cache, Rollout, play
from tracking.environment.observation import NAMES, Observer
from tracking.episode_source import Source
from tracking.stats import paired
from tracking.tuning import scenes

SIGMA = 0.08
"""First step of the search for fixed parameters, in the cube; half of it for the agent's offset, and for what all its
weights together make of statistics one standard deviation from usual."""
LEAST = 0.02
"""A statistic's standard deviation is taken to be no less."""
BATCH = 8
"""Training sequences that a generation is played on, others in the next one."""


@dataclass(frozen=True)
class Learned:
    """policy: the agent where it is surely better in validation than the fixed parameters and the defaults, else the
    former where they are surely better than the latter, else the defaults (no weights, no offset).

    agent, fixed: what was found in any case; gain: the fixed ones' over the defaults, more: the agent's over the fixed
    ones, total: the agent's over the defaults, mean and the ends of the 95 % interval; history: mean gains in training
    of each generation's policies.
    """

    policy: Policy
    agent: Policy
    fixed: Policy
    gain: tuple[float, float, float]
    more: tuple[float, float, float]
    total: tuple[float, float, float]
    history: tuple[float, ...]


@dataclass(frozen=True)
class Job:
    """A policy on a source."""

    policy: Policy
    source: Source
    mode: DetectionMode


def learn(
    tracker: str,
    suite: scenes.Scenes,
    parameters: Sequence[str],
    statistics: Sequence[str],
    *,
    every: float = 1.0,
    generations: int = 20,
    seeds: range = range(24),
    validation: range = range(10_000, 10_024),
    set: Iterable[str] = (),
    detections: DetectionMode = "file",
    workers: int = 1,
    seed: int = 0,
    progress: Callable[[int, int, float], None] | None = None,
) -> Learned:
    """An agent that moves these parameters by these statistics, every so many seconds.

    generations: of the search for fixed parameters, and, where there are statistics, again of that for the agent.
    progress: called with the generations done, how many there will be, and the mean gain. InputError where names are
    unknown, and where scenes are recordings, or seeds of another split: as in `tracking.tune`.
    """
    _needed()
    if not parameters or generations < 1:
        place, got = ("generations", generations) if parameters else ("parameters", "none")
        raise InputError(place=place, got=got, expected="at least one", remedy="give more")
    names, settings = scenes.named(suite), tuple(set)
    count = scenes.scenes(names, settings, "suite")
    train, check = (
        scenes.of(names, scenes.chosen_seeds(some, split, count), settings)
        for some, split in ((seeds, "train"), (validation, "val"))
    )
    p, f = np.zeros(len(parameters)), np.zeros(len(statistics))
    zero = Policy(tracker, every, tuple(parameters), tuple(statistics), p, np.outer(p, f), f, f + 1)
    usual, spread = usual_statistics(zero, train[:BATCH], detections)
    zero = replace(zero, usual=usual, spread=spread)
    with start_workers(workers) as run:
        base = dict(zip(train, played(run, zero, train, detections), strict=True))

        def gains(policies: list[Policy], part: Sequence[Source]) -> Array:
            jobs = [Job(policy, s, detections) for policy in policies for s in part]
            value = np.reshape(list(results_in_order(run, objective, jobs)), (len(policies), len(part)))
            return np.asarray(value - np.array([base[s] for s in part]))

        history: list[float] = []

        def tell(mean: float) -> None:
            history.append(mean)
            if progress is not None:
                progress(len(history), generations * (2 if len(f) else 1), mean)

        steps = SIGMA * np.r_[np.ones(len(p)), np.zeros(p.size * f.size)]
        fixed = agent = _evolved(zero, steps, train, gains, generations, seed, tell)
        if len(f):
            steps = SIGMA / 2 * np.r_[np.ones(len(p)), np.full(p.size * f.size, f.size**-0.5)]
            agent = _evolved(fixed, steps, train, gains, generations, seed, tell)
        old, new = (played(run, one, check, detections) for one in (zero, fixed))
        newest = new if agent is fixed else played(run, agent, check, detections)
    gain, more, total = _gain(old, new), _gain(new, newest), _gain(old, newest)
    policy = agent if min(more[1], total[1]) > 0 else fixed if gain[1] > 0 else zero
    return Learned(policy, agent, fixed, gain, more, total, tuple(history))


def _needed() -> None:
    """InputError where the search's package is missing."""
    try:
        import cmaes  # noqa: F401
    except ImportError as error:
        remedy = 'install the extra: pip install "flockscope[tune]"'
        raise InputError(place="agent_search", got="no cmaes", expected="the package cmaes", remedy=remedy) from error


def _gain(before: Array, after: Array) -> tuple[float, float, float]:
    """Mean difference of scores (S,) of the same sequences, and the ends of its interval."""
    mean, low, high = paired(before[:, None], after[:, None])
    return float(mean[0]), float(low[0]), float(high[0])


def _evolved(
    start: Policy,
    steps: Array,
    train: Sequence[Source],
    gains: Callable[[list[Policy], Sequence[Source]], Array],
    generations: int,
    seed: int,
    tell: Callable[[float], None],
) -> Policy:
    """The mean of the centres of the last quarter of the generations; steps (P + P F,): the first ones of each number,
    0: it stays. tell: called with each generation's mean gain."""
    from cmaes import CMA

    free = np.flatnonzero(steps)
    search = CMA(mean=np.zeros(len(free)), sigma=1.0, seed=seed)
    r, centres = np.random.default_rng(seed), []
    for _ in range(generations):
        part = [train[i] for i in sorted(r.permutation(len(train))[:BATCH])]
        points = [search.ask() for _ in range(search.population_size)]
        found = gains([moved(start, free, steps[free] * point) for point in points], part).mean(1)
        search.tell([(point, -float(value)) for point, value in zip(points, found, strict=True)])
        centres.append(search.mean.copy())
        tell(float(found.mean()))
    return moved(start, free, steps[free] * np.mean(centres[-max(generations // 4, 1) :], axis=0))


def moved(policy: Policy, which: Ints, by: Array) -> Policy:
    """The policy with some of the numbers of its offset and weights, one after the other, moved by so much."""
    p, f = policy.weights.shape
    point = np.r_[policy.offset, policy.weights.ravel()]
    point[which] += by
    return replace(policy, offset=point[:p], weights=point[p:].reshape(p, f))


def played(run: RunItems, policy: Policy, among: Sequence[Source], mode: DetectionMode) -> Array:
    """The objective (S,) of a policy on each of the sources."""
    return np.array(list(results_in_order(run, objective, [Job(policy, s, mode) for s in among])))


def usual_statistics(policy: Policy, among: Sequence[Source], mode: DetectionMode) -> tuple[Array, Array]:
    """Mean and standard deviation (F,) of its statistics, as the tracker sees them with the config that it moves."""
    seen = []
    for source in among:
        rollout = Rollout(
            policy.tracker, source, policy.base, detections=mode, tracker_seed=source.seed, cache=_memory()
        )
        observer, long = Observer(rollout.sequence.fps), policy.frames(rollout.sequence.fps)
        for k, (frame, answer) in enumerate(rollout.advance(), 1):
            observer.see(frame, answer)
            if k % long == 0:
                seen.append(observer.look(rollout.ready.px_per_m(rollout.answers)))
    found = np.array(seen, float)[:, [NAMES.index(s) for s in policy.statistics]]
    return found.mean(0), np.maximum(found.std(0), LEAST)


def objective(job: Job) -> float:
    """Of an episode; 0 where it has nothing to score."""
    found = play(
        job.policy.tracked(), job.source, detections=job.mode, tracker_seed=job.source.seed, cache=_memory()
    ).objective
    return 0.0 if np.isnan(found) else found


@functools.cache
def _memory() -> Cache:
    """Of this process."""
    return Cache()
