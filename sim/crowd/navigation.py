"""The plan by which people walk: the scene of a scenario, with doors cut out of its walls, and the shortest ways in it.

A way leads from a start over wall ends and door middles to a goal.
"""

from __future__ import annotations

import numpy as np

from scenarios.schema.geometry import cut_walls
from scenarios.schema.world import WorldSpec
from sim.crowd.forces import CORNER, FREE
from sim.elementary import dot, length
from sim.geometry.walls import blocked, wall_distances
from sim.types import Array, Ints, Scene

CLEARANCE = 0.6  # m kept from a wall's end on the way round it
TOUCH = 0.01  # m: walls so near to each other meet


def scene_of(world: WorldSpec) -> Scene:
    """Returns the world of a scenario as the arrays of a Scene, m."""
    return Scene.of(world, *cut_walls(world))


NARROW_GAP, LEAST_GAP = 2.5, 0.42  # m: a gap between walls of such a width is a gate, as a door is


class Navigator:
    """Finds the shortest ways round walls and through gates in one scene.

    gates (K, 2, 2): the ends of doors and of narrow gaps between walls, m. closed (W + K, 4): walls, then gates, as x1,
    y1, x2, y2: gates block segments like walls, so every way through a gate leads over its middle. nodes (N, 2):
    middles of gates, then points round the ends of walls, m. far (N, N): length of the shortest way between two nodes
    in m, inf for none.
    """

    def __init__(self, scene: Scene) -> None:
        self.size, self.walls = scene.size, np.asarray(scene.walls, float).reshape(-1, 2, 2)
        self.first = len(self.walls)
        doors = np.asarray(scene.doors, float).reshape(-1, 2, 2)
        self.gates = np.concatenate([doors, self._gaps(doors)])
        self.closed = np.concatenate([self.walls, self.gates]).reshape(-1, 4)
        ends = self._wall_ends() if len(self.walls) else np.zeros((0, 2))
        self.nodes = np.concatenate([self.gates.mean(axis=1), ends])
        self.far, self._before = np.zeros((0, 0)), np.zeros((0, 0), np.int64)
        if len(self.nodes):
            from scipy.sparse.csgraph import dijkstra

            from sim.crowd.wayfinding_kernels import between

            self.far, self._before = dijkstra(between(self.nodes, self.closed, self.first), return_predecessors=True)

    def _gaps(self, doors: Array) -> Array:
        """Returns the narrow gaps (K, 2, 2) between the end of a wall and another one or the border, without doors."""
        found: list[Array] = []
        x, y = self.size.tolist()
        corners = np.array([[0.0, 0.0], [x, 0.0], [x, y], [0.0, y]])
        solid = np.concatenate([self.walls, np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)])
        near_by = wall_distances(self.walls[:, :, None], solid) < NARROW_GAP + TOUCH
        for k, which, o in np.argwhere(near_by).tolist():
            end, other = self.walls[k, which], solid[o]
            along, off = other[1] - other[0], end - other[0]
            foot = other[0] + np.clip(dot(off, along) / max(float(dot(along, along)), 1e-12), 0, 1) * along
            gap, middle = np.stack([end, foot]), (end + foot) / 2
            if k == o or not LEAST_GAP < float(length(end - foot)) < NARROW_GAP:
                continue
            near = [*doors.mean(axis=1), *(g.mean(axis=0) for g in found)]
            if any(float(length(middle - m)) < NARROW_GAP / 2 for m in near):
                continue
            a, b = (gap + 1e-6 * (gap[::-1] - gap))[:, None]
            if blocked(a, b, self.walls).any():
                continue
            across = np.array([foot[1] - end[1], end[0] - foot[0]]) / length(foot - end)
            sides = middle + CLEARANCE * np.stack([across, 0 * across, -across])
            if (wall_distances(sides[:, None], solid) > LEAST_GAP / 2.1).all():  # no corner, nor a wall
                found.append(gap)
        return np.array(found).reshape(-1, 2, 2)

    def _wall_ends(self) -> Array:
        along = self.walls[:, 1] - self.walls[:, 0]
        along = along / length(along)[:, None]
        ends = np.concatenate(
            [self.walls[:, 0] - CLEARANCE * along, self.walls[:, 1] + CLEARANCE * along, self._joints()]
        )
        closed = self.closed.reshape(-1, 2, 2)
        free = (wall_distances(ends[:, None], closed) > 0.9 * CLEARANCE).all(axis=1)
        inside = ((ends >= 0) & (ends <= self.size)).all(axis=1)
        return np.asarray(ends[inside & free])

    def _joints(self) -> Array:
        """Returns points (J, 2) outside the corners at which two walls meet, on the line that halves the angle."""
        found = []
        ends = self.walls[:, None, :, None] - self.walls[None, :, None, :]
        for k, o, a, b in np.argwhere(length(ends) < TOUCH).tolist():
            if o < k:
                wall, other = self.walls[k], self.walls[o]
                away = sum((w[e] - w[1 - e]) / length(w[e] - w[1 - e]) for w, e in ((wall, a), (other, b)))
                if float(length(away)) > TOUCH:
                    found.append(wall[a] + CLEARANCE * away / length(away))
        return np.array(found).reshape(-1, 2)

    def beyond(self, gate: int, before: Array, after: Array) -> float:
        """Returns the side of a gate to which a way leads from the point before it: 1.0 for its left, or -1.0.

        before, after (2,): m. The point after it counts where that before lies on the gate's own line.
        """
        a, b = self.gates[gate]
        along = (b - a) / length(b - a)
        here, there = (float(along[0] * (p - a)[1] - along[1] * (p - a)[0]) for p in (before, after))
        return 1.0 if (there if abs(here) < TOUCH else -here) > 0 else -1.0

    def way(self, start: Array, goal: Array) -> tuple[Array, Ints] | None:
        """Returns the points (K, 2) m to walk to, the goal last, and for each the gate that it lies in (K,).

        It is CORNER for points in no gate, and FREE for the goal.

        start, goal (2,): m. None if there is no way.
        """
        ends = np.stack([start, goal])
        straight = ends[1:], np.full(1, FREE)
        if not len(self.closed):
            return straight
        from sim.crowd.wayfinding_kernels import in_sight, sees

        if sees(start[0], start[1], goal[0], goal[1], self.closed, self.first, -1, -1):
            return straight
        if not len(self.nodes):
            return None
        here, there = in_sight(ends, self.nodes, self.closed, self.first)
        lengths = here[:, None] + self.far + there
        n, m = np.unravel_index(np.argmin(lengths), lengths.shape)
        if not np.isfinite(lengths[n, m]):
            return None
        path = [int(m)]
        while path[-1] != n:
            path.append(int(self._before[n, path[-1]]))
        nodes = np.array(path[::-1])
        gates = np.append(np.where(nodes < len(self.gates), nodes, CORNER), FREE)
        return np.concatenate([self.nodes[nodes], ends[1:]]), gates
