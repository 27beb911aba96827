"""Features: corners of people, followed from frame to frame by KLT, as 3-D points with velocities (Hoshikawa et al.
2011, sec. 3.1).

KLT is OpenCV's pyramidal Lucas-Kanade tracker on corners of Shi and Tomasi. A feature is followed forwards and
backwards; it ends where it does not come back to its place, and where it leaves the mask. Each feature keeps its
world points of the last frames. Its velocity is the slope of the line of least squares through those of the time
window. Features that have not lived through the time window are not used (Fig. 3). A feature also needs a disparity in
this frame and in more than half of the window's frames (ours). Of features that come close to each other the oldest
stays (ours).

Each point has a covariance of its own, C = J^-1 R J^-T with the Jacobian J of the pair (sim.scene.camera) and R of
(u, v, d): along the line of sight it grows with the squared depth. Of n measurements at times t_k the slope has the
covariance C / sum (t_k - mean t)^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np

from sim.arrays import no_ids
from sim.scene.camera import back_project, point_covariances
from sim.types import Array, Bools, Camera, Image, Ints
from tracking.detect.subtraction_stereo import Disparities, sampled

WINDOW = (9, 9)  # px: width and height of the patch that KLT compares.
LEVELS = 2  # Levels of the picture pyramid above the picture itself.
QUALITY = 0.005  # Least quality of a corner, relative to the best one (Shi and Tomasi).
BORDER = 1  # px: new corners keep away from the edge of their region by so much, as the ground shows through there.
SAMPLE = 1  # px: a feature's disparity is the median in a square of 2 SAMPLE + 1 px.
# A disparity below so many standard deviations of its error is not used: the error of its depth is not normal.
FAINT = 4.0
BACK_CHECK = 0.7  # px: a feature ends if u or v is so far off after following it forwards and backwards (ours).
MOST_FEATURES = 400  # Largest number of features.
CENTRE = np.float32(0.5)  # px: OpenCV counts places from the centre of the first pixel, the camera from its corner.


@dataclass(frozen=True, eq=False)
class SpacePoints:
    """M measured points in space.

    id (M,): the same number in each frame in which a point is measured. pos (M, 3): world x, y, z, m; cov (M, 3, 3):
    covariance of a measured position. vel (M, 3): m/s; vel_cov (M, 3, 3): covariance of a measured velocity.
    """

    id: Ints
    pos: Array
    cov: Array
    vel: Array
    vel_cov: Array

    def __len__(self) -> int:
        return len(self.pos)

    def at(self, rows: Ints | Bools) -> SpacePoints:
        """Returns the points of some rows: indices, or flags (M,)."""
        return SpacePoints(self.id[rows], self.pos[rows], self.cov[rows], self.vel[rows], self.vel_cov[rows])

    @classmethod
    def none(cls) -> SpacePoints:
        """Returns M = 0 points."""
        two, three = np.zeros((0, 3)), np.zeros((0, 3, 3))
        return cls(no_ids(), two, three, two, three)


class Features:
    """The features of a left camera, followed from frame to frame.

    State of N features: id (N,), from 1, none given twice; uv (N, 2): places in the picture, px, in the camera's count;
    world (N, K, 3) their points in the last K frames, m, nan where they were not measured; age (N,): frames since they
    were found. grey (H, W): the last picture, None before the first.
    """

    def __init__(self, camera: Camera, fps: float) -> None:
        self.camera, self.fps = camera, fps
        self.grey: Image | None = None
        self.id, self.next_id = no_ids(), 1
        self.uv, self.world, self.age = np.zeros((0, 2), np.float32), np.zeros((0, 2, 3)), np.zeros(0, np.int64)

    def step(
        self, grey: Image, mask: Bools, disparity: Disparities, window_time: float, spacing: float,
        deviations: tuple[float, float, float],
    ) -> SpacePoints:  # fmt: skip
        """Follows the features into the next picture, finds new ones, and returns those older than the time window.

        grey (H, W): the picture; mask (H, W): where features may lie; disparity (H, W), px. window_time: s that a
        feature must have been followed; spacing: least distance of a new feature from others, px; deviations (3,):
        standard deviations of u, v and disparity, px.
        """
        self.world = last_frames(self.world, max(round(window_time * self.fps), 1) + 1)
        if self.grey is not None and len(self.uv):
            self._follow(self.grey, grey, mask)
        self._thin(spacing)
        self._find(grey, mask, spacing)
        self.grey, self.age = grey, self.age + 1
        d = sampled(disparity, self.uv, SAMPLE)
        d[d < FAINT * deviations[2]] = np.nan
        here = back_project(self.camera, np.column_stack([self.uv, d]))
        self.world = np.concatenate([self.world[:, 1:], here[:, None]], 1)
        return self._measured(np.square(deviations))

    def forget(self) -> None:
        """Drops all features, after a lost picture for instance; returns nothing."""
        self.grey = None
        self._keep(np.zeros(len(self.uv), bool))

    def _keep(self, kept: Bools) -> None:
        self.id, self.uv = self.id[kept], self.uv[kept]
        self.world, self.age = self.world[kept], self.age[kept]

    def _follow(self, before: Image, now: Image, mask: Bools) -> None:
        start: Any = (self.uv - CENTRE)[:, None]
        follow: Any = partial(cv2.calcOpticalFlowPyrLK, winSize=WINDOW, maxLevel=LEVELS)
        found, there, _ = follow(before, now, start, None)
        again, back, _ = follow(now, before, found, None)
        off = np.abs(again - start)[:, 0].max(1)
        self.uv = found[:, 0] + CENTRE
        high, wide = mask.shape
        inside = (self.uv >= 0).all(1) & (self.uv < [wide, high]).all(1)
        good = inside & (there[:, 0] == 1) & (back[:, 0] == 1) & (off <= BACK_CHECK)
        cell = np.floor(np.where(good[:, None], self.uv, 0)).astype(int)
        self._keep(good & mask[cell[:, 1], cell[:, 0]])

    def _thin(self, spacing: float) -> None:
        cell = np.floor(self.uv / max(spacing / 2, 1.0)).astype(np.int64)
        order = np.argsort(-self.age, kind="stable")
        _, first = np.unique(cell[order], axis=0, return_index=True)
        kept = np.zeros(len(self.uv), bool)
        kept[order[first]] = True
        self._keep(kept)

    def _find(self, grey: Image, mask: Bools, spacing: float) -> None:
        room = MOST_FEATURES - len(self.uv)
        if room <= 0:
            return
        size = 2 * BORDER + 1
        free: Any = cv2.erode(mask.astype(np.uint8), np.ones((size, size), np.uint8))
        taken = np.ones(mask.shape, np.uint8)
        cell = np.floor(self.uv).astype(int)
        taken[cell[:, 1], cell[:, 0]] = 0
        reach = 2 * int(np.ceil(spacing)) - 1
        free = free & cv2.erode(taken, np.ones((reach, reach), np.uint8))
        if not free.any():
            return
        found = cv2.goodFeaturesToTrack(grey, room, QUALITY, max(spacing, 1.0), mask=free, blockSize=3)
        new = np.zeros((0, 2), np.float32) if found is None else found[:, 0] + CENTRE
        self.id = np.concatenate([self.id, np.arange(self.next_id, self.next_id + len(new))])
        self.next_id += len(new)
        self.uv = np.concatenate([self.uv, new])
        self.world = np.concatenate([self.world, np.full((len(new), *self.world.shape[1:]), np.nan)])
        self.age = np.concatenate([self.age, np.zeros(len(new), np.int64)])

    def _measured(self, var: Array) -> SpacePoints:
        frames = self.world.shape[1]
        known = np.isfinite(self.world[..., 0])
        old = (self.age >= frames) & known[:, -1] & (known.sum(1) > frames / 2)
        world, known = self.world[old], known[old]
        pos = world[:, -1]
        cov = point_covariances(self.camera, pos, var)
        vel, spread = slopes(world, known, np.arange(frames) / self.fps)
        return SpacePoints(self.id[old], pos, cov, vel, cov / spread[:, None, None])


def last_frames(world: Array, frames: int) -> Array:
    """Returns the points (N, K, 3) in the last `frames` frames, (N, frames, 3); nan is put before if K is less."""
    kept = world[:, -frames:]
    return np.concatenate([np.full((len(kept), frames - kept.shape[1], 3), np.nan), kept], 1)


def slopes(points: Array, known: Bools, times: Array) -> tuple[Array, Array]:
    """Returns the velocities (M, 3), m/s, of M points by least squares, and sum (t - mean t)^2 (M,), s^2. points (M, K,
    3), m: in K frames; known (M, K): where they are measured; times (K,), s."""
    mean = known @ times / np.maximum(known.sum(1), 1)
    t = np.where(known, times - mean[:, None], 0.0)
    spread = np.square(t).sum(1)
    slope = np.einsum("mk,mkd->md", t, np.where(known[..., None], points, 0.0)) / spread[:, None]
    return slope, spread
