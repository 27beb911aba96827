"""Colour background subtraction into five classes (Horprasert, Harwood, Davis 2000; González et al. 2006, section 3).

Each pixel i has a mean colour E and standard deviations sigma. A colour I is split along the line through E:
    alpha = argmin |(I - alpha E) / sigma|,   CD = |(I - alpha E) / sigma|      (Horprasert et al., eqs 5, 6)
and normalised by their RMS over the training sample, so that one threshold each serves the whole image:
    (alpha - 1) / a_i,   CD / b_i                                               (eqs 9, 10; a_i, b_i: eqs 7, 8)
Classes, asked for in the order of González et al., 3.2: CD above its threshold is foreground; darker than the lower
threshold and than `dark` is dark foreground; above the upper threshold highlight; below the lower one shadow; else
background. The equations stand in tracking.detect.background_kernels (5, 6, 9, 10) and training_kernels (5 to 8).
Departures: docs/detection.md; of these: `dark` is a share of E's brightness, not a normalised threshold, and no pixel
within the noise is dark foreground; a highlight above `bright`, likewise a share, is foreground. Without colours
(R = G = B) there is no chromaticity to tell a shadow or a highlight by: whatever is darker is dark foreground, whatever
is brighter foreground.
"""

from __future__ import annotations

import math

import numpy as np

from sim.types import Bools, Image
from tracking.detect import brightness_gain as gains
from tracking.detect.background_settings import BackgroundSettings
from tracking.detect.background_training import FLOOR, check_frame, thresholds, train
from tracking.detect.pixel_classes import BACKGROUND as BACKGROUND
from tracking.detect.pixel_classes import DARK as DARK
from tracking.detect.pixel_classes import FOREGROUND as FOREGROUND
from tracking.detect.pixel_classes import HIGHLIGHT as HIGHLIGHT
from tracking.detect.pixel_classes import SHADOW as SHADOW
from tracking.detect.pixel_classes import Floats
from tracking.detect.pixel_classes import foreground as foreground

INTERLEAVE = 4
"""One row in so many is adapted per frame, by as many frames' worth."""


class Background:
    """The model of a still scene; it changes in `classify` (the gain) and in `adapt`.

    mean (3, H, W): E at gain 1, grey levels. var (3, H, W): sigma^2, grey levels squared, whatever the gain. s, b
    (H, W): normalisers of brightness (s = a |E / sigma|) and of CD, no unit, inf where
    there is no background. valid (H, W): False where the sample showed none; such pixels are background for ever.
    thresholds: of CD / b, lower and upper of (alpha - 1) / a. gain (3,): brightness of the frame classified last.
    bounds: alpha below which a dark pixel is dark foreground, alpha up to which a bright one is a highlight.
    """

    def __init__(self, sample: Image, fps: float, settings: BackgroundSettings | None = None) -> None:
        self.settings = settings or BackgroundSettings()
        self.fps = fps
        trained = train(sample, self.settings.detection_rate, self.settings.gain == "global")
        self.mean: Floats = np.ascontiguousarray(np.moveaxis(trained.mean, -1, 0))
        self.var: Floats = np.ascontiguousarray(np.moveaxis(np.square(trained.sigma), -1, 0))
        self.valid = trained.valid
        self.s, self.b = (np.where(self.valid, n, np.float32(np.inf)) for n in (trained.s, trained.b))
        self._counts = trained.counts
        self.gain: Floats = np.ones(3, np.float32)
        self._grid = gains.grid(*self.valid.shape)
        self._calm = self.valid[self._grid]
        self._turn = 0
        self._grey = bool((sample[..., :1] == sample).all())
        self.follow(self.settings)

    def follow(self, settings: BackgroundSettings) -> None:
        """Take on thresholds, bounds and times; what was learned stays."""
        self.settings = settings
        self.thresholds = thresholds(self._counts, settings.detection_rate)
        self.bounds = (1.0, 1.0) if self._grey else (settings.dark, settings.bright)

    def classify(self, image: Image) -> Image:
        """(H, W) uint8 classes of a frame (H, W, 3) BGR uint8."""
        import cv2

        from tracking.detect import background_kernels

        check_frame(image, self.valid.shape)
        if self.settings.gain == "global":
            self.gain = self._gain(image)
        limits = np.array([*self.thresholds, *self.bounds], np.float32)
        classes = np.empty(self.valid.shape, np.uint8)
        one, two, three = (np.asarray(plane, np.uint8).ravel() for plane in cv2.split(image))
        E, V = self.mean.reshape(3, -1), self.var.reshape(3, -1)
        background_kernels.classify(
            one, two, three, E, V, self.s.ravel(), self.b.ravel(), self.gain, limits, classes.reshape(-1)
        )
        self._calm = ~foreground(classes[self._grid]) & self.valid[self._grid]
        return classes

    def adapt(self, image: Image, classes: Image, protected: Bools | None = None) -> None:
        """Learn from a frame (H, W, 3) BGR uint8 and its classes (H, W), which must be those of the last `classify`, as
        the gain is; nothing where `protected` (H, W), the places of tracked people."""
        from tracking.detect import background_kernels

        check_frame(image, self.valid.shape)
        keep = np.zeros(self.valid.shape, bool) if protected is None else protected
        fast, slow = (
            1 - math.exp(-INTERLEAVE / (self.fps * time))
            for time in (self.settings.background_time, self.settings.foreground_time)
        )
        first, self._turn = self._turn, (self._turn + 1) % INTERLEAVE
        background_kernels.adapt(
            image, classes, keep, self.mean, self.var, self.gain, first, INTERLEAVE, fast, slow, FLOOR**2
        )

    def _gain(self, image: Image) -> Floats:
        """(3,) the gain over what was no foreground in the last frame, else over all pixels, else the last one."""
        seen = np.moveaxis(image[self._grid], -1, 0).astype(np.float32)
        mean = self.mean[:, *self._grid]
        found = gains.gain(seen, mean, self._calm)
        if found is None:
            found = gains.gain(seen, mean, self.valid[self._grid])
        return self.gain if found is None else found
