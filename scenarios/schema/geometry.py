"""Geometry of a scenario's world, in m: pieces of walls without the openings of doors, distances, and queues.

Distances are from a point to the nearest wall or pillar. The places of a queue are points x, y, head first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from scenarios.schema.scenario import DoorSpec, QueueOrder, WorldSpec
from scenarios.schema.values import FixedPoint

WallSegment = tuple[float, float, float, float]
DOOR_TOLERANCE = 0.05  # m


def along(wall: WallSegment, point: FixedPoint) -> FixedPoint:
    """Returns where a point lies relative to a wall: metres along it from its first end, and metres from its line."""
    x, y = point[0] - wall[0], point[1] - wall[1]
    length = math.dist(wall[:2], wall[2:])
    if length == 0:
        return 0.0, math.hypot(x, y)
    ex, ey = (wall[2] - wall[0]) / length, (wall[3] - wall[1]) / length
    return x * ex + y * ey, abs(x * ey - y * ex)


def door_fits(door: DoorSpec, wall: WallSegment) -> bool:
    """Returns True if the whole opening of a door lies on a wall."""
    s, off = along(wall, door.at)
    length = math.dist(wall[:2], wall[2:])
    return off <= DOOR_TOLERANCE and door.width / 2 <= s + 1e-9 and s + door.width / 2 <= length + 1e-9


def walls_without_doors(world: WorldSpec) -> Iterator[WallSegment]:
    """Yields the pieces of all walls, x1, y1, x2, y2 in m, that remain without the openings of doors."""
    for wall in world.walls:
        length = math.dist(wall[:2], wall[2:])
        ex, ey = ((wall[2] - wall[0]) / length, (wall[3] - wall[1]) / length) if length else (0.0, 0.0)
        start = 0.0
        openings = sorted((along(wall, d.at)[0], d.width / 2) for d in world.doors if door_fits(d, wall))
        for s, half in [*openings, (length, 0.0)]:
            if s - half > start or not openings:
                end = s - half
                yield wall[0] + start * ex, wall[1] + start * ey, wall[0] + end * ex, wall[1] + end * ey
            start = s + half


def clearance(point: FixedPoint, world: WorldSpec) -> tuple[float, str]:
    """Returns the distance in m from a point to the nearest wall or pillar, and words for that obstacle."""
    best = (math.inf, "nothing")
    for wall in walls_without_doors(world):
        s, off = along(wall, point)
        beyond = max(-s, s - math.dist(wall[:2], wall[2:]), 0.0)
        best = min(best, (math.hypot(off, beyond), f"the wall {[round(v, 2) for v in wall]}"))
    for x, y, radius in world.pillars:
        best = min(best, (math.dist(point, (x, y)) - radius, f"the pillar {[x, y, radius]}"))
    return best


def queue_places(event: QueueOrder, count: int) -> tuple[FixedPoint, ...]:
    """Returns the first `count` places (x, y) of a queue, m, head first; they may lie outside the world."""
    angle = math.radians(event.direction_deg)
    (x, y), step = event.at, event.spacing
    return tuple((x + k * step * math.cos(angle), y + k * step * math.sin(angle)) for k in range(count))
