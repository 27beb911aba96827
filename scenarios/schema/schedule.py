"""A value of a scenario that may change while it is recorded: a number, or a schedule of numbers.

`{ at = [0, 20, 40], value = [0.95, 0.6, 0.9], ramp = 5 }`: 0.95 at first; from 20 s on it falls to 0.6 within 5 s.
`sim.schedules.values_at` computes it. Times and values may be drawn, as all fixed values.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from scenarios.limits import DETECTIONS
from scenarios.schema.values import Distribution, Model, NonNegative, problem, within


class Schedule(Model):
    """A value that changes at given times.

    Attributes:
        at: times from which the values hold, s after the first frame; the first is 0
        value: as many values
        ramp: time that each change takes, s; 0 = at once
    """

    at: Annotated[tuple[NonNegative, ...], Field(min_length=2)]
    value: tuple[float, ...]
    ramp: NonNegative = 0.0

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if len(self.value) != len(self.at):
            raise problem(f"{len(self.at)} times and {len(self.value)} values", "as many values as times")
        if self.at[0] or any(b <= a for a, b in pairwise(self.at)):
            raise problem(str(list(self.at)), "times that ascend from 0")
        if any(b - a < self.ramp for a, b in pairwise(self.at[1:])):
            raise problem(f"ramp = {self.ramp:g}", "no longer than the time between two changes", "make it shorter")
        return self


def _kind(value: Any) -> str:
    """Returns "schedule" also for a table whose keys are misspelt, so that the message names them."""
    table = isinstance(value, dict) and bool(value) and not value.keys() & {*Distribution.model_fields, "link"}
    return "schedule" if table or isinstance(value, Schedule) else "number"


def each_within(low: float, high: float, unit: str = "") -> AfterValidator:
    """Returns a validator that refuses a number outside `low` to `high`, or a schedule with one."""
    number = within(low, high, unit).func

    def check(value: float | Schedule) -> float | Schedule:
        for one in value.value if isinstance(value, Schedule) else (value,):
            number(one)  # type: ignore[call-arg]
        return value

    return AfterValidator(check)


Changing = Annotated[
    Annotated[float, Tag("number")] | Annotated[Schedule, Tag("schedule")],
    Discriminator(_kind),
]
Shares = Annotated[Changing, each_within(0.0, 1.0)]
Alarms = Annotated[Changing, each_within(0.0, DETECTIONS / 5, " false alarms per frame")]
Distances = Annotated[Changing, each_within(0.0, 1000.0, " m")]
Factors = Annotated[Changing, each_within(0.0, 20.0)]
FrameSteps = Annotated[Changing, each_within(1.0, 1000.0, " frames")]
Movements = Annotated[Changing, each_within(0.0, 500.0, " px")]
