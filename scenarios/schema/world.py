"""The keys of a scenario's table `world`: what stands, lies or hangs in it and does not move."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from scenarios.schema.colours import Colour
from scenarios.schema.values import FixedPoint, Model, NonNegative, Positive, Share, within

Length = Annotated[float, within(0.1, 10_000.0, " m")]


class DoorSpec(Model):
    """A door: an opening in a wall.

    Attributes:
        at: middle of the opening, m; must lie on a wall
        width: m
        open: times, s from the first recorded frame, from which to which the door is open; it is shut else, as the
            doors of a vehicle are on its way; absent: always open
    """

    at: FixedPoint
    width: Positive = 1.2
    open: tuple[tuple[float, float], ...] | None = None


class StairsSpec(Model):
    """A flight of stairs; its height rises from 0 at `foot` to `rise` at `head`.

    Attributes:
        foot: middle of the lowest edge, m
        head: middle of the highest edge, m
        width: width across, m
        rise: height of the head above the foot, m
        steps: number of steps
        landing: length of the level ground behind the head, m
        slowdown: share of the walking speed kept on the stairs
    """

    foot: FixedPoint
    head: FixedPoint
    width: Positive = 3.0
    rise: float = 1.5
    steps: Annotated[int, Field(ge=1)] = 10
    landing: NonNegative = 4.0
    slowdown: Annotated[float, Field(gt=0, le=1)] = 0.6


Extent = Annotated[float, within(0.002, 1000.0, " m")]


class BoxSpec(Model):
    """A box, upright or tilted, such as a crate, a board, a rail or a wall of its own pattern. People do not avoid it.

    Attributes:
        at: middle of the box, x, y and height above the ground, m
        size: width along its own x axis, depth along y, height along z, before it is turned, m
        turn_deg: angle by which it is turned about the vertical; 0 = along the axes of the world
        tilt_deg: angle by which it then leans over its own x axis; positive: its top moves towards its own +y
        colour: name or "#rrggbb"
        pattern: pattern of its sides: grain = irregular at all scales, plain = none, stripes, checks = repeated exactly
        period: length after which stripes or checks repeat, m
        gloss: share of the light that its sides mirror, of the empty scene and the sun; 0 = mat
    """

    at: tuple[float, float, float]
    size: tuple[Extent, Extent, Extent]
    turn_deg: float = 0.0
    tilt_deg: Annotated[float, within(-90.0, 90.0, " degrees")] = 0.0
    colour: Colour = "beige"
    pattern: Literal["grain", "plain", "stripes", "checks"] = "grain"
    period: Annotated[float, within(0.001, 100.0, " m")] = 0.2
    gloss: Share = 0.0


class WorldSpec(Model):
    """The immobile parts of the scene; by default an empty world.

    Attributes:
        size: extent in x and y, m
        walls: each wall: x1, y1, x2, y2 of its ends, m
        pillars: each pillar: x, y of its middle and radius, m
        stairs: flights of stairs
        doors: openings in walls
        service: service points (counters), m
        boxes: boxes that stand, lie, hang or lean; absent: none
        wall_height: height of the walls, m
        pillar_height: height of the pillars, m
    """

    size: tuple[Length, Length] = (16.0, 10.0)
    walls: tuple[tuple[float, float, float, float], ...] = ()
    pillars: tuple[tuple[float, float, Positive], ...] = ()
    stairs: tuple[StairsSpec, ...] = ()
    doors: tuple[DoorSpec, ...] = ()
    service: tuple[FixedPoint, ...] = ()
    boxes: tuple[BoxSpec, ...] | None = None
    wall_height: Positive = 2.5
    pillar_height: Positive = 2.5
