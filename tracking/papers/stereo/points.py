"""Points of `stereo` from pairs of pictures: foreground, subtraction stereo, people, features (secs. 2, 3.1).

Also here: person or not: the height and width of foreground regions from their points in space (Hoshikawa et al. 2011,
sec. 2).

A region is a blob of the foreground. Its height is the range of its points' world z, its width their range across the
line of sight: that between the 10 % and 90 % quantiles over 0.8. The points' own errors widen a range. A region is too
low or too narrow if even the measured range is, and too high only if the range without them is. The paper prints
neither its measure nor limits. Ours: a region that the edge of the image cuts is not too small for a person, a region
of several people may be of any width, and one with fewer than LEAST_POINTS disparities is nobody.

Also here: points of `stereo` from detections: each detection is one point in space, linked from frame to frame (ours).

The links stand in for KLT: they give points ids and velocities. A detection continues the point whose predicted place
is near; pairs have the least total distance. A point on the ground has z = 0; a point in the image is u, v over the
scale, m. The covariance of a point is point_noise^2 in each coordinate.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.arrays import no_ids
from sim.scene.camera import back_project, point_covariances
from sim.types import Array, Bools, Camera, Context, Image
from tracking.detect.blobs import Blobs, odd
from tracking.detect.features import Features, SpacePoints, last_frames, slopes
from tracking.detect.foreground import Foreground
from tracking.detect.subtraction_stereo import Disparities, SubtractionStereo
from tracking.filters.assignment import optimal
from tracking.papers.stereo.config import StereoConfig

QUANTILES = 0.1, 0.9  # Ranges are those between these quantiles: matches may be wrong.
NORMAL_RANGE = 2.563  # Range of a normal distribution between these quantiles, in standard deviations.
LEAST_HEIGHT, MOST_HEIGHT, LEAST_WIDTH = 0.5, 3.0, 0.1  # m, of a foreground region that is a person (sec. 2).
LEAST_POINTS = 5  # Points with a disparity that a region needs to be measured.


def person_mask(blobs: Blobs, disparity: Disparities, camera: Camera, deviations: tuple[float, float, float]) -> Bools:
    """Returns the foreground (H, W) bool of the regions that may be people; deviations (3,): standard deviations of a
    point's u, v and disparity, px."""
    height, width, error = sizes(blobs, disparity, camera, deviations)
    small = (height < LEAST_HEIGHT) | (width < LEAST_WIDTH)
    keep = np.isfinite(height) & (height**2 - error**2 <= MOST_HEIGHT**2) & (~small | blobs.cut())
    return np.asarray(np.concatenate([[False], keep])[blobs.label])


def sizes(
    blobs: Blobs, disparity: Disparities, camera: Camera, deviations: tuple[float, float, float]
) -> tuple[Array, Array, Array]:
    """Returns height, width and the height that errors alone would give, (M,) each, m, of M foreground regions."""
    found = np.full((3, len(blobs)), np.nan)
    row, column = np.nonzero(~np.isnan(disparity))
    blob = blobs.label[row, column] - 1
    points = back_project(camera, np.column_stack([column + 0.5, row + 0.5, disparity[row, column]]))
    axes = np.stack([[0.0, 0.0, 1.0], camera.rotation[0]])
    for k in np.flatnonzero(np.bincount(blob, minlength=len(blobs)) >= LEAST_POINTS).tolist():
        mine = points[blob == k]
        low, high = np.quantile(mine @ axes.T, QUANTILES, axis=0)
        middle = np.median(mine, 0)[None]
        error = NORMAL_RANGE * np.sqrt(point_covariances(camera, middle, np.square(deviations))[0, 2, 2])
        found[:, k] = np.append(high - low, error) / (QUANTILES[1] - QUANTILES[0])
    return found[0], found[1], found[2]


BLOCK = 0.27  # m: width of the block that is compared in matching.
FEATURE_SPACING = 0.09  # m: least distance of a new feature from the others in the image.


class PicturePoints:
    """From a pair of pictures to points in space on people.

    State: config; camera; foreground, the pipeline of the left picture; stereo, the matcher; features. Raises
    InputError if there is no camera with a baseline, or the background sample cannot be used; AssertionError without a
    sample.
    """

    def __init__(self, config: StereoConfig, context: Context) -> None:
        self.camera = stereo_camera(context.camera)
        self.foreground = Foreground(context, config)
        self.features = Features(self.camera, context.fps)
        self.follow(config)

    def follow(self, config: StereoConfig) -> None:
        """Replaces the config: the matcher is made anew; features and what the background model learned stay."""
        self.config = config
        self.foreground.follow(config)
        largest = self.camera.focal_px[0] * self.camera.baseline / config.nearest
        block = odd(BLOCK * self.foreground.scale, 5)
        self.stereo = SubtractionStereo(largest, block)

    def points(self, image: Image, right: Image) -> SpacePoints:
        """Returns the features on people in a pair of pictures as points in space; none if too much is foreground.
        Raises InputError if the pictures differ in shape."""
        if right.shape != image.shape:
            expected = f"the left picture's shape {image.shape}"
            raise InputError(place="right picture", got=str(right.shape), expected=expected, remedy="give a pair")
        seen = self.foreground.segment(image)
        if not seen.plausible:
            self.foreground.adapt(seen, np.zeros(self.foreground.shape, bool))
            self.features.forget()
            return SpacePoints.none()
        c, left = self.config, grey(image)
        blobs = self.foreground.person_blobs(seen.mask)
        disparity = self.stereo.match(left, grey(right), blobs)
        deviations = (c.pixel_noise, c.pixel_noise, c.disparity_noise)
        people = person_mask(blobs, disparity, self.camera, deviations)
        self.foreground.adapt(seen, people)
        spacing = FEATURE_SPACING * self.foreground.scale
        found = self.features.step(left, people, disparity, c.window_time, spacing, deviations)
        return moved_away(found, self.camera, c.surface_offset)


def moved_away(points: SpacePoints, camera: Camera, offset: float) -> SpacePoints:
    """Returns M points moved away from the camera, horizontally, by `offset`, m."""
    away = points.pos[:, :2] - camera.position[:2]
    shift = offset * away / np.maximum(np.linalg.norm(away, axis=1), 1e-9)[:, None]
    pos = np.column_stack([points.pos[:, :2] + shift, points.pos[:, 2]])
    return replace(points, pos=pos)


def stereo_camera(camera: Camera | None) -> Camera:
    """Returns the camera unchanged if it can be that of a rectified pair: pinhole, with a baseline, without lens
    distortion; else raises InputError."""
    if camera is not None and camera.kind == "pinhole" and camera.baseline > 0 and not camera.radial:
        return camera
    got = "no camera" if camera is None else f"{camera.kind}, baseline {camera.baseline:g}, radial {camera.radial:g}"
    remedy = "give --camera FILE of a rectified pair, with its baseline; without one take another tracker, as blob"
    expected = "a pinhole camera with a baseline, without lens distortion"
    raise InputError(place="context.camera", got=got, expected=expected, remedy=remedy)


def grey(image: Image) -> Any:
    """Returns the grey values (H, W) uint8 of a picture (H, W, 3) BGR."""
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


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
