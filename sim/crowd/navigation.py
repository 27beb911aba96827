"""The plan by which people walk: the scene of a scenario, with doors cut out of its walls, and the shortest ways in it.

A way leads from a start over wall ends and door middles to a goal.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.geometry import cut_walls
from scenarios.schema.scenario import WorldSpec
from sim.elementary import dot, length
from sim.types import Array, Bools, Scene

BEHIND = 0.7  # m behind a door, where nobody touches the wall any more
CLEARANCE = 0.6  # m kept from a wall's end on the way round it


def scene_of(world: WorldSpec) -> Scene:
    """Returns the world of a scenario as the arrays of a Scene, m."""
    return Scene.of(world, *cut_walls(world))


def wall_distances(point: Array, wall: Array) -> Array:
    """Returns the distances (...) m of points (..., 2) m from walls with the two ends `wall` (..., 2, 2) m."""
    along, off = wall[..., 1, :] - wall[..., 0, :], point - wall[..., 0, :]
    s = np.clip(dot(off, along) / np.maximum(dot(along, along), 1e-12), 0, 1)
    return length(off - s[..., None] * along)


def blocked(a: Array, b: Array, walls: Array) -> Bools:
    """Returns flags (...): True where the segment from a to b, (..., 2) m, crosses one of the walls (W, 2, 2) m.

    A segment that only touches a wall, or whose end lies on the wall, does not cross it.
    """
    if not len(walls):
        return np.zeros(a.shape[:-1], dtype=np.bool_)
    p, q = walls[:, 0], walls[:, 1]

    def side(o: Array, u: Array, v: Array) -> Array:
        return np.asarray(
            (u[..., 0] - o[..., 0]) * (v[..., 1] - o[..., 1]) - (u[..., 1] - o[..., 1]) * (v[..., 0] - o[..., 0])
        )

    a, b = a[..., None, :], b[..., None, :]
    crosses = (side(a, b, p) * side(a, b, q) < 0) & (side(p, q, a) * side(p, q, b) < 0)
    return np.asarray(crosses.any(axis=-1))


class Navigator:
    """Finds the shortest ways round walls and through doors in one scene.

    nodes (N, 2): middles of doors, then points beyond the ends of walls, m. edges (N, N): distance between two nodes in
    m, inf if a wall or door lies between them. Doors block segments like walls, so every way through a door leads over
    its middle.
    """

    def __init__(self, scene: Scene) -> None:
        self.size, self.walls = scene.size, np.asarray(scene.walls)
        self.doors = np.asarray(scene.doors).reshape(-1, 2, 2)
        self.closed = np.concatenate([self.walls.reshape(-1, 2, 2), self.doors])
        ends = self._wall_ends() if len(self.walls) else np.zeros((0, 2))
        self.nodes = np.concatenate([self.doors.mean(axis=1), ends])
        self.edges = self._lengths(self.nodes, self.nodes)

    def _wall_ends(self) -> Array:
        along = self.walls[:, 1] - self.walls[:, 0]
        along = along / length(along)[:, None]
        ends = np.concatenate([self.walls[:, 0] - CLEARANCE * along, self.walls[:, 1] + CLEARANCE * along])
        free = (wall_distances(ends[:, None], self.closed) > 0.9 * CLEARANCE).all(axis=1)
        inside = ((ends >= 0) & (ends <= self.size)).all(axis=1)
        return np.asarray(ends[inside & free])

    def _lengths(self, a: Array, b: Array) -> Array:
        d = length(a[:, None] - b[None])
        hidden = blocked(np.repeat(a[:, None], len(b), 1), np.repeat(b[None], len(a), 0), self.closed)
        return np.asarray(np.where(hidden, np.inf, d))

    def way(self, start: Array, goal: Array) -> tuple[Array, Bools] | None:
        """Returns the points (K, 2) m to walk to, the goal last, and flags (K,): True for points at a door.

        start, goal (2,): m. None if there is no way.
        """
        ends = np.stack([start, goal])
        if not blocked(ends[:1], ends[1:], self.closed)[0]:
            return ends[1:], np.zeros(1, dtype=np.bool_)
        points = np.concatenate([self.nodes, ends])
        n = len(points)
        lengths = np.full((n, n), np.inf)
        lengths[: n - 2, : n - 2] = self.edges
        lengths[: n - 2, n - 2 :] = self._lengths(self.nodes, ends)
        lengths[n - 2 :, : n - 2] = lengths[: n - 2, n - 2 :].T
        path = _shortest(lengths, n - 2, n - 1)
        if path is None:
            return None
        way, narrow, here = [], [], start
        for k in path:
            way.append(points[k])
            narrow.append(k < len(self.doors))
            # A second point beyond the door, where nobody touches the wall any more.
            if narrow[-1]:
                way.append(points[k] + self._beyond_door(k, points[k] - here))
                narrow.append(True)
            here = points[k]
        return np.array(way), np.array(narrow)

    def _beyond_door(self, door: int, way: Array) -> Array:
        along = self.doors[door, 1] - self.doors[door, 0]
        across = np.array([-along[1], along[0]]) / length(along)
        return np.asarray(BEHIND * across * (1.0 if dot(across, way) > 0 else -1.0))


def _shortest(lengths: Array, start: int, goal: int) -> list[int] | None:
    """Returns the shortest path as node indices without the start; None if there is none."""
    from scipy.sparse.csgraph import dijkstra

    far, before = dijkstra(lengths, indices=start, return_predecessors=True)
    if not np.isfinite(far[goal]):
        return None
    path = [goal]
    while before[path[-1]] != start:
        path.append(int(before[path[-1]]))
    return path[::-1]
