"""OpenCV's mixture of Gaussians (MOG2, Zivkovic 2004) in place of the five-class background model, to compare with it.

`Mog2` has the constructor and the methods of `tracking.detect.background.Background`. `background_model` lets every
tracker from pixels use it.
"""

from __future__ import annotations

import math
from contextlib import AbstractContextManager

import cv2
import numpy as np

from benchmarks.support.replaced_code import replaced_code
from sim.types import Bools, Image
from tracking.detect import foreground
from tracking.detect.background_kernels import BACKGROUND, FOREGROUND, SHADOW
from tracking.detect.background_settings import BackgroundSettings

MOG2 = "MOG2"
"""Name of the curve or row of a benchmark that is measured with MOG2."""
VARIANCE = 16.0
"""OpenCV's default: squared Mahalanobis distance beyond which no Gaussian of the mixture explains a pixel."""
SHADOW_VALUE = 127
"""The value that OpenCV writes into a shadow pixel; foreground is 255, background 0."""


class Mog2:
    """A mixture of Gaussians per pixel. Classes are BACKGROUND, FOREGROUND and SHADOW.

    Of the settings it uses `dark` (limit between shadow and foreground, also OpenCV's default) and `background_time`.
    """

    def __init__(self, sample: Image, fps: float, settings: BackgroundSettings | None = None) -> None:
        self.fps = fps
        self.valid = np.ones(sample.shape[1:3], bool)
        self._model = cv2.createBackgroundSubtractorMOG2(len(sample), VARIANCE, True)
        self._model.setShadowValue(SHADOW_VALUE)
        self.follow(settings or BackgroundSettings())
        for frame in sample:
            self._model.apply(frame)

    def follow(self, settings: BackgroundSettings) -> None:
        """Replaces the settings; the learned Gaussians stay."""
        self._rate = 1 - math.exp(-1 / (self.fps * settings.background_time))
        self._model.setShadowThreshold(settings.dark)

    def classify(self, image: Image) -> Image:
        """Returns the class of each pixel (H, W) uint8 of a picture (H, W, 3) BGR uint8; the model does not learn."""
        found = self._model.apply(image, learningRate=0)
        classes = np.full(found.shape, BACKGROUND, np.uint8)
        classes[found == SHADOW_VALUE] = SHADOW
        classes[found > SHADOW_VALUE] = FOREGROUND
        return classes

    def adapt(self, image: Image, classes: Image, protected: Bools | None = None) -> None:
        """Learns from a picture; where `protected` (H, W) is True it is shown its own background instead."""
        if protected is not None and protected.any():
            image = np.where(protected[..., None], self._model.getBackgroundImage(), image)
        self._model.apply(image, learningRate=self._rate)


def background_model(curve: str) -> AbstractContextManager[None]:
    """Returns a context within which trackers from pixels use MOG2 if the curve is named so, else the five classes."""
    mog2 = [(foreground, "Background", Mog2), (foreground, "Ghosts", lambda *_: None)]  # ghosts are not looked for
    return replaced_code(mog2 if curve == MOG2 else [])
