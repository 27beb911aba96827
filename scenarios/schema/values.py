"""The kinds of values in a scenario file: numbers, names, points, distributions; and the base class of its tables.

A value is a number, such as `1.2`, or a distribution: `{ normal = [1.34, 0.26], clip = [0.5, 2.2] }` (mean, standard
deviation), `{ uniform = [0, 5] }` (bounds), `{ exponential = 3.0 }` (mean), `{ poisson = 1.1, clip = [1, 6] }` (mean)
or `{ choice = [-1, 1] }` (each entry with equal probability). `clip` draws again until the value lies between its
bounds, both included.
"""

from __future__ import annotations

import math
from typing import Annotated, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

MAX_REDRAWS = 10_000

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")]
Pattern = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*\*?$")]
FixedPoint = tuple[float, float]


class Model(BaseModel):
    """Base class of all tables of scenario files: frozen.

    Unknown keys, infinite numbers and nan raise pydantic.ValidationError.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)


class Distribution(BaseModel):
    """One of five distributions of a number: exactly one of the keys besides `clip` is given, the rest is None.

    - normal: mean, standard deviation (0 or more). uniform: least, greatest. exponential, poisson: mean, above 0.
    - choice: values of equal probability. clip: least and greatest value kept, both included; draws outside are drawn
      again; None: all are kept.

    Any other combination, a lower bound above its upper bound, values out of range, or unknown keys raise
    pydantic.ValidationError. `draw` raises ValueError if no draw falls into `clip`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    normal: tuple[float, Annotated[float, Field(ge=0)]] | None = None
    uniform: tuple[float, float] | None = None
    exponential: Annotated[float, Field(gt=0)] | None = None
    poisson: Annotated[float, Field(gt=0)] | None = None
    choice: Annotated[tuple[float, ...], Field(min_length=1)] | None = None
    clip: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        """Returns the model; raises ValueError unless exactly one of normal, uniform, exponential, poisson and choice
        is given, and the bounds of uniform and clip are in order (equal bounds are allowed).
        """
        kinds = [name for name in ("normal", "uniform", "exponential", "poisson", "choice") if getattr(self, name)]
        if len(kinds) != 1:
            raise ValueError(
                f"a distribution has exactly one of normal, uniform, exponential, poisson, choice, not {kinds}"
            )
        if self.clip is not None and self.clip[0] > self.clip[1]:
            raise ValueError("clip = [low, high] with low <= high")
        if self.uniform is not None and self.uniform[0] > self.uniform[1]:
            raise ValueError("uniform = [low, high] with low <= high")
        return self

    def _draw(self, rng: np.random.Generator) -> float:
        """Returns one draw from rng, ignoring `clip`; poisson gives a whole number as float."""
        if self.normal is not None:
            return float(rng.normal(*self.normal))
        if self.uniform is not None:
            return float(rng.uniform(*self.uniform))
        if self.exponential is not None:
            return float(rng.exponential(self.exponential))
        if self.poisson is not None:
            return float(rng.poisson(self.poisson))
        assert self.choice is not None
        return self.choice[int(rng.integers(len(self.choice)))]

    def draw(self, rng: np.random.Generator) -> float:
        """Returns one value from rng within `clip`, bounds included; draws outside are drawn again.

        Raises ValueError if none of MAX_REDRAWS (10,000) draws lies within `clip`.
        """
        for _ in range(MAX_REDRAWS):
            value = self._draw(rng)
            if self.clip is None or self.clip[0] <= value <= self.clip[1]:
                return value
        raise ValueError(f"no draw in clip {list(self.clip or ())} after {MAX_REDRAWS} tries")


Value = float | Distribution
Point = tuple[Value, Value]


def draw(value: Value, rng: np.random.Generator) -> float:
    """Returns the number itself as float, or one draw of the distribution from rng.

    Raises ValueError if none of 10,000 draws lies within the distribution's clip.
    """
    return value.draw(rng) if isinstance(value, Distribution) else float(value)


def bounds(value: Value) -> tuple[float, float]:
    """Returns the least and greatest number that a value can take, `clip` included; -inf or inf where there is no
    bound.

    A number gives itself twice. Without clip, normal gives -inf and inf, exponential and poisson 0 and inf, choice its
    least and greatest entry. If no draw can lie within the clip, the first may be above the second.
    """
    if not isinstance(value, Distribution):
        return float(value), float(value)
    if value.uniform is not None:
        low, high = value.uniform
    elif value.choice is not None:
        low, high = min(value.choice), max(value.choice)
    else:
        low, high = (-math.inf if value.normal is not None else 0.0), math.inf
    return (low, high) if value.clip is None else (max(low, value.clip[0]), min(high, value.clip[1]))


def fixed(point: Point) -> tuple[float, float] | None:
    """Returns the point (x, y) if both coordinates are numbers, None if one is a distribution."""
    x, y = point
    return None if isinstance(x, Distribution) or isinstance(y, Distribution) else (float(x), float(y))
