"""Geometry of a scenario's world, in m: pieces of walls without the openings of doors, distances, and queues.

Distances are from a point to the nearest wall or pillar. The places of a queue are points x, y, head first.
"""

from __future__ import annotations

import math
from functools import partial

from scenarios.schema.scenario import QueueOrder
from scenarios.schema.values import FixedPoint
from scenarios.schema.world import DoorSpec, WorldSpec

WallSegment = tuple[float, float, float, float]
DOOR_TOLERANCE = 0.05  # m


def wall_distance(wall: WallSegment, point: FixedPoint) -> float:
    """Returns the distance in m from a point to a wall."""
    dx, dy, x, y = wall[2] - wall[0], wall[3] - wall[1], point[0] - wall[0], point[1] - wall[1]
    share = min(max((x * dx + y * dy) / max(dx * dx + dy * dy, 1e-12), 0.0), 1.0)
    x, y = x - share * dx, y - share * dy
    return math.sqrt(x * x + y * y)


def door_fits(door: DoorSpec, wall: WallSegment) -> bool:
    """Returns True if the whole opening of a door lies on the wall, within 5 cm across."""
    room = min(math.dist(wall[:2], door.at), math.dist(wall[2:], door.at))
    return wall_distance(wall, door.at) <= DOOR_TOLERANCE and door.width / 2 <= room + 1e-9


def cut_walls(world: WorldSpec) -> tuple[list[WallSegment], list[WallSegment]]:
    """Returns the pieces of all walls, x1, y1, x2, y2 in m, without the openings of doors, and these openings.

    A door is cut out of the wall nearest to it. The motion depends on the order and the last bits of the pieces.
    """
    pieces, openings = list(world.walls), []
    for door in world.doors:
        if not pieces:  # the doors before have opened all walls
            break
        wall = min(pieces, key=partial(wall_distance, point=door.at))
        pieces.remove(wall)
        x, y, dx, dy = wall[0], wall[1], wall[2] - wall[0], wall[3] - wall[1]
        length = math.sqrt(dx * dx + dy * dy)
        dx, dy = dx / length, dy / length
        s = dx * (door.at[0] - x) + dy * (door.at[1] - y)
        low, high = max(0.0, s - door.width / 2), min(length, s + door.width / 2)
        before, opening, after = (
            (x + a * dx, y + a * dy, x + b * dx, y + b * dy) for a, b in ((0.0, low), (low, high), (high, length))
        )
        openings.append(opening)
        pieces += [before] * (low > 1e-9) + [after] * (length - high > 1e-9)
    return pieces, openings


def clearance(point: FixedPoint, world: WorldSpec) -> tuple[float, str]:
    """Returns the distance in m from a point to the nearest wall or pillar, and words for it; inf if none."""
    best = (math.inf, "nothing")
    for wall in cut_walls(world)[0]:
        best = min(best, (wall_distance(wall, point), f"the wall {[round(v, 2) for v in wall]}"))
    for x, y, radius in world.pillars:
        best = min(best, (math.dist(point, (x, y)) - radius, f"the pillar {[x, y, radius]}"))
    return best


def queue_places(event: QueueOrder, count: int) -> tuple[FixedPoint, ...]:
    """Returns the first `count` places (x, y) of a queue, m, head first; they may lie outside the world."""
    angle = math.radians(event.direction_deg)
    (x, y), step = event.at, event.spacing
    return tuple((x + k * step * math.cos(angle), y + k * step * math.sin(angle)) for k in range(count))
