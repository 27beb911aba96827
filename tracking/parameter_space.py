"""A tracker's parameters as a vector in [-1, 1]^P, for a search or an action, and back: `encode` and `decode`.

With a parameter's coordinate a, its range low … high and its value v:

    linear       v = low + (a + 1)/2 (high - low)
    log          v = low (high / low)^((a + 1)/2)
    int          the whole numbers low … high divide [-1, 1] into equal parts; v is encoded as the middle of its part
    categorical  the same with the choices in their order

The environment's actions (tracking.environment.env) and the tuning samplers are such vectors.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from scenarios.errors import InputError
from sim.types import Array, DetectionMode
from tracking.config import Config, Param, Value

T = TypeVar("T")
Space = tuple[Param, ...]
HALVINGS = 6
"""Bisections on the line from an allowed config to one that is not."""


def space_of(kind: type[Config], mode: DetectionMode | None = None, *, online: bool = False) -> Space:
    """Return the tunable parameters of a config class that have an effect in this detection mode, in order of the
    fields.

    Mode "image" leaves out parameters for points, "file" and "truth" those for pixels, None leaves out none. online:
    only parameters that may change between two frames.
    """
    without_effect = {"image": "points", None: None}.get(mode, "pixels")
    return tuple(p for p in kind.space(online=online) if p.sees == "" or p.sees != without_effect)


def encode(space: Space, config: Config) -> Array:
    """Return the vector (P,) in [-1, 1] of the config's values of the P parameters in `space`, in their order.

    low is -1 and high 1; whole numbers and choices have the middle of their part of [-1, 1]. An empty space gives (0,).
    """
    return np.array([_to_unit(p, getattr(config, p.name)) for p in space])


def decode(
    space: Space, action: ArrayLike, base: Config, allowed: Callable[[Config], object] = lambda config: None
) -> Config:
    """Return the config at the vector `action` (P,), which is clipped to [-1, 1]; other parameters are those of `base`.

    space: the P parameters, in the vector's order. allowed: a function of a config that raises InputError to refuse it.
    A config is not allowed if its own `check` or `allowed` raises InputError. If the action's config is not allowed,
    six bisections look for an allowed one on the line from `base`, which must be allowed, to the action. The farthest
    one found is returned; `base` itself if none is.

    Raises InputError if the action has another shape or is not finite.
    """
    point = _point(action, len(space))
    found = _attempt(space, point, base, allowed)
    if found is not None:
        return found
    origin, near, far, best = encode(space, base), 0.0, 1.0, base
    for _ in range(HALVINGS):
        share = (near + far) / 2
        found = _attempt(space, origin + share * (point - origin), base, allowed)
        near, far, best = (near, share, best) if found is None else (share, far, found)
    return best


def decode_and_build(space: Space, action: ArrayLike, base: Config, build: Callable[[Config], T]) -> tuple[Config, T]:
    """Return the config at the vector `action` (P,), clipped to [-1, 1], and the result of `build` for it.

    space: the P parameters, in the vector's order; other parameters are those of `base`. A config for which its own
    check or `build` raises InputError is not allowed. Then the farthest allowed one that six bisections find on the
    line from `base` to the action is taken, so that `build` may be called several times. Raises InputError if the
    action has another shape or is not finite, or if only `base` is left and `build` refuses it.
    """
    made: dict[Config, T] = {}

    def attempt(config: Config) -> None:
        made[config] = build(config)

    config = decode(space, action, base, attempt)
    if config not in made:
        attempt(config)
    return config, made[config]


def _attempt(space: Space, point: Array, base: Config, allowed: Callable[[Config], object]) -> Config | None:
    """Returns the config at a vector (P,) in [-1, 1], with other parameters as in `base`, or None if it is not allowed.

    It is not allowed if its own check or `allowed` raises InputError.
    """
    values = {p.name: _from_unit(p, float(a)) for p, a in zip(space, point, strict=True)}
    try:
        config = dataclasses.replace(base, **values)
        allowed(config)
    except InputError:
        return None
    return config


def _point(action: ArrayLike, size: int) -> Array:
    """Returns the action as a vector (size,), clipped to [-1, 1].

    Raises InputError if it is no array of numbers, has another shape or is not finite.
    """
    try:
        point = np.asarray(action)
    except ValueError:  # rows of different lengths
        point = np.asarray(None)
    if point.dtype.kind not in "biuf":
        got = repr(action)[:80]
    elif point.shape != (size,) or not np.isfinite(point).all():
        got = f"shape {point.shape}" if point.shape != (size,) else "NaN or infinity"
    else:
        return np.asarray(np.clip(point.astype(float), -1.0, 1.0))
    remedy = "give one number in [-1, 1] for each parameter of the space"
    raise InputError(place="action", got=got, expected=f"({size},) finite numbers", remedy=remedy)


def _to_unit(p: Param, value: Value) -> float:
    """Returns the coordinate in [-1, 1] of a parameter's value: low is -1 and high 1, on a linear or logarithmic scale.

    A whole number or choice has the middle of its part, where all have equal parts. Raises ValueError for a value that
    is no choice.
    """
    if p.scale == "categorical":
        return _middle(p.choices.index(value), len(p.choices))
    assert isinstance(value, int | float)
    if p.scale == "int":
        first, count = _whole(p)
        return _middle(int(value) - first, count)
    if p.scale == "log":
        return 2 * math.log(value / p.low) / math.log(p.high / p.low) - 1
    return 2 * (value - p.low) / (p.high - p.low) - 1


def _from_unit(p: Param, a: float) -> Value:
    """Returns the value of a parameter at a coordinate a in [-1, 1]: -1 is low and 1 high, on a linear or logarithmic
    scale.

    Whole numbers and choices divide [-1, 1] into equal parts. Other numbers are limited to the parameter's range.
    """
    share = (a + 1) / 2
    if p.scale == "categorical":
        return p.choices[_part(share, len(p.choices))]
    if p.scale == "int":
        first, count = _whole(p)
        return first + _part(share, count)
    value = p.low * (p.high / p.low) ** share if p.scale == "log" else p.low + share * (p.high - p.low)
    return min(max(value, p.low), p.high)


def _whole(p: Param) -> tuple[int, int]:
    """Returns the first whole number of a parameter's range, and how many whole numbers the range holds."""
    first = math.ceil(p.low)
    return first, math.floor(p.high) - first + 1


def _middle(k: int, count: int) -> float:
    """Returns the middle of part k (from 0) of the range [-1, 1] divided into `count` equal parts."""
    return (2 * k + 1) / count - 1


def _part(share: float, count: int) -> int:
    """Returns the index, from 0, of the part that contains `share`, if [0, 1] is divided into `count` equal parts; 1 is
    in the last part."""
    return min(int(share * count), count - 1)
