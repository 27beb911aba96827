"""Groups that never reach their goal: walls leave them no way, or they stand short of it to the end.

A group has *no way* if its members are in a part of the free space that a goal or point of their way is not in. Free is
every point that is 0.21 m or more from all walls and pillars, on a grid of 5 cm, in worlds of up to 200 m by 200 m. A
group *stands* if its members have moved less than 0.5 m in the last 10 s and less than 0.1 m in the last second, more
than 2 m from the goal, without an order to wait.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from sim.crowd.population import BODY_RADIUS
from sim.elementary import length
from sim.geometry.walls import blocked, wall_distances
from sim.stuck import Immobile
from sim.types import Array, Bools, Ints, Scene

CELL = 0.05  # m
MOST_CELLS = 16_000_000  # in larger worlds only standing is found
FREE = BODY_RADIUS + 0.01  # m from walls and pillars
STAND_TIME = 10.0  # s
STAND_MOVE, STILL_MOVE = 0.5, 0.1  # m: less in this time, and in the last second, is standing
NEAR_GOAL = 2.0  # m: a group that stands nearer has found no better place


def has_way(scene: Scene, people: Array, goal: Array) -> bool:
    """Returns True if a body can walk from all of the points people (N, 2) m to the goal (2,) m."""
    if not len(scene.walls) + len(scene.pillars) or np.prod(scene.size) > MOST_CELLS * CELL * CELL:
        return True
    parts = _free_parts(scene, scene.walls)
    (end, *starts) = (_part(parts, point) for point in (goal, *people))
    return all(start == end for start in starts)


def room_sizes(scene: Scene, walls: Array, points: Array) -> list[tuple[int, int]]:
    """Returns for each of points (N, 2) m the number of the part of the free space that it is in, and its cells.

    walls (W, 2, 2), m: in place of the scene's. In a world that is too large all are in one part.
    """
    if np.prod(scene.size) > MOST_CELLS * CELL * CELL:
        return [(0, 0)] * len(points)
    parts = _free_parts(scene, walls)
    found = [_part(parts, point) for point in points]
    return [(part, int((parts == part).sum())) for part in found]


def _free_parts(scene: Scene, walls: Array) -> Ints:
    return _parts(
        *(float(x) for x in scene.size),
        tuple(np.asarray(walls, float).ravel().tolist()),
        tuple(np.asarray(scene.pillars, float).ravel().tolist()),
    )


@lru_cache(maxsize=8)
def _parts(width: float, height: float, walls: tuple[float, ...], pillars: tuple[float, ...]) -> Ints:
    """Returns the number of the connected part of free space of each grid cell, (X, Y); 0 where there is no room."""
    from scipy.ndimage import label

    x, y = (CELL * (np.arange(max(1, round(size / CELL))) + 0.5) for size in (width, height))
    free = np.ones((len(x), len(y)), bool)

    def near(low: Array, high: Array) -> tuple[slice, slice, Array]:
        """Returns the slices of the cells in and round a rectangle, and their middles."""
        rows, columns = (
            slice(*np.searchsorted(axis, (low[k] - FREE, high[k] + FREE)).tolist()) for k, axis in enumerate((x, y))
        )
        return rows, columns, np.stack(np.meshgrid(x[rows], y[columns], indexing="ij"), axis=-1)

    for wall in np.reshape(walls, (-1, 2, 2)):
        rows, columns, points = near(wall.min(axis=0), wall.max(axis=0))
        free[rows, columns] &= wall_distances(points, wall) >= FREE
    for a, b, radius in np.reshape(pillars, (-1, 3)).tolist():
        middle = np.array([a, b])
        rows, columns, points = near(middle - radius, middle + radius)
        free[rows, columns] &= length(points - middle) >= radius + FREE
    return np.asarray(label(free, np.ones((3, 3)))[0], np.int64)


def _part(parts: Ints, point: Array) -> int:
    """Returns the part of free space in which a point is, or that is nearest to it; points outside are moved to the
    border of the world."""
    k = np.clip(np.floor(point / CELL).astype(np.int64), 0, np.array(parts.shape) - 1)
    if not parts[tuple(k)]:
        free = np.argwhere(parts > 0)
        if not len(free):
            return 0
        away = free - k
        k = free[np.argmin((away * away).sum(axis=1))]
    return int(parts[tuple(k)])


def obstacle(scene: Scene, place: Array, goal: Array) -> str:
    """Returns in words what is in the straight way from a place (2,) m to a goal (2,) m: the nearest wall, door or
    pillar; "others" if there is none."""
    walls, doors = (np.asarray(part, float).reshape(-1, 2, 2) for part in (scene.walls, scene.doors))
    found = [(float(wall_distances(place, w)), f"the wall {_numbers(w)}") for w in walls if _crossed(place, goal, w)]
    for door in doors:
        if _crossed(place, goal, door):
            words = f"the door of {float(length(door[1] - door[0])):.2f} m at {_numbers(door.mean(axis=0))}"
            found.append((float(wall_distances(place, door)), words))
    for x, y, radius in np.asarray(scene.pillars, float).reshape(-1, 3).tolist():
        if wall_distances(np.array([x, y]), np.stack([place, goal])) < radius + BODY_RADIUS:
            found.append((float(length(place - np.array([x, y]))) - radius, f"the pillar {_numbers([x, y, radius])}"))
    return min(found, default=(0.0, "others"))[1]


def _crossed(place: Array, goal: Array, wall: Array) -> bool:
    return bool(blocked(place[None], goal[None], wall[None])[0])


def _numbers(values: object) -> str:
    return str([round(value, 2) for value in np.ravel(np.asarray(values, float)).tolist()])


def immobile_people(pos: Array, free: Bools, rate: float) -> tuple[Immobile, ...]:
    """Returns the people who stay within STAND_MOVE along x and y for STAND_TIME or more, while they are free to walk.

    They are looked at once a second. pos (C, P, 2): m, at C ticks, `rate` per s; nan while absent. free (C, P): False
    while something bids them wait.
    """
    seconds = slice(None, None, round(rate))
    pos, there, width = pos[seconds], (free & np.isfinite(pos[..., 0]))[seconds, :, None], round(STAND_TIME) + 1
    if len(pos) < width:
        return ()
    high, low = (sliding_window_view(np.where(there, pos, away), width, axis=0) for away in (np.inf, -np.inf))
    still = (high.max(axis=-1) - low.min(axis=-1) < STAND_MOVE).all(axis=2)  # (S, P): for the seconds from then on
    found = []
    for p in np.flatnonzero(still.any(axis=0)):
        edge = np.flatnonzero(np.diff(still[:, p], prepend=False, append=False))
        for first, end in edge.reshape(-1, 2).tolist():
            x, y = pos[first, p].tolist()
            found.append(Immobile(int(p) + 1, float(first), float(end - 1 + width - 1), (round(x, 2), round(y, 2))))
    return tuple(found)


def stands(states: Array, rate: float) -> bool:
    """Returns True if people have stood in the last 10 s. states (C, N, 4): x, y, vx, vy of N people at C ticks, `rate`
    per second; nan while absent."""
    last = states[-1 - round(STAND_TIME * rate) :, :, :2]
    if len(last) <= STAND_TIME * rate or not np.isfinite(last).all():
        return False
    still = last[-1 - round(rate) :]
    return bool((length(last - last[:1]) < STAND_MOVE).all() and (length(still - still[-1]) < STILL_MOVE).all())
