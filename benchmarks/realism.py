"""How people walk here, beside the literature and beside seq_hotel: the table of docs/realism.md.

    PYTHONPATH=. python benchmarks/realism.py [../shared/data/biwi/seq_hotel] [--seeds 0:40] [--scenarios street …]

Groups are measured alone on open ground, 4 s and more after the start. Recording and scenarios are both sampled at
2.5 fps with velocities by central differences; speeds are those of people who walk (> 0.3 m/s), the closest approach is
the least distance of two strangers who come within 3 m, accelerations are compared at their 99 % quantile.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from scipy.stats import wasserstein_distance

from scenarios.loading.resolve import load, names
from scenarios.schema.scenario import Scenario
from sim.crowd.world import run
from sim.io.source import open_source
from sim.types import Array, Bools, Ints, Motion

STEP = 0.4  # s
WALKING = 0.3  # m/s
MEETING = 3.0  # m
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
OPEN_GROUND = {"schema": 1, "duration": 9.0, "warmup": 4.0, "world": {"size": [60, 20]}}


@dataclass(frozen=True)
class Walk:
    """A group that walks along +x: speed (S,) of each seed; places (S, T, n, 2) ahead and to the left of its middle."""

    speed: Array
    places: Array


def alone(size: int, seeds: range) -> Walk:
    """A group of `size` alone on open ground."""
    pos = np.stack([alone_motion(size, seed).pos for seed in seeds])
    middle = pos.mean(axis=2)
    way = np.linalg.norm(middle[:, -1] - middle[:, 0], axis=1)
    return Walk(way / ((pos.shape[1] - 1) / 10), pos - middle[:, :, None])


def alone_motion(size: int, seed: int) -> Motion:
    """A group of `size` alone on open ground walks along +x."""
    group = {"id": "a", "size": size, "start": [20, 10], "goal": [40, 10], "at_goal": "walk"}
    return run(Scenario.model_validate({**OPEN_GROUND, "group": [group]}), seed)


def free_speeds(seeds: range) -> Array:
    """Speeds of people who walk alone, twenty each seed, metres apart."""
    group = {"id": "a", "size": 1, "start": [20, 5], "goal": [40, 5], "at_goal": "walk"}
    lanes = [{**group, "id": f"a{k}", "start": [20, 5 + 10 * k], "goal": [40, 5 + 10 * k]} for k in range(20)]
    scenario = Scenario.model_validate({**OPEN_GROUND, "world": {"size": [60, 210]}, "group": lanes})
    pos = np.stack([run(scenario, seed).pos for seed in seeds])
    return np.asarray(np.linalg.norm(pos[:, -1] - pos[:, 0], axis=-1).ravel() / ((pos.shape[1] - 1) / 10))


def neighbours(walk: Walk) -> Array:
    """Distance of each member to the nearest other, all seeds and frames."""
    d = np.linalg.norm(walk.places[:, :, :, None] - walk.places[:, :, None], axis=-1)
    d[..., np.arange(d.shape[-1]), np.arange(d.shape[-1])] = np.inf
    return np.asarray(d.min(axis=-1).ravel())


def abreast(walk: Walk) -> Array:
    """Angle (degrees) between the line through a pair and the direction of walking: 90 is abreast."""
    d = np.abs(walk.places[:, :, 0] - walk.places[:, :, 1])
    return np.asarray(np.degrees(np.arctan2(d[..., 1], d[..., 0])).ravel())


def middle_behind(walk: Walk) -> Array:
    """How far (m) the middle one of a triad walks behind the other two, per seed."""
    order = np.argsort(walk.places[..., 1], axis=2)
    ahead = np.take_along_axis(walk.places[..., 0], order, axis=2).mean(axis=1)
    return np.asarray((ahead[:, 0] + ahead[:, 2]) / 2 - ahead[:, 1])


def rows(walk: Walk) -> Array:
    """Number of rows of each seed's group: steps of more than 0.4 m in how far ahead its members walk on average."""
    ahead = np.sort(walk.places[..., 0].mean(axis=1), axis=1)
    return np.asarray((np.diff(ahead, axis=1) > 0.4).sum(axis=1) + 1)


def through(size: int, seeds: range) -> Bools:
    """Whether a stranger who comes towards a group of `size`, up to 0.5 m off its middle, goes between two."""
    found = []
    for seed in seeds:
        off = float(np.random.default_rng(seed).uniform(-0.5, 0.5))
        group = {"id": "a", "size": size, "start": [20, 10], "goal": [50, 10], "at_goal": "walk"}
        other = {"id": "b", "size": 1, "start": [38, 10 + off], "goal": [5, 10 + off], "at_goal": "walk"}
        motion = run(Scenario.model_validate({**OPEN_GROUND, "duration": 14.0, "group": [group, other]}), seed)
        found.append(passes_between(motion.pos))
    return np.array(found)


def passes_between(pos: Array) -> bool:
    """Whether the last of pos (T, P, 2) had some of the others to the left and some to the right when passing each."""
    away = pos[:, :-1] - pos[:, -1:]
    passing = [int(np.argmin(np.abs(x))) for x in away[..., 0].T]
    sides = np.array([away[t, k, 1] > 0 for k, t in enumerate(passing)])
    return bool(sides.any() and not sides.all())


