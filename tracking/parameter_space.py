"""Configs as points of a cube: each parameter of a search space in [-1, 1], log, whole and categorical ones too.

    linear       v = low + (a + 1)/2 (high - low)
    log          v = low (high / low)^((a + 1)/2)
    int          low … high share [-1, 1] in equal parts; a whole number's own point is the middle of its part
    categorical  the same with the choices in their order

Agents and samplers that know nothing of units move in this cube; `tracking.environment.env` acts through it.
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
"""How often the way back to an allowed config is halved."""


def space_of(kind: type[Config], mode: DetectionMode | None = None, *, online: bool = False) -> Space:
    """The parameters of a config to search where a tracker is given pictures ("image") or detections (others): without
    those that say nothing of these. online: those only that may change between frames."""
    blind = {"image": "points", None: None}.get(mode, "pixels")
    return tuple(p for p in kind.space(online=online) if p.sees == "" or p.sees != blind)


def encode(space: Space, config: Config) -> Array:
    """The point (P,) in [-1, 1] that stands for the config's values of these parameters."""
    return np.array([_inward(p, getattr(config, p.name)) for p in space])


def decode(
    space: Space, action: ArrayLike, base: Config, allowed: Callable[[Config], object] = lambda config: None
) -> Config:
    """The config at a point (P,), clipped to [-1, 1]; what is not in the space stays as in `base`.

    Some points are no config: its own `check`, or `allowed`, raises InputError. They are drawn back on the straight
    line to the point of `base`, which must be one, to the farthest of 2^-6 steps found by bisection that is allowed.
    InputError where the action has another shape, or is not finite.
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


def begun(space: Space, action: ArrayLike, base: Config, begin: Callable[[Config], T]) -> tuple[Config, T]:
    """The config at a point (P,), drawn back where `begin` refuses it too, and what `begin` made of it."""
    made: dict[Config, T] = {}

    def attempt(config: Config) -> None:
        made[config] = begin(config)

    config = decode(space, action, base, attempt)
    if config not in made:
        attempt(config)
    return config, made[config]


def _attempt(space: Space, point: Array, base: Config, allowed: Callable[[Config], object]) -> Config | None:
    """The config at a point, or None where there is none."""
    values = {p.name: _outward(p, float(a)) for p, a in zip(space, point, strict=True)}
    try:
        config = dataclasses.replace(base, **values)
        allowed(config)
    except InputError:
        return None
    return config


def _point(action: ArrayLike, size: int) -> Array:
    point = np.asarray(action, float)
    if point.shape != (size,) or not np.isfinite(point).all():
        got = f"shape {point.shape}" if point.shape != (size,) else "NaN or infinity"
        remedy = "give one number in [-1, 1] for each parameter of the space"
        raise InputError(place="action", got=got, expected=f"({size},) finite numbers", remedy=remedy)
    return np.asarray(np.clip(point, -1.0, 1.0))


def _inward(p: Param, value: Value) -> float:
    if p.scale == "categorical":
        return _middle(p.choices.index(value), len(p.choices))
    assert isinstance(value, int | float)
    if p.scale == "int":
        first, count = _whole(p)
        return _middle(int(value) - first, count)
    if p.scale == "log":
        return 2 * math.log(value / p.low) / math.log(p.high / p.low) - 1
    return 2 * (value - p.low) / (p.high - p.low) - 1


def _outward(p: Param, a: float) -> Value:
    share = (a + 1) / 2
    if p.scale == "categorical":
        return p.choices[_part(share, len(p.choices))]
    if p.scale == "int":
        first, count = _whole(p)
        return first + _part(share, count)
    value = p.low * (p.high / p.low) ** share if p.scale == "log" else p.low + share * (p.high - p.low)
    return min(max(value, p.low), p.high)


def _whole(p: Param) -> tuple[int, int]:
    """The first whole number of a range, and how many there are."""
    first = math.ceil(p.low)
    return first, math.floor(p.high) - first + 1


def _middle(k: int, count: int) -> float:
    """The middle of part k of [-1, 1] in `count` equal parts."""
    return (2 * k + 1) / count - 1


def _part(share: float, count: int) -> int:
    return min(int(share * count), count - 1)
