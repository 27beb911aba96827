"""Simulated motion beside seq_hotel's, both sampled at 2.5 fps with velocities by central differences.

    PYTHONPATH=. python benchmarks/realism.py ../shared/data/biwi/seq_hotel --seeds 0:20 [--scenarios crowd …]

Speeds are those of people who walk (> 0.3 m/s); closest approach is the least distance of two strangers who come
within 3 m; acceleration is the 99 % quantile. Aims: Wasserstein distances <= 0.15 m/s and 0.15 m, acceleration
within 25 %.
"""

from __future__ import annotations

import argparse

import numpy as np
from scipy.stats import wasserstein_distance

from scenarios.loading import load, names
from sim.io.source import open_source
from sim.types import Array, Ints
from sim.world import run

STEP = 0.4  # s
WALKING = 0.3  # m/s
MEETING = 3.0  # m


def statistics(pos: Array, label: Ints) -> tuple[Array, Array, Array]:
    """Speeds of walkers, closest approaches of strangers, accelerations; pos (T, P, 2) at 2.5 fps, label (T, P)."""
    vel = (pos[2:] - pos[:-2]) / (2 * STEP)
    speed = np.linalg.norm(vel, axis=2).ravel()
    acceleration = np.linalg.norm(np.diff(vel, axis=0) / STEP, axis=2).ravel()
    least = np.full((pos.shape[1],) * 2, np.inf)
    for here, group in zip(pos, label, strict=True):
        rows = np.flatnonzero(np.isfinite(here[:, 0]))
        d = np.linalg.norm(here[rows, None] - here[None, rows], axis=2)
        d[(group[rows, None] == group[None, rows]) & (group[rows, None] >= 0)] = np.inf
        least[np.ix_(rows, rows)] = np.minimum(least[np.ix_(rows, rows)], d)
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recording")
    parser.add_argument("--scenarios", nargs="*", default=names())
    parser.add_argument("--seeds", default="0:20")
    arguments = parser.parse_args()
    first, last = map(int, arguments.seeds.split(":"))
    real = recording(arguments.recording)
    quantiles = (0.05, 0.25, 0.5, 0.75, 0.95)
    for name in ("seq_hotel", *arguments.scenarios):
        mine = real if name == "seq_hotel" else simulated(name, range(first, last))
        text = [f"speed {np.quantile(mine[0], quantiles).round(2)}"]
        if len(mine[1]):
            far = wasserstein_distance(mine[0], real[0]), wasserstein_distance(mine[1], real[1])
            text.append(f"closest {np.quantile(mine[1], quantiles).round(2)}, W {far[0]:.2f} m/s, {far[1]:.2f} m")
        high, theirs = np.quantile(mine[2], 0.99), np.quantile(real[2], 0.99)
        text.append(f"acceleration 99 % {high:.2f} (x {high / theirs:.2f})")
        print(f"{name}: " + ", ".join(text), flush=True)


if __name__ == "__main__":
    main()
