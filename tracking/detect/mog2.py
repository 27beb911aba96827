"""OpenCV's mixture of Gaussians (Zivkovic 2004) as another source of the classes, for comparison."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sim.types import Bools, Image
from tracking.config import Config, param
from tracking.detect.background_training import check, check_frame
from tracking.detect.pixel_classes import BACKGROUND, FOREGROUND, SHADOW

SHADOW_VALUE = 127
"""What OpenCV writes where it finds a shadow; foreground is 255."""


@dataclass(frozen=True)
class Mog2Settings(Config):
    """OpenCV's own defaults, its history as a time."""

    tracker: ClassVar[str] = "mog2"

    variance: float = param(16.0, (1.0, 1000.0), "", "squared Mahalanobis distance beyond which a pixel is new", "log")
    shadow: float = param(0.5, (0.0, 1.0), "", "brightness, relative, below which a pixel is no shadow")
    background_time: float = param(20.0, (1.0, 1e6), "s", "time constant of adaptation", "log")


class Mog2:
    """The mixture model behind the interface of `Background`; state: OpenCV's, per pixel.

    valid (H, W): True everywhere. Highlights are foreground, nothing is dark foreground; there is no gain.
    """

    def __init__(self, sample: Image, fps: float, settings: Mog2Settings | None = None) -> None:
        import cv2

        check(sample)
        settings = settings or Mog2Settings()
        self.fps = fps
        self.valid = np.ones(sample.shape[1:3], bool)
        self._model = cv2.createBackgroundSubtractorMOG2(len(sample), settings.variance, True)
        self._model.setShadowValue(SHADOW_VALUE)
        self.follow(settings)
        for frame in sample:
            self._model.apply(frame)

    def follow(self, settings: Mog2Settings) -> None:
        """Take on thresholds and the time; what was learned stays."""
        self.settings = settings
        self._rate = 1 - math.exp(-1 / (self.fps * settings.background_time))
        self._model.setVarThreshold(settings.variance)
        self._model.setShadowThreshold(settings.shadow)

    def classify(self, image: Image) -> Image:
        """(H, W) uint8 classes of a frame (H, W, 3) BGR uint8."""
        check_frame(image, self.valid.shape)
        found = self._model.apply(image, learningRate=0)
        classes = np.full(found.shape, BACKGROUND, np.uint8)
        classes[found == SHADOW_VALUE] = SHADOW
        classes[found > SHADOW_VALUE] = FOREGROUND
        return classes

    def adapt(self, image: Image, classes: Image, protected: Bools | None = None) -> None:
        """Learn from a frame; `classes` are unused. Where `protected` (H, W), the model sees its own background."""
        check_frame(image, self.valid.shape)
        if protected is not None and protected.any():
            image = np.where(protected[..., None], self._model.getBackgroundImage(), image)
        self._model.apply(image, learningRate=self._rate)
