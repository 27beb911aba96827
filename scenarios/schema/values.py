"""The kinds of values in a scenario file: numbers, names, points, distributions; and the base class of its tables.

A value is a number, such as `1.2`, or a distribution: `{ normal = [1.34, 0.26], clip = [0.5, 2.2] }` (mean, standard
deviation), `{ uniform = [0, 5] }` (bounds), `{ exponential = 3.0 }` (mean), `{ poisson = 1.1, clip = [1, 6] }` (mean)
or `{ choice = [-1, 1] }` (each entry with equal probability). `clip` draws again until the value lies between its
bounds, both included. `sim.rng.draw` draws.
"""

from __future__ import annotations

import math
import re
from inspect import cleandoc
from statistics import NormalDist
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from scenarios.limits import PICTURE_SIDE

LEAST_SHARE = 0.01
"""Least probability that a draw lies within the clip of its distribution."""
LARGEST_MEAN = 1000.0
"""Largest mean of a Poisson distribution."""

Positive = Annotated[float, Field(gt=0)]
NonNegative = Annotated[float, Field(ge=0)]
Share = Annotated[float, Field(ge=0, le=1)]
Side = Annotated[int, Field(ge=16, le=PICTURE_SIDE)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*$")]
Pattern = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_.-]*\*?$")]
FixedPoint = tuple[float, float]


class Model(BaseModel):
    """Base class of all tables of scenario files. It is frozen and refuses unknown keys, infinite numbers and nan."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, populate_by_name=True)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, table: Any) -> Any:
        known = {name: f.alias or name for name, f in cls.model_fields.items()}
        for key in table if isinstance(table, dict) else ():
            if key not in known and key not in known.values():
                shown = key.encode("utf-8", "backslashreplace").decode()  # pydantic refuses lone surrogates
                raise PydanticCustomError("unknown_key", "unknown", {"key": shown, "known": list(known.values())})
        return table

    @classmethod
    def __get_pydantic_json_schema__(cls, core: Any, handler: Any) -> dict[str, Any]:
        """Returns the JSON schema, with the meanings of the keys from the section Attributes of the docstring."""
        reference: dict[str, Any] = handler(core)
        schema = handler.resolve_ref_schema(reference)
        for kind in (kind for kind in reversed(cls.__mro__) if issubclass(kind, Model)):
            meanings = cleandoc(kind.__doc__ or "").partition("Attributes:")[2]  # Python 3.13 has no indents there
            for name, words in re.findall(r"^ {4}(\w+): (.*?)(?=^ {0,4}\S|\Z)", meanings, re.DOTALL | re.MULTILINE):
                key = cls.model_fields[name].alias or name
                schema["properties"][key]["description"] = " ".join(words.split())
        return reference


class Distribution(Model):
    """A distribution of a number, of one of five kinds: exactly one of the keys other than `clip` is given."""

    normal: tuple[float, Annotated[float, Field(ge=0)]] | None = None
    uniform: tuple[float, float] | None = None
    exponential: Annotated[float, Field(gt=0)] | None = None
    poisson: Annotated[float, Field(gt=0, le=LARGEST_MEAN)] | None = None
    choice: Annotated[tuple[float, ...], Field(min_length=1)] | None = None
    clip: tuple[float, float] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        kinds = [name for name in ("normal", "uniform", "exponential", "poisson", "choice") if getattr(self, name)]
        if len(kinds) != 1:
            raise problem(str(kinds), "exactly one of normal, uniform, exponential, poisson, choice", "keep one")
        if self.clip is not None and self.clip[0] > self.clip[1]:
            raise ValueError("clip = [low, high] with low <= high")
        if self.uniform is not None and self.uniform[0] > self.uniform[1]:
            raise ValueError("uniform = [low, high] with low <= high")
        if self.clip is not None and self._share(*self.clip) < LEAST_SHARE:
            raise ValueError(f"a clip that keeps at least {LEAST_SHARE:.0%} of the draws")
        return self

    def _share(self, low: float, high: float) -> float:
        """Returns the probability that one draw, ignoring `clip`, lies between low and high, both included."""
        if low > high:
            return 0.0
        if self.choice is not None:
            return sum(low <= v <= high for v in self.choice) / len(self.choice)
        if self.poisson is not None:
            mean, most = self.poisson, 20 * self.poisson + 100  # more has no probability that a float holds
            counts = range(math.ceil(max(low, 0.0)), math.floor(min(high, most)) + 1)
            return math.fsum(math.exp(k * math.log(mean) - mean - math.lgamma(k + 1)) for k in counts)
        if self.exponential is not None:
            return math.exp(-max(low, 0.0) / self.exponential) - math.exp(-max(high, 0.0) / self.exponential)
        if self.normal is not None:
            mean, sd = self.normal
            normal = NormalDist(mean, sd or 1.0)
            return normal.cdf(high) - normal.cdf(low) if sd else float(low <= mean <= high)
        assert self.uniform is not None
        a, b = self.uniform
        return float(low <= a <= high) if a == b else max(min(b, high) - max(a, low), 0.0) / (b - a)

    def share_within(self, low: float, high: float) -> float:
        """Returns the probability that a draw, which always lies within `clip`, is from low to high."""
        a, b = (-math.inf, math.inf) if self.clip is None else self.clip
        return self._share(max(a, low), min(b, high)) / self._share(a, b)


def _kind(value: Any) -> str | None:
    if isinstance(value, dict | Distribution):
        return "distribution"
    return "number" if isinstance(value, int | float) and not isinstance(value, bool) else None


# Discriminators, so that pydantic reports the errors of one kind of value alone.
EXPECTED = "a number, or a distribution such as { normal = [1.3, 0.2] }"
Value = Annotated[
    Annotated[float, Tag("number")] | Annotated[Distribution, Tag("distribution")],
    Discriminator(_kind, custom_error_type="no_value", custom_error_message=EXPECTED),
]
Point = tuple[Value, Value]


def problem(got: str, expected: str, remedy: str = "correct it") -> PydanticCustomError:
    """Returns the error for a pydantic validator to raise; it becomes an InputError with these words."""
    return PydanticCustomError("problem", "problem", {"got": got, "expected": expected, "remedy": remedy})


SURE = 0.999  # least probability that a value lies in its range


def within(low: float, high: float, unit: str = "") -> AfterValidator:
    """Returns a validator that refuses a number outside `low` to `high`, or a distribution with over 0.1 % there."""

    def check(value: Value) -> Value:
        drawn, share = isinstance(value, Distribution), share_within(value, low, high)
        if share < SURE:
            got = f"a distribution with {share:.1%} of its draws in this range" if drawn else f"{value:g}{unit}"
            remedy = f"correct it, or add clip = [{low:g}, {high:g}]" if drawn else "correct it"
            raise problem(got, f"from {low:g} to {high:g}{unit}", remedy)
        return value

    return AfterValidator(check)


def share_within(value: Value, low: float, high: float) -> float:
    """Returns the probability that a value is from low to high, both included; 0.0 or 1.0 for a number."""
    return value.share_within(low, high) if isinstance(value, Distribution) else float(low <= value <= high)


def bounds(value: Value) -> tuple[float, float]:
    """Returns the least and greatest number that a value can take, limited by `clip`; -inf or inf if unbounded."""
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
    """Returns the point if both coordinates are numbers, None if one is a distribution."""
    x, y = point
    return None if isinstance(x, Distribution) or isinstance(y, Distribution) else (float(x), float(y))