def statistics(pos: Array, label: Ints) -> tuple[Array, Array, Array]:
    """Speeds of walkers, closest approaches of strangers, accelerations; pos (T, P, 2) at 2.5 fps, label (T, P)."""
    vel = (pos[2:] - pos[:-2]) / (2 * STEP)
    speed = np.linalg.norm(vel, axis=2).ravel()
    acceleration = np.linalg.norm(np.diff(vel, axis=0) / STEP, axis=2).ravel()
    least = np.full((pos.shape[1],) * 2, np.inf)
    for here, group in zip(pos, label, strict=True):
        there = np.flatnonzero(np.isfinite(here[:, 0]))
        d = np.linalg.norm(here[there, None] - here[None, there], axis=2)
        d[(group[there, None] == group[None, there]) & (group[there, None] >= 0)] = np.inf
        least[np.ix_(there, there)] = np.minimum(least[np.ix_(there, there)], d)
    close = least[np.triu_indices(len(least), 1)]
    return speed[speed > WALKING], close[close < MEETING], acceleration[np.isfinite(acceleration)]


def recording(folder: str) -> tuple[Array, Array, Array]:
    """The statistics of a BIWI folder."""
    truth = open_source(folder)[0].truth
    assert truth is not None
    assert truth.pos is not None
    ids, column = np.unique(truth.id, return_inverse=True)
    pos = np.full((truth.length, len(ids), 2), np.nan)
    label = np.full(pos.shape[:2], -1, np.int64)
    pos[truth.frame - 1, column] = truth.pos
    label[truth.frame - 1, column] = truth.group
    return statistics(pos, label)


def simulated(name: str, seeds: range) -> tuple[Array, Array, Array]:
    """The pooled statistics of a scenario."""
    parts = []
    for seed in seeds:
        motion = run(load(name), seed)
        every = round(motion.fps * STEP)
        parts.append(statistics(np.asarray(motion.pos[::every]), np.asarray(motion.intent[::every])))
    speed, closest, acceleration = (np.concatenate(x) for x in zip(*parts, strict=True))
    return speed, closest, acceleration


def beside(mine: tuple[Array, Array, Array], real: tuple[Array, Array, Array]) -> tuple[float, float, float]:
    """Wasserstein distances in speed (m/s) and closest approach (m); ratio of the 99 % accelerations."""
    near = wasserstein_distance(mine[1], real[1]) if len(mine[1]) else np.nan
    ratio = np.quantile(mine[2], 0.99) / np.quantile(real[2], 0.99)
    return float(wasserstein_distance(mine[0], real[0])), float(near), float(ratio)


def print_habits(seeds: range) -> None:
    """The rows about single people and groups."""
    speed = free_speeds(range(seeds.start, seeds.start + max(1, len(seeds) // 4)))
    print(f"walking alone: {speed.mean():.2f} ± {speed.std():.2f} m/s ({len(speed)} people)")
    walks = {n: alone(n, seeds) for n in range(1, 7)}
    means = [walks[n].speed.mean() for n in walks]
    print("speed of groups of 1 to 6: " + ", ".join(f"{m:.2f}" for m in means) + " m/s")
    print(f"    each member slows a group by {-np.polyfit(list(walks), means, 1)[0]:.3f} m/s")
    for n in range(2, 7):
        print(f"nearest neighbour in groups of {n}: {np.quantile(neighbours(walks[n]), (0.1, 0.5, 0.9)).round(2)} m")
    print(f"pairs: {np.quantile(abreast(walks[2]), (0.1, 0.5)).round(0)} degrees (10 %, median); 90 is abreast")
    behind = middle_behind(walks[3])
    print(f"triads: middle {np.median(behind):.2f} m behind (median), in {np.mean(behind > 0):.0%} behind")
    print(f"rows of groups of 4, 5, 6: {', '.join(f'{rows(walks[n]).mean():.2f}' for n in (4, 5, 6))} (mean)")
    for n in (2, 3, 4):
        print(f"strangers who pass through a group of {n}: {through(n, seeds).mean():.0%} of {len(seeds)}")


def print_beside(folder: str, scenarios: list[str], seeds: range) -> None:
    """The rows of the recording and of each scenario."""
    real = recording(folder)
    for name in ("seq_hotel", *scenarios):
        mine = real if name == "seq_hotel" else simulated(name, seeds)
        w, near, ratio = beside(mine, real)
        print(f"{name}: speed {np.quantile(mine[0], QUANTILES).round(2)}, ", end="")
        if len(mine[1]):
            print(f"closest {np.quantile(mine[1], QUANTILES).round(2)}, ", end="")
        print(f"W {w:.2f} m/s, {near:.2f} m, acceleration x {ratio:.2f}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording", nargs="?", help="a BIWI folder to compare with")
    parser.add_argument("--scenarios", nargs="*", default=names())
    parser.add_argument("--seeds", default="0:40")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    print_habits(range(first, last))
    if arguments.recording is not None:
        print_beside(arguments.recording, arguments.scenarios, range(first, last))


if __name__ == "__main__":
    main()
