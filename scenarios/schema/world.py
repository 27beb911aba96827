"""The keys of a scenario's world: its size, and the walls, doors, pillars, stairs and counters in it, in m."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from scenarios.schema.values import FixedPoint, Model, NonNegative, Positive


class DoorSpec(Model):
    """A door: an opening in a wall."""

    at: FixedPoint = Field(description="middle of the opening, m; must lie on a wall")
    width: Positive = Field(1.2, description="m")


class StairsSpec(Model):
    """A flight of stairs; its height rises from 0 at `foot` to `rise` at `head`."""

    foot: FixedPoint = Field(description="middle of the lowest edge, m")
    head: FixedPoint = Field(description="middle of the highest edge, m")
    width: Positive = Field(3.0, description="width across, m")
    rise: float = Field(1.5, description="height of the head above the foot, m")
    steps: Annotated[int, Field(ge=1)] = Field(10, description="number of steps")
    landing: NonNegative = Field(4.0, description="length of the level ground behind the head, m")
    slowdown: Annotated[float, Field(gt=0, le=1)] = Field(
        0.6, description="share of the walking speed kept on the stairs"
    )


class WorldSpec(Model):
    """The immobile parts of the scene; by default an empty world."""

    size: tuple[Positive, Positive] = Field((16.0, 10.0), description="extent in x and y, m")
    walls: tuple[tuple[float, float, float, float], ...] = Field(
        (), description="each wall: x1, y1, x2, y2 of its ends, m"
    )
    pillars: tuple[tuple[float, float, Positive], ...] = Field(
        (), description="each pillar: x, y of its middle and radius, m"
    )
    stairs: tuple[StairsSpec, ...] = Field((), description="flights of stairs")
    doors: tuple[DoorSpec, ...] = Field((), description="openings in walls")
    service: tuple[FixedPoint, ...] = Field((), description="service points (counters), m")
    wall_height: Positive = Field(2.5, description="height of the walls, m")
    pillar_height: Positive = Field(2.5, description="height of the pillars, m")
