"""Points of `stereo` from pairs of pictures: foreground, subtraction stereo, people, features (secs. 2, 3.1)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import numpy as np

from scenarios.errors import InputError
from sim.types import Camera, Context, Image
from tracking.detect.blobs import odd
from tracking.detect.features import Features, SpacePoints
from tracking.detect.foreground import Foreground
from tracking.detect.subtraction_stereo import SubtractionStereo
from tracking.papers.stereo.config import StereoConfig
from tracking.papers.stereo.person_regions import person_mask

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
