"""Keyed random streams: each combination of seed, role and keys (such as a person's number) has a generator of its own.

An additional draw from one stream therefore changes no other stream. What is drawn for motion, truth and detections
goes through the functions below: numpy's own normal, exponential and Poisson draws call the C library, whose last bits
depend on the processor.
"""

from __future__ import annotations

import zlib
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.elementary import log, normal_quantile
from sim.types import Array, Ints

if TYPE_CHECKING:
    from scenarios.schema.values import Distribution, Value

# Every stored hash depends on their numbers: add at the end, never change one.
ROLES = (
    "layout", "group", "person", "event", "service", "gait", "detect", "clutter", "texture", "light", "noise",
    "tracker", "camera", "wind", "label", "delivery", "draw", "looks",
)  # fmt: skip
ROLE = {name: number for number, name in enumerate(ROLES)}
BELOW_1 = 1.0 - 2.0**-53


def rng(seed: int, role: str, *keys: int, repeat: int = 0) -> np.random.Generator:
    """Returns a new generator over `SeedSequence(seed, spawn_key=(ROLE[role], *keys))`.

    The same arguments give a generator of the same numbers. repeat: number of the suite entry's copy, which is a
    further key; 0 without copies, which adds no key.
    """
    spawn_key = (ROLE[role], *keys) if repeat == 0 else (ROLE[role], *keys, 1_000_000 + repeat)
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=spawn_key))


def look_seed(seed: int, scenario: str) -> int:
    """Returns the seed of all that is drawn for pictures alone; it differs between scenarios of one seed.

    scenario: the scenario's name, as it is stored, so that a stored sequence is drawn again with its own looks.
    """
    return (seed << 32) + zlib.crc32(scenario.encode())


def uniforms(r: np.random.Generator, shape: int | tuple[int, ...]) -> Array:
    """Returns uniform random numbers of this shape, each above 0 and at most 1."""
    return np.asarray(r.random(shape) + 2.0**-54)


def normals(u: Array) -> Array:
    """Returns the standard normal quantiles at u, of any shape, 0 < u <= 1. At u = 1 the result is finite, too."""
    return np.asarray(normal_quantile(np.minimum(u, BELOW_1)))


def autoregression(e: Array, keep: Any) -> Array:
    """Returns x (K, D) with x_0 = e_0 and x_k = keep x_(k-1) + sqrt(1 - keep²) e_k.

    e (K, D): one row per time. keep: the correlation of neighbouring rows, one number or (D,).
    """
    x = e.copy()
    x[1:] *= np.sqrt(1.0 - keep * keep)
    step = 1
    # In steps of 1, 2, 4, … rows; a row does not depend on later ones.
    while step < len(x):
        x[step:] = x[step:] + keep * x[:-step]
        keep, step = keep * keep, 2 * step
    return x


def poisson_quantiles(mean: float, u: Array) -> Ints:
    """Returns the quantiles (N,) of the Poisson distribution with this mean (0 or more) at u (N,), 0 < u <= 1."""
    if not mean >= 0:
        raise ValueError(f"a Poisson distribution of mean {mean}")
    k = np.arange(1, int(mean + 12 * np.sqrt(mean) + 20))
    mode = int(mean)  # probabilities relative to that of the mode, so that none of the large ones underflows
    up = np.cumprod(mean / k[mode:])
    down = np.cumprod(k[:mode][::-1] / mean)[::-1] if mode else up[:0]
    share = np.cumsum(np.concatenate([down, [1.0], up]))
    return np.searchsorted(share / share[-1], u).astype(np.int64)


def poisson_counts(mean: Array, u: Array) -> Ints:
    """Returns the quantiles (N,) of Poisson distributions with means (N,) at u (N,), 0 < u <= 1."""
    found = np.zeros(len(u), np.int64)
    for one in np.unique(mean).tolist():
        here = mean == one
        found[here] = poisson_quantiles(one, u[here])
    return found


def draw(value: Value, r: np.random.Generator) -> float:
    """Returns `value` as a float if it is a number, else one random draw of the distribution.

    A draw outside the distribution's `clip` is drawn again.
    """
    if isinstance(value, (int, float)):
        return float(value)
    while True:
        drawn = _draw_once(value, r)
        if value.clip is None or value.clip[0] <= drawn <= value.clip[1]:
            return drawn


def _draw_once(value: Distribution, r: np.random.Generator) -> float:
    if value.choice is not None:
        return value.choice[int(r.integers(len(value.choice)))]
    u = r.random() + 2.0**-54
    if value.normal is not None:
        mean, sd = value.normal
        return float(mean + sd * normal_quantile(min(u, BELOW_1)))
    if value.uniform is not None:
        low, high = value.uniform
        return low + (high - low) * u
    if value.exponential is not None:
        return float(-value.exponential * log(u))
    assert value.poisson is not None
    return float(poisson_quantiles(value.poisson, np.array([u]))[0])
