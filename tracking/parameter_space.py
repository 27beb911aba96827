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
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike

from scenarios.errors import InputError
from sim.types import Array, DetectionMode
from tracking.config import Config, Param, Value

T = TypeVar("T")
Space = tuple[Param, ...]
HALVINGS = 6  # Bisections on the line from an allowed config to one that is not.


def space_of(kind: type[Config], mode: DetectionMode | None = None, *, online: bool = False) -> Space:
    """Returns the tunable parameters of a config class that have an effect in this detection mode.

    "image" and "both" leave out parameters with an effect on points only, "file" and "truth" those on pixels only, None
    nothing.
    online: True leaves out parameters that may not change between two frames.
    """
    without_effect = {"image": "points", "both": "points", None: None}.get(mode, "pixels")
    return tuple(p for p in kind.space(online=online) if p.sees == "" or p.sees != without_effect)


def encode(space: Space, config: Config) -> Array:
    """Returns the vector (P,) in [-1, 1] of the config's values of the P parameters in `space`, in their order."""
    return np.array([_to_unit(p, getattr(config, p.name)) for p in space])


def moved(space: Space, residual: ArrayLike, base: Config) -> Array:
    """Returns the vector (P,) at `residual` (P,), clipped to [-1, 1]: 0 is the config `base`, -1 and 1 are the ends of
    the ranges, and between them each number is linear."""
    point, origin = _point(residual, len(space)), np.clip(encode(space, base), -1.0, 1.0)
    return np.asarray(np.where(point < 0, origin + point * (1.0 + origin), origin + point * (1.0 - origin)))


def decode(space: Space, action: ArrayLike, base: Config) -> Config:
    """Returns the config at the vector `action` (P,), clipped to [-1, 1]; parameters not in `space` are as in `base`.
    If its values contradict each other, an allowed config between it and `base` is returned."""
    return decode_and_build(space, action, base, lambda config: config)


def decode_and_build(space: Space, action: ArrayLike, base: Config, build: Callable[[Config], T]) -> T:
    """Returns build(config) for the config at the vector `action` (P,), which is clipped to [-1, 1].

    If that config's values contradict each other, or `build` raises InputError, the config is moved towards `base` as
    far as needed (found by 6 bisections).
    """
    point, origin = _point(action, len(space)), encode(space, base)

    def attempt(point: Array) -> T | None:
        # a place that is that of `base` stands for its very value, not for one that differs in the last bit
        triples = zip(space, point.tolist(), origin.tolist(), strict=True)
        values = {p.name: _from_unit(p, a) for p, a, b in triples if a != b}
        try:
            return build(dataclasses.replace(base, **values))
        except InputError:
            return None

    best = attempt(point)
    if best is not None:
        return best
    near, far = 0.0, 1.0
    for _ in range(HALVINGS):
        share = (near + far) / 2
        found = attempt(origin + share * (point - origin))
        near, far, best = (near, share, best) if found is None else (share, far, found)
    return build(base) if best is None else best


def _point(action: ArrayLike, size: int) -> Array:
    point = np.asarray(action)
    if point.dtype.kind not in "biuf" or point.shape != (size,) or not np.isfinite(point).all():
        got, remedy = f"shape {point.shape}: {action!r}", "give one number in [-1, 1] for each parameter of the space"
        raise InputError(place="action", got=got[:80], expected=f"({size},) finite numbers", remedy=remedy)
    return np.asarray(np.clip(point.astype(float), -1.0, 1.0))


def _to_unit(p: Param, value: Value) -> float:
    choices = _choices(p)
    if p.scale == "int" and isinstance(value, int | float):
        value = min(max(int(value), math.ceil(p.low)), math.floor(p.high))
    if choices:
        return (2 * choices.index(value) + 1) / len(choices) - 1
    assert isinstance(value, int | float)
    if p.scale == "log":
        return 2 * math.log(value / p.low) / math.log(p.high / p.low) - 1
    return 2 * (value - p.low) / (p.high - p.low) - 1


def _from_unit(p: Param, a: float) -> Value:
    share, choices = (a + 1) / 2, _choices(p)
    if choices:
        return choices[min(int(share * len(choices)), len(choices) - 1)]
    value = p.low * (p.high / p.low) ** share if p.scale == "log" else p.low + share * (p.high - p.low)
    return min(max(value, p.low), p.high)


def _choices(p: Param) -> Sequence[Value]:
    return range(math.ceil(p.low), math.floor(p.high) + 1) if p.scale == "int" else p.choices
