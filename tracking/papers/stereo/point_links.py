"""Points of `stereo` from detections: each detection is one point in space, linked from frame to frame (ours).

The links stand in for KLT: they give points ids and velocities. A detection continues the point whose predicted place
is near; pairs have the least total distance. A point on the ground has z = 0; a point in the image is u, v over the
scale, m. The covariance of a point is point_noise^2 in each coordinate.
"""

from __future__ import annotations

import numpy as np

from sim.arrays import no_ids
from sim.types import Array
from tracking.detect.features import SpacePoints, last_frames, slopes
from tracking.filters.assignment import optimal
from tracking.papers.stereo.config import StereoConfig

FASTEST = 2.0  # m/s: a point moves no faster than this relative to its prediction.
SPEED = 1.3  # m/s: standard deviation of the velocity of a point that was not seen before.


class PointLinks:
    """Detections as points with ids and velocities.

    State of the N points of the last frame: id (N,), from 1; world (N, K, 3): their places in the last K frames, m, nan
    before they were first seen.
    """

    def __init__(self, fps: float) -> None:
        self.fps = fps
        self.id, self.next_id, self.world = no_ids(), 1, np.zeros((0, 2, 3))

    def step(self, xyz: Array, config: StereoConfig) -> SpacePoints:
        """Returns the detections xyz (M, 3), m, of the next frame as points in space, in the same order."""
        frames, M = max(round(config.window_time * self.fps), 1) + 1, len(xyz)
        past = last_frames(self.world, frames)
        cost = np.linalg.norm((past[:, -1] + self._motion(past)[0] / self.fps)[:, None] - xyz, axis=2)
        cost[cost > FASTEST / self.fps + 3 * config.point_noise] = np.inf
        rows, columns = optimal(cost, 1e6)
        world, id = np.full((M, frames, 3), np.nan), np.full(M, -1)
        world[columns, :-1], id[columns] = past[rows, 1:], self.id[rows]
        world[:, -1] = xyz
        new = np.flatnonzero(id < 0)
        id[new] = np.arange(self.next_id, self.next_id + len(new))
        self.next_id += len(new)
        self.id, self.world = id, world
        return self._points(config)

    def forget(self) -> None:
        """Ends all links, after a frame without detections; returns nothing."""
        self.id, self.world = no_ids(), np.zeros((0, 2, 3))

    def _motion(self, world: Array) -> tuple[Array, Array]:
        known = np.isfinite(world[..., 0])
        moving = known.sum(1) > 1
        vel, spread = np.zeros((len(world), 3)), np.full(len(world), np.nan)
        times = np.arange(world.shape[1]) / self.fps
        vel[moving], spread[moving] = slopes(world[moving], known[moving], times)
        return vel, spread

    def _points(self, config: StereoConfig) -> SpacePoints:
        vel, spread = self._motion(self.world)
        vel_var = np.where(np.isnan(spread), SPEED**2, config.point_noise**2 / spread)
        cov = np.repeat(config.point_noise**2 * np.eye(3)[None], len(self.id), 0)
        return SpacePoints(self.id, self.world[:, -1].copy(), cov, vel, vel_var[:, None, None] * np.eye(3))
