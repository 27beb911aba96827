"""A value of a scenario that may change while it is recorded: a number, or a schedule of numbers.

`{ at = [0, 20, 40], value = [0.95, 0.6, 0.9], ramp = 5 }`: 0.95 at first; from 20 s on it falls to 0.6 within 5 s.
`sim.schedules.values_at` computes it. Times and values may be drawn, as all fixed values.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Generic, Self, TypeVar

from pydantic import Discriminator, Field, Tag, model_validator

from scenarios.limits import DETECTIONS
from scenarios.schema.values import Model, NonNegative, Share, problem, within

N = TypeVar("N")


class Schedule(Model, Generic[N]):
    """A value that changes at given times.

    Attributes:
        at: times from which the values hold, s after the first frame; the first is 0
        value: as many values
        ramp: time that each change takes, s; 0 = at once
    """

    at: Annotated[tuple[NonNegative, ...], Field(min_length=2)]
    value: tuple[N, ...]
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
    table = isinstance(value, dict) and bool(value.keys() & {"at", "value", "ramp"})
    return "schedule" if table or isinstance(value, Schedule) else "number"


_EITHER = Discriminator(_kind)
_Alarms = Annotated[float, within(0.0, DETECTIONS / 5, " false alarms per frame")]
_Distance = Annotated[float, within(0.0, 1000.0, " m")]
_Factor = Annotated[float, within(0.0, 20.0)]
_Frames = Annotated[float, within(1.0, 1000.0, " frames")]
_Pixels = Annotated[float, within(0.0, 500.0, " px")]
Shares = Annotated[Annotated[Share, Tag("number")] | Annotated[Schedule[Share], Tag("schedule")], _EITHER]
Alarms = Annotated[Annotated[_Alarms, Tag("number")] | Annotated[Schedule[_Alarms], Tag("schedule")], _EITHER]
Distances = Annotated[Annotated[_Distance, Tag("number")] | Annotated[Schedule[_Distance], Tag("schedule")], _EITHER]
Factors = Annotated[Annotated[_Factor, Tag("number")] | Annotated[Schedule[_Factor], Tag("schedule")], _EITHER]
FrameSteps = Annotated[Annotated[_Frames, Tag("number")] | Annotated[Schedule[_Frames], Tag("schedule")], _EITHER]
Movements = Annotated[Annotated[_Pixels, Tag("number")] | Annotated[Schedule[_Pixels], Tag("schedule")], _EITHER]
