"""OpenCV's mixture of Gaussians (Zivkovic 2004) as an alternative background model, for comparison.

It gives each pixel of a BGR picture a class: background, foreground or shadow. The model learns from the frames of a
sample, later from each frame that `adapt` gets.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import cv2
import numpy as np

from sim.types import Bools, Image
from tracking.config import Config, param
from tracking.detect.background_kernels import BACKGROUND, FOREGROUND, SHADOW
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.background_training import check, check_frame

SHADOW_VALUE = 127
"""The value that OpenCV writes into a shadow pixel; foreground is 255, background 0."""


@dataclass(frozen=True)
class Mog2Settings(Config):
    """The parameters of `Mog2`; the defaults of `variance` (16) and `shadow` (0.5) are OpenCV's.

    variance: squared Mahalanobis distance beyond which a pixel is foreground. shadow: brightness relative to the
    background (0 to 1) below which a pixel is no shadow. background_time: time constant of adaptation, s. Raises
    InputError if a value is not in its range.
    """

    tracker: ClassVar[str] = "mog2"

    variance: float = param(
        16.0,
        (1.0, 1000.0),
        "",
        "squared Mahalanobis distance beyond which no Gaussian of the mixture explains a pixel",
        "log",
    )
    shadow: float = param(0.5, (0.0, 1.0), "", "brightness relative to the background below which a pixel is no shadow")
    background_time: float = param(20.0, (1.0, 1e6), "s", "time constant of adaptation", "log")

    @classmethod
    def like(cls, settings: BackgroundSettings) -> Self:
        """Returns Mog2Settings with shadow = settings.dark and the same background_time; `variance` is 16."""
        return cls(shadow=settings.dark, background_time=settings.background_time)


class Mog2:
    """A mixture of Gaussians per pixel (OpenCV's MOG2) with the interface of `background.Background`.

    State: OpenCV's model; settings; fps, frames per second; valid (H, W) bool, True everywhere. Classes are 0
    BACKGROUND, 1 FOREGROUND and 3 SHADOW; DARK and HIGHLIGHT do not occur. The constructor raises InputError if the
    sample has a wrong shape or dtype, or fewer than 10 frames.
    """

    def __init__(self, sample: Image, fps: float, settings: Mog2Settings | None = None) -> None:
        """Learn from all frames of a sample (K, H, W, 3) BGR uint8.

        fps: frames per second, for the time constant of `adapt`. settings: None stands for the defaults. Raises
        InputError if the sample has a wrong shape or dtype, or fewer than 10 frames.
        """
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
        """Replace the settings: thresholds and rate of adaptation change at once, the learned Gaussians stay."""
        self.settings = settings
        self._rate = 1 - math.exp(-1 / (self.fps * settings.background_time))
        self._model.setVarThreshold(settings.variance)
        self._model.setShadowThreshold(settings.shadow)

    def classify(self, image: Image) -> Image:
        """Returns the class of each pixel of a frame (H, W, 3) BGR uint8, as (H, W) uint8: 0 BACKGROUND, 1 FOREGROUND
        or 3 SHADOW.

        The model does not learn from the frame. Raises InputError if the frame's size or dtype is not the sample's.
        """
        check_frame(image, self.valid.shape)
        found = self._model.apply(image, learningRate=0)
        classes = np.full(found.shape, BACKGROUND, np.uint8)
        classes[found == SHADOW_VALUE] = SHADOW
        classes[found > SHADOW_VALUE] = FOREGROUND
        return classes

    def adapt(self, image: Image, classes: Image, protected: Bools | None = None) -> None:
        """Learn from a frame (H, W, 3) BGR uint8 with the time constant background_time; `classes` is not used.

        Where `protected` (H, W) is True the model is shown its own background image instead of the frame; None protects
        no pixel. Raises InputError if the frame's size or dtype is not the sample's.
        """
        check_frame(image, self.valid.shape)
        if protected is not None and protected.any():
            image = np.where(protected[..., None], self._model.getBackgroundImage(), image)
        self._model.apply(image, learningRate=self._rate)
